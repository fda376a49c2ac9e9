"""Scenes and given rings of the benchmarks of searches."""

from dataclasses import replace

import numpy as np
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.targets import Target
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import CoreScene, Goal, paper_scene
from place_rings.placement.search.design import Space
from place_rings.placement.search.feasible_set import InfeasibleError
from place_rings.placement.search.layout import ring_layout
from place_rings.simulation.pick_and_place import pick_and_place
from place_rings.studies.engine.scenes import scene_from

GOALS = {
    "V_S(0.5)": (Goal(Target("V_S", 0.5)),),
    "V_S(1.5)": (Goal(Target("V_S", 1.5)),),
    "V_OT": (Goal(Target("V_OT")),),
    "V_T": (Goal(Target("V_T")),),
    "near + far": (Goal(Target("V_S", 0.5), 0.5), Goal(Target("V_S", 1.5), 0.5)),
    "trajectory": (Goal(Target("V_S", 0.5)),),
}
PAPER = tuple(GOALS)  # scenes of the paper's world, on the UR10
ROBOTS = {"UR10": "ur10", "UR5e": "ur5e", "Panda": "panda"}  # real scenes: V_S(0.5), default pose
SENSORS = {"real": (40, 80), "paper": (80, 112)}
_POSES = 12  # poses of the trajectory, at equal time steps of the paper's task
_RINGS_PER_LINK = {112: 3}  # the paper's layout of 7 rings; otherwise 2
_MOST = 30  # sensors of a ring in the real scenes; with 24 a Panda has no room for 80


def scene_named(name: str) -> CoreScene:
    """Return a scene of the benchmark. In the paper's world rings may touch, for every method."""
    if name in ROBOTS:
        rules = {"mount": "real", "sensors_per_ring": [3, _MOST]}
        return scene_from({"robot": ROBOTS[name], "occlusion": "shadow", "rules": rules})
    rules = Rules(spacing=0.0)
    if name != "trajectory":
        return paper_scene(goals=GOALS[name], rules=rules)
    return paper_scene(goals=GOALS[name], poses=poses_of_task(), rules=rules)


def poses_of_task() -> tuple[Pose, ...]:
    """Return poses of the paper's task, at equal time steps."""
    q = pick_and_place(UR10, 50.0).q
    return tuple(Pose(q[i]) for i in np.round(np.linspace(0, len(q) - 1, _POSES)).astype(int))


def layout(scene: CoreScene, sensors: int) -> Setup:
    """Return the rings of all methods but the search with free rings: those of the paper's layout,
    or one for each link where two have no room, with counts as even as the boards allow.

    Raises:
        InfeasibleError: if the rules leave no room for them.
    """
    paper = _RINGS_PER_LINK.get(sensors, 2)
    try:
        return _even(scene, ring_layout(scene, paper, 1), sensors)
    except InfeasibleError:
        return _even(scene, ring_layout(scene, 1, 1), sensors)


def _even(scene: CoreScene, rings: Setup, sensors: int) -> Setup:
    """Return rings with counts that differ as little as the boards allow."""
    space, count = Space(scene, sensors=sensors), [0] * len(rings.rings)
    most = [space.most_on(ring.link) for ring in rings.rings]
    for _ in range(sensors):
        count[min(range(len(count)), key=lambda i: (count[i] >= most[i], count[i]))] += 1
    setup = Setup(tuple(replace(r, count=n) for r, n in zip(rings.rings, count, strict=True)))
    Space(scene, setup)  # raises where there is no room
    return setup
