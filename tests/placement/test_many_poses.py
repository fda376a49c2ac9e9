"""Searches over many poses: the mean and the worst one, few looked at, all counted."""

from dataclasses import replace

import numpy as np
import pytest
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.targets.named import Shell
from place_rings.objectives.criterion import Criterion, judge
from place_rings.objectives.named_layouts import ring_layout
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.search import verdict
from place_rings.placement.search.context import SearchContext
from place_rings.placement.search.progress import Outcome
from place_rings.placement.search.schedule import Round
from place_rings.placement.space.design import Space
from place_rings.placement.space.starts import fresh
from place_rings.simulation.pick_and_place import pick_and_place

from ..support.searching import search

SHORT = (Round(512, 4, 1, 8, 0.2, 8),)
GOALS = (Shell(0.4, weight=0.7), Shell(0.6, weight=0.3))


def scene_of(poses, **kwargs):
    """A swing from table to table in so many poses, the later ones heavier."""
    q = pick_and_place(UR10, 20.0).q[:60]
    picked = q[np.linspace(0, len(q) - 1, poses).astype(int)]
    return Scene.paper(
        poses=tuple(Pose(a, 1.0 + i, 0.05 * i) for i, a in enumerate(picked)), **kwargs
    )


def test_the_mean_is_the_weighted_mean_and_the_worst_the_least():
    scene = scene_of(3, targets=GOALS)
    setup = ring_layout(scene, 2, 8)
    each = [Verifier(scene, 0.1).verify(setup, goal.target) for goal in GOALS]
    for v in each:
        assert v.zeta == pytest.approx(sum((1 + i) / 6 * p.zeta for i, p in enumerate(v.poses)))
        worst = v.in_scene("x", scene).worst
        assert worst.zeta == v.poses[worst.pose].zeta == min(p.zeta for p in v.poses)
        assert worst.time_s == 0.05 * worst.pose
        assert np.radians(worst.q_deg) == pytest.approx(scene.poses[worst.pose].q, abs=1e-9)
    verifiers = [Verifier(replace(scene, over_poses=how), 0.1) for how in ("mean", "worst")]
    mean, least = (v.judged(each)[1] for v in verifiers)
    assert mean == pytest.approx(0.7 * each[0].zeta + 0.3 * each[1].zeta)
    assert least == pytest.approx(
        min(0.7 * a.zeta + 0.3 * b.zeta for a, b in zip(each[0].poses, each[1].poses, strict=True))
    )
    with pytest.raises(ValueError, match="worst pose"):
        judge(verifiers[1], setup, Criterion(seen=2))


@pytest.fixture
def few(monkeypatch):
    """Poses are many from five on, and the worst two of them count for a setup."""
    monkeypatch.setattr(verdict, "MANY", 4)
    monkeypatch.setattr(verdict, "_LOWEST", 2)


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("how", [pytest.param("mean", marks=pytest.mark.slow), "worst"])
def test_a_search_counts_all_poses_in_the_end(how):
    scene, told = scene_of(6, over_poses=how), []
    layout, verifier = ring_layout(scene, 2, 8), Verifier(scene, 0.1)
    found = search(
        Space(scene, layout),
        schedule=SHORT,
        voxel=0.1,
        tell=lambda p: told.append(vars(p).copy()),
    )
    (verified,) = found.verified
    again = verifier.verify(found.setup, Shell(0.5))
    assert (verified.zeta, verified.poses) == (again.zeta, again.poses)
    assert found.exact == (verified.zeta if how == "mean" else min(p.zeta for p in verified.poses))
    assert found.voxel == 0.1
    assert told[-1]["counted"] == told[-1]["to_count"] - 1
    assert found.exact > verifier.judge(layout)[1]


@pytest.mark.usefixtures("few")
def test_an_interrupt_before_the_last_count_keeps_the_rough_one(monkeypatch):
    scene, real = scene_of(6), Verifier.verify

    def interrupted(self, setup, target):
        if self.voxel == 0.1:
            raise KeyboardInterrupt
        return real(self, setup, target)

    monkeypatch.setattr(Verifier, "verify", interrupted)
    monkeypatch.setattr(verdict, "COARSE", 0.2)
    stopped = search(Space(scene, ring_layout(scene, 1, 6)), schedule=SHORT, voxel=0.1)
    assert stopped.outcome is Outcome.INTERRUPTED
    assert (stopped.voxel, stopped.verified) == (0.2, ())
    assert 0 < stopped.exact < 1


def chosen(scene, setups):
    """What the exact count chooses of random setups, and the counts it tells."""
    told, random = [], np.random.default_rng(0)
    context = SearchContext(Verifier(scene, 0.1))
    found = verdict.choose(setups, context, random, lambda *numbers: told.append(numbers))
    return found, told


def setups_of(scene, count):
    """Random feasible setups of two rings of eight sensors on each link."""
    space, rng = Space(scene, ring_layout(scene, 2, 8)), np.random.default_rng(3)
    return [space.setup(fresh(space, rng)) for _ in range(count)]


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("floor", [0.0, 0.9])
def test_the_best_worst_pose_is_found_though_most_setups_are_counted_at_few_poses(floor):
    goals = (replace(GOALS[0], at_least_percent=100 * floor), GOALS[1])
    scene = scene_of(6, targets=goals, over_poses="worst")
    setups, verifier = setups_of(scene, 5), Verifier(scene, 0.1)
    judged = [verifier.judge(s) for s in setups]
    best = min(range(5), key=lambda i: (judged[i][0], -judged[i][1]))
    for order in ([0, 1, 2, 3, 4], [best, *(i for i in range(5) if i != best)]):
        found, told = chosen(scene, [setups[i] for i in order])
        assert (order[found.index], found.short, found.exact) == (best, *judged[best])
        assert len(found.verified[0].poses) == 6
        assert all(counted < total for counted, total in told)
    # the best one first: where no goal has a floor, the others are counted at two poses each
    assert floor > 0 or told[-1][0] + 1 == 2 * (6 + 4 * 2)


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("how", ["mean", "worst"])
def test_a_lone_setup_is_counted_once(how):
    scene = scene_of(6, over_poses=how)
    (setup,) = setups_of(scene, 1)
    found, told = chosen(scene, [setup])
    assert (found.short, found.exact) == Verifier(scene, 0.1).judge(setup)
    assert told == [(i, 6) for i in range(6)]
