"""Rings of two links that collide: the answer is the best without collisions that the search saw,
more time never lowers it, and what the rule costs is stated.
"""

import math
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.targets import Target
from place_rings.formats.schema.proposal_models import CollisionLossModel
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import CoreScene, Goal
from place_rings.objectives.verify import Verifier
from place_rings.placement.search import feasible_record
from place_rings.placement.search import finalists as choice
from place_rings.placement.search.design import Candidate, Space
from place_rings.placement.search.feasible_record import FeasibleRecord
from place_rings.placement.search.moves import fresh
from place_rings.placement.search.round import Round
from place_rings.placement.search.search import CollisionLoss, search

SHORT = (Round(256, 3, 1, 6, 0.3, 6), Round(512, 2, 1, 6, 0.1, 4))


def folded(seed):
    """Rings on a UR5 whose elbow folds until they may meet."""
    rng, robot = np.random.default_rng(seed), ROBOTS["ur5"]
    bends = (0.0, float(rng.uniform(70, 90)))
    scene = CoreScene(
        robot=robot,
        poses=tuple(Pose(robot.rest + math.radians(a) * np.eye(6)[2]) for a in bends),
        goals=(Goal(Target("V_S", 0.3)),),
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
    each, real = [], choice._judged

    def judged(verifier, setup, aim, index):
        found = real(verifier, setup, aim, index)
        each.append((setup, found.exact))
        return found

    monkeypatch.setattr(choice, "_judged", judged)
    return each


@pytest.mark.slow
@settings(max_examples=3, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 3))
def test_the_answer_is_the_best_feasible_one_that_was_counted(seed, start):
    scene, space = folded(seed)
    with pytest.MonkeyPatch.context() as patched:
        each = counted(patched)
        found = search(scene, space, start, schedule=SHORT, voxel=0.05)
    assert faults(scene, found.setup.rings) == []
    assert all(faults(scene, setup.rings) == [] for setup, _ in each)
    assert found.exact == max(exact for _, exact in each)
    assert found.exact == Verifier(scene, 0.05).judge(found.setup)[1]
    if found.loss is not None:
        assert found.loss.cost > 0
        assert set(found.loss.links) == {"upper_arm", "forearm"}
        np.testing.assert_allclose(found.loss.best - found.loss.cost, found.sampled)


@pytest.mark.slow
@settings(max_examples=2, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_more_time_never_lowers_the_answer(seed):
    scene, space = folded(seed)
    clock, best = Ticks(), 0.0
    last = search(scene, space, 0, schedule=SHORT, voxel=0.05, clock=clock)
    for cap in np.linspace(2, clock.now, 4).tolist():
        found = search(scene, space, 0, cap, SHORT, voxel=0.05, clock=Ticks())
        assert found.exact >= best
        best = found.exact
    assert last.exact >= best


@given(st.lists(st.tuples(st.floats(0, 1), st.booleans()), min_size=1, max_size=30))
def test_the_record_keeps_the_best_of_what_does_not_collide(told):
    """In the order in which it came, whatever came between."""
    some = [
        Candidate(np.zeros(1, int), np.array([8]), np.full((3, 1), v + i * 1e-9), np.ones(1))
        for i, (v, _) in enumerate(told)
    ]
    wrong = {id(c) for c, (_, collides) in zip(some, told, strict=True) if collides}
    record = FeasibleRecord(Mock(), SimpleNamespace(all=SimpleNamespace(part=np.zeros(10_000))), 0)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(feasible_record, "collisions", lambda _, c: [1] * (id(c) in wrong))
        patched.setattr(feasible_record, "moved", lambda *_: None)
        patched.setattr(feasible_record, "share_of", lambda _, __, c: float(c.values[0, 0]))
        best = -math.inf
        for i, c in enumerate(some):
            record.look([c])
            fine = [float(d.values[0, 0]) for d in some[: i + 1] if id(d) not in wrong]
            assert record.share == max(fine, default=-math.inf)
            assert record.share >= best
            best = record.share
    assert (record.best is None) == (len(wrong) == len(some))
    rivals = record.rivals()
    assert all(id(c) not in wrong for c in rivals)
    assert all(float(c.values[0, 0]) >= record.share - 0.01 for c in rivals)


def test_what_keeping_rings_apart_costs_is_in_the_record_of_a_search():
    loss = CollisionLoss(0.264, 0.05, ("forearm", "tool"))
    model = CollisionLossModel.of(loss)
    assert (model.best_percent, model.cost_points) == pytest.approx((26.4, 5.0))
    assert model.links == ["forearm", "tool"]
    assert CollisionLossModel.of(None) is None


@pytest.mark.slow
def test_a_search_whose_results_all_collide_beats_random_layouts_that_do_not():
    """By a share of points of its own, not of the search."""
    robot = ROBOTS["ur3"]
    pose = Pose(np.radians([0.0, -60.0, 130.0, -90.0, -90.0, 0.0]))
    scene = CoreScene(
        robot=robot, poses=(pose,), goals=(Goal(Target("V_S", 0.3)),), ring_radius=0.09
    )
    space = Space(scene, sensors=24)
    found = search(scene, space, 0, voxel=0.05)
    assert found.loss is not None
    assert faults(scene, found.setup.rings) == []
    verifier, rng = Verifier(scene, 0.05), np.random.default_rng(1)
    drawn = [space.setup(c) for c in (fresh(space, rng) for _ in range(60))]
    fair = [setup for setup in drawn if faults(scene, setup.rings) == []]
    assert len(fair) > 10
    assert found.exact >= max(verifier.judge(setup)[1] for setup in fair) + 0.02
