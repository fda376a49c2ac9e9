"""The search and what it maximises, with single sensors on the robot and sensors of the cell."""

import math
from dataclasses import replace

import numpy as np
import pytest
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.mounting_errors import MountingErrors, draw_errors
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.targets import Target
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.redundancy import redundancy
from place_rings.objectives.scene import CoreScene, Goal
from place_rings.objectives.soft_objective import CoverageObjective
from place_rings.objectives.target_points import TargetPoints
from place_rings.objectives.tolerance import mounted_cones
from place_rings.objectives.verify import Verifier
from place_rings.placement.redesign.beam_search import BeamPlan, Stage
from place_rings.placement.redesign.redesign import improve
from place_rings.placement.search.design import Space, stacked
from place_rings.placement.search.exchange import share_of
from place_rings.placement.search.exchange_points import Fields
from place_rings.placement.search.moves import fresh
from place_rings.placement.search.round import Round
from place_rings.placement.search.search import search

from ..strategies.rings import LINKS

TARGET = Target("V_S", 0.5)
SKIN = MountedSensor("forearm", (0.0, 0.08, 0.2), (0, 1, 0), Sensor(math.radians(60), 0.8))
CAMERA = MountedSensor(
    "base", (0.5, 0, 1.5), (0, 0, -1), Sensor(0.7, 1.2, None, 0.5, 64), (0, 1, 0), "camera"
)
HELD = Ring("forearm", 0.5, 4)
SCENE = CoreScene(
    goals=(Goal(TARGET),),
    occlusion="ignore",
    rules=Rules(mount="free", fixed=(HELD,), fixed_sensors=(SKIN,)),
    cell_sensors=(CAMERA,),
)
ERRORS = MountingErrors(0.01, 0.05)


def test_the_exchange_the_soft_estimate_and_the_exact_count_agree():
    """On points: 2048 have a standard error of 0.011."""
    space = Space(SCENE, sensors=20)
    points = TargetPoints(SCENE, 2048, 0)
    objective, fields = CoverageObjective(SCENE, points), Fields(space, points)
    verifier = Verifier(SCENE, 0.03)
    for seed in range(3):
        c = fresh(space, np.random.default_rng(seed))
        share = objective.zetas(
            stacked([space.arrays(c)]), space.values(c)[None], points.clouds(2048)
        )[0]
        assert share_of(space, fields, c) == pytest.approx(share, abs=2e-3)
        setup = space.setup(c)
        assert verifier.verify(setup, TARGET).zeta == pytest.approx(share, abs=0.05)
        assert setup.singles == (SKIN,)
        assert HELD in setup.rings
        assert sum(ring.count for ring in setup.rings) == 20
        bare = replace(SCENE, cell_sensors=())
        assert Verifier(bare, 0.03).verify(Setup(), TARGET).zeta == 0


def test_gradient_is_the_central_difference_beside_single_sensors():
    """In 32 bit: a step of 1e-2 and a tolerance to match; and sharp, the value is near the exact
    one.
    """
    space, points = Space(SCENE, sensors=20), TargetPoints(SCENE, 1024, 0)
    objective, clouds = CoverageObjective(SCENE, points), points.clouds(1024)
    rng = np.random.default_rng(5)
    for _ in range(3):
        c = fresh(space, rng)
        x = space.values(c)
        d = rng.normal(size=x.shape)
        d[:, space.places :] = 0  # what stays
        # no two rings change ranks in the step
        x[0] = 0.1 + 0.8 * rng.permutation(len(x[0])) / len(x[0])
        step = 1e-2 / np.linalg.norm(d)
        slope = objective.soft(stacked([space.arrays(c)]), x[None], 0.2, clouds)[1][0]
        both = np.stack([x + step * d, x - step * d])
        up, down = objective.soft(stacked([space.arrays(c)] * 2), both, 0.2, clouds)[0]
        assert (slope * d).sum() == pytest.approx(
            (up - down) / (2 * step), abs=5e-3 * np.linalg.norm(d)
        )
    share = objective.zetas(stacked([space.arrays(c)]), space.values(c)[None], clouds)[0]
    # 1024 points: a sigma is 0.015
    assert share == pytest.approx(Verifier(SCENE, 0.04).judge(space.setup(c))[1], abs=0.04)


def test_sensors_of_the_cell_neither_err_nor_fail():
    verifier = Verifier(SCENE, 0.04)
    setup = Setup((HELD,), (SKIN,))
    lost = redundancy(verifier, setup, TARGET)
    assert (len(lost.without_sensor), len(lost.without_ring)) == (5, 2)
    without = Verifier(replace(SCENE), 0.04).verify(Setup((HELD,)), TARGET).zeta
    assert lost.without_ring[1] == pytest.approx(without, abs=1e-12)
    drawn = draw_errors(2, 5, ERRORS, 3, 0)
    whole = mounted_cones(verifier, setup, drawn)(0)
    assert len({tuple(v for a in (c.apex[5], c.axis[5], c.up[5]) for v in a) for c in whole}) == 1
    assert len({tuple(c.axis[4]) for c in whole}) == 3


def test_a_search_covers_what_the_standing_sensors_leave():
    schedule = (Round(512, 2, 1, 4, 0.2),)
    found = search(SCENE, Space(SCENE, sensors=12), seed=2, schedule=schedule, voxel=0.05)
    verifier = Verifier(SCENE, 0.05)
    assert found.setup.singles == (SKIN,)
    assert HELD in found.setup.rings
    assert sum(ring.count for ring in found.setup.rings) == 12
    assert (found.short, found.exact) == verifier.judge(found.setup)
    assert found.exact > verifier.verify(Setup((HELD,), (SKIN,)), TARGET).zeta


def test_a_redesign_keeps_single_sensors():
    scene = replace(SCENE, rules=Rules(mount="free"))
    before = Setup((Ring("forearm", 0.5, 8), Ring("upper_arm", 0.2, 8)), (SKIN,))
    plan = BeamPlan(24, 256, 0.05, 3, (Stage(0.03, 512, 8, 2),), 1)
    found = improve(scene, before, 1, seed=1, plan=plan, voxel=0.05)
    verifier = Verifier(scene, 0.05)
    for answer in (found.mounted, *found.steps):
        assert answer.setup.singles == (SKIN,)
        assert (answer.short, answer.exact) == verifier.judge(answer.setup)
    assert found.steps


def test_links_of_single_sensors_are_known_to_every_robot():
    from place_rings.coverage.robots.built_in import ROBOTS

    for robot in ROBOTS.values():
        assert {"base", "tcp", *LINKS, *robot.chain.joints} <= set(robot.frames)
        with pytest.raises(ValueError, match="has no link 'nose'; known: "):
            robot.frame_of("nose")
