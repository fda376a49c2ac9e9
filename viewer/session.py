"""State that all pages share: the scene, the opened setups, caches, and the folder for saving."""

import threading
import time
from dataclasses import replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.rings.rounding import rounded
from ..coverage.targets.named import ReachAndToolSpheres, Shell
from ..coverage.targets.target import Target
from ..objectives.feasibility.clearance import MountClearance
from ..objectives.feasibility.mounting import Fault
from ..objectives.feasibility.violations import faults
from ..objectives.named_layouts import layout_in
from ..objectives.occlusion import own_link_fault, unseeing
from ..objectives.scene import Scene
from .camera import ASPECT, fitted
from .drawing import Drawing
from .drawn_parts import DrawnParts, arm_direction
from .quick_estimate import QuickEstimate
from .triangle_meshes import Skin

_GAP = 0.5  # m, gap between two setups
# Direction of the first view: of one setup, square to the arm but turned and raised by these parts
# of it; of two setups, so that they do not hide each other.
_TURNED, _RAISED, _EYE_OF_TWO = 0.3, 0.3, np.array([1.0, -0.35, 0.45])
_PRESETS = ("n1_8_0", "n1_16_0", "n2_16_25", "n2_16_55", "n3_16_55")
_BESIDE = (Shell(0.5), Shell(1.5), ReachAndToolSpheres())


def shown_targets(scene: Scene) -> tuple[Target, ...]:
    """Return the targets of a scene; a single target is followed by the paper's targets."""
    own = [goal.target for goal in scene.targets]
    beside = [t for t in _BESIDE if all(r > scene.curve.robot_radius for r in t.radii)]
    return tuple(dict.fromkeys([*own, *beside] if len(own) == 1 else own))


class ViewerSession:
    """One scene and one or two setups in it, for many pages at once.

    Only its caches, and how long they took, change. ``turn`` is a lock that the page with the
    running task holds.
    """

    def __init__(
        self,
        scene: Scene,
        setups: dict[str, Setup],
        out: Path | None = None,
        body: Skin | None = None,
    ) -> None:
        """Prepare the estimate and the drawing.

        Args:
            scene: robot, poses, goals, rules.
            setups: one or two setups by name.
            out: folder for saving, or None.
            body: surface of the robot, or None.
        """
        self.scene, self.out = scene, out
        self.setups = {name: rounded(setup, scene.sensor) for name, setup in setups.items()}
        self.targets = shown_targets(scene)
        self.glance = QuickEstimate(scene, self.targets)
        self.drawing = Drawing(self.glance, body)
        self.turn = threading.Lock()
        self.broken = lru_cache(256)(self._broken)
        self.judging = 0.0
        """Time that the last setup's rules took, s."""

    def places(self) -> list[tuple[float, float, float]]:
        """Return the position of each setup on the page, m, side by side and one target width
        apart.
        """
        low, high = self.drawing.box(DrawnParts(0, self.targets[0], self.scene.occlusion))
        return [(0.0, i * (float(high[1] - low[1]) + _GAP), 0.0) for i in range(len(self.setups))]

    def extent(self, choice: DrawnParts) -> Float[np.ndarray, "N 3"]:
        """Return points (N, 3) m that surround what the page shows of all setups."""
        one = self.drawing.extent(choice)
        return np.concatenate([one + np.array(place) for place in self.places()])

    def start_direction(self, pose: int = 0) -> Float[np.ndarray, " 3"]:
        """Return the direction (3,) from the scene to the camera of the first view.

        It looks at the arm from the side, slightly from ahead and above.
        """
        if len(self.setups) > 1:
            return _EYE_OF_TWO
        x, y = arm_direction(self.drawing.curve(pose))
        return np.array([y + _TURNED * x, -x + _TURNED * y, _RAISED])

    def start_view(self) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
        """Return the camera's first position and the point that it looks at, both (3,) m."""
        choice = DrawnParts(0, self.targets[0], self.scene.occlusion)
        return fitted(self.extent(choice), self.start_direction(), ASPECT)

    @cached_property
    def widest(self) -> float:
        """Largest coordinate of a target at the first pose, m."""
        boxes = (
            self.drawing.box(DrawnParts(0, target, self.scene.occlusion)) for target in self.targets
        )
        return float(max(np.abs(box).max() for box in boxes))

    @cached_property
    def presets(self) -> dict[str, Setup]:
        """The paper's layouts that fit on the robot's links, by name."""
        found = dict[str, Setup]()
        for name in _PRESETS:
            setup = layout_in(self.scene, name)
            if all(ring.link in self.scene.robot.links for ring in setup.rings):
                found[name] = rounded(setup, self.scene.sensor)
        return found

    @cached_property
    def _clear(self) -> MountClearance | None:
        return MountClearance(self.scene) if self.scene.real else None

    def _broken(self, setup: Setup, occlusion: Occlusion) -> tuple[Fault, ...]:
        """Return the scene's rules that a setup violates, as the search and ``verify`` have them;
        see ``judging``.
        """
        began, scene = time.perf_counter(), replace(self.scene, occlusion=occlusion)
        found = faults(scene, setup.rings, self._clear)
        if occlusion != "ignore" and (text := own_link_fault(scene, setup)) is not None:
            alone = (own_link_fault(scene, Setup((ring,))) for ring in setup.rings)
            found.append(Fault((next(i for i, one in enumerate(alone) if one),), "link", text))
        found += self._within(setup)
        self.judging = time.perf_counter() - began
        return tuple(found)

    def _within(self, setup: Setup) -> list[Fault]:
        """Return each single sensor that lies in a body, at the scene's first pose."""
        if not (setup.singles and self.scene.robot.bodies):
            return []
        scene = replace(self.scene, poses=self.scene.poses[:1], cell_sensors=())
        named = (
            replace(one, name=one.name or str(i))
            for i, one in enumerate(setup.singles, start=len(setup.rings))
        )
        return [
            Fault(
                (len(setup.rings) + one.ring,),
                "mount",
                f"{one.single} lies {1000 * one.depth:.0f} mm within {one.within} and sees nothing",
            )
            for one in unseeing(scene, Setup((), tuple(named)))
            if one.within
        ]
