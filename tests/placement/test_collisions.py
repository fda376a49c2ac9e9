"""Rings of two links that may collide: no candidate of a search has such rings, its answer is the
best that was counted, and more time never lowers it.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.rounding import rounded
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.targets.named import Shell
from place_rings.objectives.feasibility.mounting import meeting
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.parameterization import decode
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.search import verdict
from place_rings.placement.search.schedule import Round
from place_rings.placement.space.design import Space
from place_rings.placement.space.starts import _drawn, fresh

from ..support.searching import search

SHORT = (Round(256, 3, 1, 6, 0.3, 6), Round(512, 2, 1, 6, 0.1, 4))


def folded(seed):
    """Rings on a UR5 whose elbow folds until they may meet."""
    rng, robot = np.random.default_rng(seed), ROBOTS["ur5"]
    bends = (0.0, float(rng.uniform(70, 90)))
    scene = Scene(
        robot=robot,
        poses=tuple(Pose(robot.rest + math.radians(a) * np.eye(6)[2]) for a in bends),
        targets=(Shell(0.3),),
    )
    links, counts = ("upper_arm", "forearm"), rng.integers(4, 9, 2).tolist()
    rings = [Ring(link, 0.5, n) for link, n in zip(links, counts, strict=True)]
    return scene, Space(scene, Setup(tuple(rings)))


class Ticks:
    """A clock that advances by a second each time it is read."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        self.now += 1.0
        return self.now


def counted(monkeypatch):
    """Record each exact count."""
    each, real = [], verdict._judged

    def judged(setups, index, context):
        found = real(setups, index, context)
        each.append((setups[index], found.exact))
        return found

    monkeypatch.setattr(verdict, "_judged", judged)
    return each


@pytest.mark.slow
@settings(max_examples=3, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 3))
def test_the_answer_is_the_best_feasible_one_that_was_counted(seed, start):
    scene, space = folded(seed)
    with pytest.MonkeyPatch.context() as patched:
        each = counted(patched)
        found = search(space, seed=start, schedule=SHORT, voxel=0.05)
    assert faults(scene, found.setup.rings) == []
    assert all(faults(scene, setup.rings) == [] for setup, _ in each)
    assert found.exact == max(exact for _, exact in each)
    assert found.exact == Verifier(scene, 0.05).judge(found.setup)[1]


@pytest.mark.slow
@settings(max_examples=2, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_more_time_never_lowers_the_answer(seed):
    (_, space), clock, best = folded(seed), Ticks(), 0.0
    last = search(space, schedule=SHORT, voxel=0.05, clock=clock)
    for cap in np.linspace(2, clock.now, 4).tolist():
        found = search(space, cap=cap, schedule=SHORT, voxel=0.05, clock=Ticks())
        reached = found.stages[-2].value  # on the sample points; the verdict counts the best three
        assert reached >= best
        best = reached
    assert last.stages[-2].value >= best


@pytest.mark.slow
@pytest.mark.parametrize("sensors", [None, 16])
def test_what_is_shown_could_be_returned(sensors):
    scene, space = folded(3)
    space = Space(scene, sensors=sensors) if sensors else space
    shown = []

    def tell(progress):
        if progress.setup is not None:
            shown.append((progress.best, progress.setup))

    found = search(space, seed=1, schedule=SHORT, voxel=0.05, tell=tell)
    assert [best for best, _ in shown] == sorted(best for best, _ in shown)
    assert not any(faults(scene, setup.rings) for _, setup in shown)
    assert found.exact >= shown[-1][0] - 0.05


@pytest.mark.parametrize("sensors", [None, 12, 24])
@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_balls_that_are_apart_hold_rings_that_are(sensors, seed):
    scene, space = folded(seed)
    fixed = Rules(fixed=(Ring("forearm", 0.3, 4, 0.2, radius=0.09),))
    space = Space(replace(scene, rules=fixed), sensors=sensors) if sensors else space
    rng = np.random.default_rng(seed)
    for _ in range(5):
        c = _drawn(space, rng)
        rings = rounded(space.setup(c), scene.sensor).rings
        position = decode(space.stretch(c), space.values(c))[0, c.rings]
        near = space.collisions.possible(space.link_of[c.segment[c.rings]], position)
        assert near or not meeting(space.clear, rings)
        assert space.apart(c) == (not meeting(space.clear, rings))


@pytest.mark.slow
def test_a_search_whose_rings_may_all_collide_beats_random_layouts_by_far():
    robot = ROBOTS["ur3"]
    pose = Pose(np.radians([0.0, -60.0, 130.0, -90.0, -90.0, 0.0]))
    scene = Scene(robot=robot, poses=(pose,), targets=(Shell(0.3),), ring_radius=0.09)
    space = Space(scene, sensors=24)
    found = search(space, voxel=0.05)
    assert faults(scene, found.setup.rings) == []
    verifier, rng = Verifier(scene, 0.05), np.random.default_rng(1)
    each = [verifier.judge(space.setup(fresh(space, rng)))[1] for _ in range(30)]
    assert found.exact >= max(each) + 0.02
