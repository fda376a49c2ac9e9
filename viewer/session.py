"""What all pages of a viewer share: the scene, the setups as opened, points and drawings, the
folder to save in.
"""

import threading
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ..coverage.occlusion.model import Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.rings.rounding import rounded
from ..coverage.targets import Target
from ..objectives.feasibility.clearance import MountClearance
from ..objectives.feasibility.violations import faults
from ..objectives.occlusion import check_mounting
from ..objectives.scene import Scene
from .drawing import Drawing, DrawnParts
from .quick_estimate import QuickEstimate
from .robot_surface import Skin
from .tasks import seen_under

_GAP = 0.5  # m, between two setups side by side
# From where to look, in diagonals of what is looked at: at one setup, and at two, of which none
# shall hide the other.
_EYE, _EYE_OF_TWO = np.array([0.62, -1.0, 0.42]), np.array([1.0, -0.35, 0.45])
_BESIDE = (Target("V_S", 0.5), Target("V_S", 1.5), Target("V_OT"))


def shown_targets(scene: Scene) -> tuple[Target, ...]:
    """The targets of a scene; where it has but one, beside it those that the paper's setups are
    told by.
    """
    own = [goal.target for goal in scene.goals]
    beside = [t for t in _BESIDE if t.radius is None or t.radius > scene.shape.robot_radius]
    return tuple(dict.fromkeys([*own, *beside] if len(own) == 1 else own))


class ViewerSession:
    """One scene and one or two setups in it, for many pages at once: nothing changes but what is
    kept of what was asked.

    turn: held by the page whose long work is being done.
    """

    def __init__(
        self,
        scene: Scene,
        setups: dict[str, Setup],
        out: Path | None = None,
        body: Skin | None = None,
    ) -> None:
        """``setups``: one or two, by what they are called."""
        self.scene, self.out = scene, out
        self.setups = {name: rounded(setup, scene.sensor) for name, setup in setups.items()}
        self.targets = shown_targets(scene)
        self.glance = QuickEstimate(scene, self.targets)
        self.drawing = Drawing(self.glance, body)
        self.turn = threading.Lock()
        self._clear = lru_cache(3)(lambda occlusion: MountClearance(seen_under(scene, occlusion)))

    def places(self) -> list[tuple[float, float, float]]:
        """Where each setup stands on the page, m: beside each other, as far apart as the first
        target is wide.
        """
        low, high = self.drawing.box(DrawnParts(0, self.targets[0], self.scene.occlusion))
        return [(0.0, i * (float(high[1] - low[1]) + _GAP), 0.0) for i in range(len(self.setups))]

    def look(self, choice: DrawnParts) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
        """From where to look, and at what, (3,) m both: at the whole target of all setups, from
        aside and a little above.
        """
        low, high = self.drawing.box(choice)
        high = high + np.array(self.places()[-1])
        middle, far = (low + high) / 2, float(np.linalg.norm(high - low))
        return middle + far * (_EYE if len(self.setups) == 1 else _EYE_OF_TWO), middle

    def broken(self, setup: Setup, occlusion: Occlusion) -> list[str]:
        """The scene's rules that a setup breaks, in words."""
        scene = seen_under(self.scene, occlusion)
        found = [
            f.text
            for f in faults(scene, setup.rings, self._clear(occlusion) if scene.real else None)
        ]
        if occlusion != "ignore":
            try:
                check_mounting(scene, setup)
            except ValueError as error:
                found.append(str(error))
        return found
