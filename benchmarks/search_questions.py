"""Questions of the benchmark of searches: scenes, budgets and criteria as data."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from place_rings.coverage.rings.mounting_errors import MountingErrors
from place_rings.coverage.rings.ring import Setup
from place_rings.objectives.criterion import Criterion
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import CoreScene
from place_rings.placement.search.design import Space
from place_rings.simulation.pick_and_place import pick_and_place
from place_rings.studies.engine.scenes import scene_from

_ZETA = Criterion()
_SWING = 0.4  # rad, by which joints differ from the scene's pose


@dataclass(frozen=True)
class Question:
    """A scene, a number of sensors and a criterion."""

    name: str
    """Its name in the tables."""
    scene: Mapping[str, Any]
    """Keys in which the scene differs from the paper's, as in a scene file."""
    sensors: int = 80
    """Number of sensors."""
    rings: int | None = 2
    """Rings on each link with a length; None: the search chooses links, rings and counts."""
    aim: Criterion = _ZETA
    """What is maximised."""
    task_poses: int = 0
    """Poses of the paper's task, at equal time steps; 0: those of the scene."""
    swings: int = 0
    """Drawn poses about that of the scene; 0: those of the scene."""
    points: float = 1.0
    """Factor of the points of each round of the search."""
    checked: bool = False
    """Whether random points check the answer."""

    def made(self) -> CoreScene:
        """Return the scene."""
        scene = scene_from(self.scene)
        if self.task_poses:
            q = pick_and_place(scene.robot, 50.0).q
            steps = np.round(np.linspace(0, len(q) - 1, self.task_poses)).astype(int)
            return replace(scene, poses=tuple(Pose(q[i]) for i in steps))
        if self.swings:
            base = scene.poses[0].q
            swings = np.random.default_rng(1).uniform(-_SWING, _SWING, (self.swings, len(base)))
            return replace(scene, poses=tuple(Pose(base + swing) for swing in swings))
        return scene

    def space(self, scene: CoreScene) -> Space:
        """Return the setups to choose from."""
        return (
            Space(scene, self.layout(scene)) if self.rings else Space(scene, sensors=self.sensors)
        )

    def layout(self, scene: CoreScene) -> Setup:
        """Return the given rings, with counts as even as the boards allow."""
        rings = ring_layout(scene, self.rings or 1, 1).rings
        space, count = Space(scene, sensors=self.sensors), [0] * len(rings)
        most = [space.most_on(ring.link) for ring in rings]
        for _ in range(self.sensors):
            count[min(range(len(count)), key=lambda i: (count[i] >= most[i], count[i]))] += 1
        return Setup(tuple(replace(r, count=n) for r, n in zip(rings, count, strict=True)))


def _shell(radius: float, weight: float = 1.0) -> dict[str, Any]:
    return {"name": "V_S", "radius": radius, "weight": weight}


def _real(rules: Mapping[str, Any] | None = None, **keys: Any) -> dict[str, Any]:
    """Return the keys of a scene whose bodies occlude, with rings on real mounts."""
    return {"occlusion": "shadow", "rules": {"mount": "real", **(rules or {})}, **keys}


_TARGETS: dict[str, list[dict[str, Any]]] = {
    "V_S(0.5)": [_shell(0.5)],
    "V_S(1.5)": [_shell(1.5)],
    "V_OT": [{"name": "V_OT"}],
    "V_T": [{"name": "V_T"}],
    "near + far": [_shell(0.5, 0.5), _shell(1.5, 0.5)],
    "trajectory": [_shell(0.5)],
}
_FEW = {"sensors_per_ring": [3, 30]}  # with at most 24 sensors a Panda has no room for 80
# on real mounts, with one ring on each link where two have no room; then the paper's rings, which
# may touch
QUESTIONS = {
    q.name: q
    for q in (
        *(
            Question(f"{robot}, {sensors}", _real(_FEW, robot=robot.lower()), sensors, rings)
            for robot, rings in (("UR10", 2), ("UR5e", 2), ("Panda", 1))
            for sensors in (40, 80)
        ),
        *(
            Question(
                *(f"{name}, {sensors}", {"rules": {"spacing": 0.0}, "targets": targets}),
                *(sensors, rings),
                task_poses=12 if name == "trajectory" else 0,
            )
            for sensors, rings in ((80, 2), (112, 3))
            for name, targets in _TARGETS.items()
        ),
    )
}
_SQUARE, _FAR = {"model": "vl53l5cx"}, {"targets": [_shell(1.5)]}
_LOSSES: dict[str, Criterion] = {
    "redundancy 2": Criterion(seen=2),
    "losing ring": Criterion(losing="ring"),
    "losing sensor": Criterion(losing="sensor"),
    "tolerant": Criterion(errors=MountingErrors()),
}
PLAIN = Question("plain", {})
MODES = (
    Question("shadow", _real()),
    *(Question(f"{name}, shadow", _real(), aim=aim) for name, aim in _LOSSES.items()),
    *(Question(name, {}, aim=aim) for name, aim in _LOSSES.items()),
    Question("blind", _real() | {"occlusion": "blind"}),
    Question("square", {"sensor": _SQUARE, **_FAR}, 30),
    Question("square, shadow", _real(sensor=_SQUARE, **_FAR), 30),
    Question("free, shadow, 32 sensors", _real(), 32, None),
    Question("UR5e, square, shadow, free", _real(robot="ur5e", sensor=_SQUARE), 48, None),
    Question("worst of 200 poses", {"over_poses": "worst"}, task_poses=200),
)
"""80 sensors for V_S(0.5) on a UR10, unless a name says otherwise."""
_ROOM = {"spacing": 0.02, "max_rings_per_link": 32}
_MANY = {"occlusion": "shadow", "rules": {**_ROOM, "sensors_per_ring": [3, 48]}}
_THICK = _real({**_ROOM, "sensors_per_ring": [3, 64]}, ring_radius=0.15, **_FAR)
SCALE: dict[str, tuple[tuple[float, Question], ...]] = {
    "sensors": tuple(
        (n, Question(f"{n} sensors", _MANY | _FAR, n, None, checked=n == 1000))
        for n in (125, 250, 500, 1000, 2000)
    ),
    "points": tuple(
        (f, Question(f"{f:g} times the points", _MANY | _FAR, 250, None, points=f))
        for f in (0.5, 1.0, 2.0, 4.0)
    ),
    "poses": tuple((n, Question(f"{n} poses", _MANY, 96, None, swings=n)) for n in (8, 16, 32, 64)),
    "poses, worst": tuple(
        (n, Question(f"worst of {n}", _MANY | {"over_poses": "worst"}, 96, None, swings=n))
        for n in (32, 64, 128)
    ),
    "real mounts": ((1000, Question("real mounts", _THICK, 1000, None, checked=True)),),
}
"""Values of what grows, and their questions."""


@dataclass(frozen=True)
class Plan:
    """What a run of the benchmark measures."""

    questions: tuple[str, ...]
    """Questions that all methods answer."""
    seeds: int
    """Random seeds of each, from 0."""
    peers: tuple[str, ...]
    """The other methods."""
    longer: float
    """Processor time of a peer, as a multiple of that of ours."""
    modes: int
    """Number of modes, the first ones."""
    scale: Mapping[str, int]
    """Every how many sizes of a series are measured."""


SHORT = Plan(
    questions=("UR10, 80", "Panda, 40", "V_S(0.5), 80", "V_OT, 112"),
    seeds=2,
    peers=("CMA-ES", "CRS2"),
    longer=4.0,
    modes=5,
    scale={"sensors": 3},
)
FULL = Plan(
    questions=tuple(QUESTIONS),
    seeds=5,
    peers=("CMA-ES", "CRS2", "differential evolution"),
    longer=4.0,
    modes=len(MODES),
    scale=dict.fromkeys(SCALE, 1),
)
