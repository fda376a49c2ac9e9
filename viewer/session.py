"""State that all pages share: the scene, the opened setups, caches, and the folder for saving."""

import threading
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.rings.rounding import rounded
from ..coverage.targets import Target
from ..objectives.feasibility.clearance import MountClearance
from ..objectives.feasibility.violations import faults
from ..objectives.occlusion import own_link_fault, unseeing
from ..objectives.scene import CoreScene
from .drawing import Drawing, DrawnParts
from .quick_estimate import QuickEstimate
from .robot_surface import Skin

_GAP = 0.5  # m, gap between two setups
# Position of the camera in diagonals of the view: for one setup, and for two that must not hide
# each other.
_EYE, _EYE_OF_TWO = np.array([0.62, -1.0, 0.42]), np.array([1.0, -0.35, 0.45])
_BESIDE = (Target("V_S", 0.5), Target("V_S", 1.5), Target("V_OT"))


def shown_targets(scene: CoreScene) -> tuple[Target, ...]:
    """Return the targets of a scene; a single target is followed by the paper's targets."""
    own = [goal.target for goal in scene.goals]
    beside = [t for t in _BESIDE if t.radius is None or t.radius > scene.shape.robot_radius]
    return tuple(dict.fromkeys([*own, *beside] if len(own) == 1 else own))


class ViewerSession:
    """One scene and one or two setups in it, for many pages at once.

    Only its caches change. ``turn`` is a lock that the page with the running task holds.
    """

    def __init__(
        self,
        scene: CoreScene,
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

    def places(self) -> list[tuple[float, float, float]]:
        """Return the position of each setup on the page, m, side by side and one target width
        apart.
        """
        low, high = self.drawing.box(DrawnParts(0, self.targets[0], self.scene.occlusion))
        return [(0.0, i * (float(high[1] - low[1]) + _GAP), 0.0) for i in range(len(self.setups))]

    def look(self, choice: DrawnParts) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
        """Return the camera's position and the point that it looks at, both (3,) m.

        The whole target of all setups is visible, from the side and slightly above.
        """
        low, high = self.drawing.box(choice)
        high = high + np.array(self.places()[-1])
        middle, far = (low + high) / 2, float(np.linalg.norm(high - low))
        return middle + far * (_EYE if len(self.setups) == 1 else _EYE_OF_TWO), middle

    @cached_property
    def _clear(self) -> MountClearance | None:
        return MountClearance(self.scene) if self.scene.real else None

    def broken(self, setup: Setup, occlusion: Occlusion) -> list[str]:
        """Return the scene's rules that a setup violates, as texts."""
        scene = replace(self.scene, occlusion=occlusion)
        found = [f.text for f in faults(scene, setup.rings, self._clear)]
        if occlusion != "ignore" and (fault := own_link_fault(scene, setup)) is not None:
            found.append(fault)
        return found + self._within(setup)

    def _within(self, setup: Setup) -> list[str]:
        """Return a text for each single sensor that lies in a body, at the scene's first pose."""
        if not (setup.singles and self.scene.robot.bodies):
            return []
        scene = replace(self.scene, poses=self.scene.poses[:1], cell_sensors=())
        named = (
            replace(one, name=one.name or str(i))
            for i, one in enumerate(setup.singles, start=len(setup.rings))
        )
        return [
            f"{one.single} lies {1000 * one.depth:.0f} mm within {one.within} and sees nothing"
            for one in unseeing(scene, Setup((), tuple(named)))
            if one.within
        ]
