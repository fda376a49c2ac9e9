"""What all pages of a viewer share: the scene, the setups as opened, points and drawings, the folder to save in."""

import threading
from functools import lru_cache
from pathlib import Path

from ...coverage.occlusion import Occlusion
from ...coverage.rings import Setup
from ...coverage.targets import Target
from ...objectives.clear import Clear
from ...objectives.faults import faults
from ...objectives.scene import Scene
from ...objectives.sight import check_mounting
from ...placement.convert import rounded
from .drawing import Drawing
from .glance import Glance
from .surface import Skin
from .work import seen_under

_BESIDE = (Target("V_S", 0.5), Target("V_S", 1.5), Target("V_OT"))


def shown_targets(scene: Scene) -> tuple[Target, ...]:
    """The targets of a scene; where it has but one, beside it those that the paper's setups are told by."""
    own = [goal.target for goal in scene.goals]
    beside = [t for t in _BESIDE if t.radius is None or t.radius > scene.shape.robot_radius]
    return tuple(dict.fromkeys([*own, *beside] if len(own) == 1 else own))


class Room:
    """One scene and one or two setups in it, for many pages at once: nothing changes but what is kept of what was asked.

    turn: held by the page whose long work is being done.
    """

    def __init__(self, scene: Scene, setups: dict[str, Setup], out: Path | None = None, body: Skin | None = None) -> None:
        """``setups``: one or two, by what they are called."""
        self.scene, self.out = scene, out
        self.setups = {name: rounded(setup, scene.sensor) for name, setup in setups.items()}
        self.targets = shown_targets(scene)
        self.glance = Glance(scene, self.targets)
        self.drawing = Drawing(self.glance, body)
        self.turn = threading.Lock()
        self._clear = lru_cache(3)(lambda occlusion: Clear(seen_under(scene, occlusion)))

    def broken(self, setup: Setup, occlusion: Occlusion) -> list[str]:
        """The scene's rules that a setup breaks, in words."""
        scene = seen_under(self.scene, occlusion)
        found = [f.text for f in faults(scene, setup.rings, self._clear(occlusion) if scene.real else None)]
        if occlusion != "ignore":
            try:
                check_mounting(scene, setup)
            except ValueError as error:
                found.append(str(error))
        return found
