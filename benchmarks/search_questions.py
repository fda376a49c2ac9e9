"""Questions of the benchmark of searches: scenes, budgets and criteria as data."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from place_rings.coverage.definitions.definition import adapter
from place_rings.coverage.rings.mounting_errors import MountingErrors
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.placement.space.design import Space
from place_rings.simulation.pick_and_place import pick_and_place

_RINGS_PER_LINK, _SENSORS_PER_RING = 2, 16  # of given rings, with one ring on the tool
_NEAR, _FAR = {"name": "V_S", "radius": 0.5}, {"name": "V_S", "radius": 1.5}
_ZETA = Criterion()
_PAPER = {"occlusion": "ignore", "rules": {"mount": "free"}}


@dataclass(frozen=True)
class Question:
    """A scene, the rings to choose from, and a criterion."""

    scene: Mapping[str, Any]
    """Keys in which the scene differs from the reference scene, as in a scene file."""
    sensors: int | None = None
    """Number of sensors in any rings; None: rings and counts are those of the default command."""
    aim: Criterion = _ZETA
    """What is maximised."""
    task_poses: int = 0
    """Poses of the paper's task, at equal time steps; 0: those of the scene."""

    def made(self) -> Scene:
        """Return the scene."""
        scene: Scene = adapter(Scene).validate_python(self.scene)
        if not self.task_poses:
            return scene
        q = pick_and_place(scene.robot, 50.0).q
        steps = np.round(np.linspace(0, len(q) - 1, self.task_poses)).astype(int)
        return replace(scene, poses=tuple(Pose(q[i]) for i in steps))

    def space(self, scene: Scene) -> Space:
        """Return the setups to choose from."""
        if self.sensors:
            return Space(scene, sensors=self.sensors)
        count = min(_SENSORS_PER_RING, scene.rules.sensors[1])
        return Space(scene, ring_layout(scene, _RINGS_PER_LINK, count))


def _paper(target: Mapping[str, Any], sensors: int | None = None, **more: Any) -> Question:
    return Question(_PAPER | {"targets": [target]}, sensors, **more)


def _near(sensors: int | None = None, aim: Criterion = _ZETA, **keys: Any) -> Question:
    return Question({"targets": [_NEAR]} | keys, sensors, aim)


QUESTIONS = {
    "paper_near": _paper(_NEAR),
    "paper_far": _paper(_FAR),
    "paper_tool": _paper({"name": "V_T"}),
    "paper_both": _paper({"name": "V_OT"}),
    "paper_far_any": _paper(_FAR, 80),
    "paper_tool_any": _paper({"name": "V_T"}, 80),
    "near": _near(),
    "far": _near(targets=[_FAR]),
    "near_any": _near(48),
    "near_and_far": _near(targets=[_NEAR | {"weight": 0.6}, _FAR | {"weight": 0.4}]),
    "ur5e": _near(robot="ur5e"),
    "panda_any": _near(40, robot="panda"),
    "square": _near(
        sensor={"model": "vl53l5cx"},
        rules={"sensors_per_ring": [3, 12]},
        electronics={"bus": "own"},
    ),
    "blind": _near(occlusion="blind"),
    "redundancy": _near(aim=Criterion(seen=2)),
    "losing_ring": _near(aim=Criterion(losing="ring")),
    "tolerant": _near(aim=Criterion(errors=MountingErrors())),
    "worst": Question(_PAPER | {"targets": [_NEAR], "over_poses": "worst"}, task_poses=200),
}
"""The questions by name. In those of the paper's world, and in ``worst``, mounts are free and beams
pass through the robot; the others are of the reference scene. Names that end in ``any`` have any
rings.
"""
_MANY = {"spacing": 0.02, "max_rings_per_link": 32, "sensors_per_ring": [3, 48], "mount": "free"}
SIZES = {
    f"{sensors} sensors": Question({"targets": [_FAR], "rules": _MANY}, sensors)
    for sensors in (125, 1000)
}
"""Questions that show how time and memory grow."""
