"""Printed rings as a user mounts them: at no pose do parts overlap, or lie in a body."""

import numpy as np
import pytest
from place_rings.coverage.rings.rounding import rounded
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.sensors.effective_range import effective
from place_rings.coverage.sensors.sensor import Use
from place_rings.formats.printing.print_files import ring_files
from place_rings.objectives.scene import CoreScene, Pose
from place_rings.placement.search.collision_repair import apart
from place_rings.placement.search.design import Space
from place_rings.placement.search.feasible_set import InfeasibleError
from place_rings.placement.search.moves import fresh

from .assembly import judge

_NOTHING = 1.0  # mm³, rounding of facets


def drawn_proposal(rng: np.random.Generator, name: str):
    """A scene of one to three poses, and rings anywhere that its rules allow; None if there is no
    room at these poses."""
    robot, sensor = ROBOTS[name], effective(Use(str(rng.choice(["vl53l4cd", "vl53l5cx"])))).sensor
    turns = [rng.normal(0, 0.3, len(robot.rest)) * i for i in range(rng.integers(1, 4))]
    poses = tuple(Pose(np.clip(robot.rest + turn, *robot.limits.T)) for turn in turns)
    scene = CoreScene(robot=robot, poses=poses, occlusion="shadow", sensor=sensor)
    try:
        space = Space(scene, sensors=int(rng.integers(6, 25)))
        (candidate,) = apart(space, [fresh(space, rng)], rng)
    except InfeasibleError:
        return None
    return scene, rounded(space.setup(candidate), sensor)


@pytest.mark.parametrize("name", ["ur10", "ur5e", "panda"])
def test_printed_rings_overlap_nothing_when_they_are_mounted(name):
    rng = np.random.default_rng([ord(c) for c in name])
    draws = (drawn_proposal(rng, name) for _ in range(50))
    scene, setup = next(drawn for drawn in draws if drawn and len(drawn[1].rings) > 1)
    _, data = ring_files(setup, scene, lambda *_: {})
    verdict = judge(scene, data)
    assert verdict.watertight
    assert verdict.overlap < _NOTHING, verdict.names
    clearance = 1000 * scene.rules.clearance - 0.1  # facets
    assert verdict.rings >= clearance
    assert verdict.bodies >= clearance
