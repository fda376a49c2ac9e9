"""The search by its invariants: bounds kept, never worse than the start, repeatable, always an answer."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from place_rings.coverage.rings import RingValues, named_setup, ring_values
from place_rings.coverage.targets import Target
from place_rings.objectives.coverage_objective import CoverageObjective, TargetPoints
from place_rings.objectives.exact import TooFineError, Verifier
from place_rings.objectives.scene import Goal, Limits, Pose, Scene
from place_rings.placement import search as searching
from place_rings.placement.search import Outcome, Schedule, Stage, search
from place_rings.placement.variables import bounds, place, ring_layout, starts, unlike_first, variants

from . import drawing

SHORT = Schedule(4, (Stage(0.1, 1024, 6, 2), Stage(0.03, 1024, 6, 1, variants=1)), draws=16)
NEAR_AND_FAR = (Goal(Target("V_S", 0.5), 0.7), Goal(Target("V_S", 1.2), 0.3))


@pytest.fixture(scope="module")
def scene():
    """Two poses, two goals, limits of one link."""
    poses = (Pose(np.radians([0.0, -45, 60, -105, -90, 0]), 2.0), Pose(np.radians([40.0, -80, 90, -105, -90, 0]), 1.0))
    return Scene(poses=poses, goals=NEAR_AND_FAR, limits={"forearm": Limits((0.3, 0.6), (-0.5, 0.2))})


@pytest.fixture(scope="module")
def found(scene):
    return search(scene, ring_layout(scene, 2, 6), seed=3, schedule=SHORT, voxel=0.05)


def test_bounds_are_kept(scene, found):
    for ring in found.setup.rings:
        limits = scene.limits_of(ring.link)
        if ring.link == "tool":
            assert ring.position == 0
        else:
            assert limits.position[0] <= ring.position <= limits.position[1]
        assert limits.tilt[0] - 1e-6 <= ring.tilt <= limits.tilt[1] + 1e-6
        assert 0 <= ring.phase <= 2 * math.pi / ring.count


def test_value_is_the_verifiers(scene, found):
    assert found.exact == pytest.approx(Verifier(scene, 0.05).objective(found.setup), abs=1e-12)
    assert found.outcome is Outcome.FINISHED
    assert found.statistics.starts == 4
    assert found.soft > found.exact - 0.01  # a wide sigmoid sees a little beyond its cones


def test_same_seed_same_answer(scene, found):
    again = search(scene, ring_layout(scene, 2, 6), seed=3, schedule=SHORT, voxel=0.05)
    assert again.setup == found.setup
    assert (again.soft, again.exact) == (found.soft, found.exact)


def test_never_worse_than_the_papers_tilts():
    scene = Scene()
    layout = ring_layout(scene, 2, 16)
    found = search(scene, layout, schedule=Schedule(3, (Stage(0.1, 512, 1, 1),), draws=3), voxel=0.05)
    verifier = Verifier(scene, 0.05)
    best = max(verifier.objective(named_setup(f"n2_16_{tilt}")) for tilt in (0, 25, 55))
    assert found.exact >= best - 0.005  # the best start is chosen on points, not by the count


def test_a_time_cap_still_gives_an_answer(scene):
    capped = search(scene, ring_layout(scene, 2, 6), time_cap=1e-6, schedule=SHORT, voxel=0.1)
    assert capped.outcome is Outcome.TIME
    assert 0 < capped.exact < 1


def test_an_interrupt_keeps_the_best_so_far(scene, monkeypatch):
    real, calls = searching.wait, []

    def interrupted(*args, **kwargs):
        calls.append(1)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return real(*args, **kwargs)

    monkeypatch.setattr(searching, "wait", interrupted)
    stopped = search(scene, ring_layout(scene, 2, 6), schedule=SHORT, voxel=0.1)
    assert stopped.outcome is Outcome.INTERRUPTED
    assert 0 < stopped.exact < 1


def test_an_interrupt_between_the_climbs_keeps_the_best_so_far(scene, monkeypatch):
    real, calls = TargetPoints.clouds, []

    def interrupted(self, count):
        calls.append(1)
        if len(calls) == 4:  # of the widest, of the starts, of the first stage, of the second
            raise KeyboardInterrupt
        return real(self, count)

    monkeypatch.setattr(TargetPoints, "clouds", interrupted)
    stopped = search(scene, ring_layout(scene, 2, 6), schedule=SHORT, voxel=0.1)
    assert stopped.outcome is Outcome.INTERRUPTED
    assert stopped.statistics.evaluations > 0
    assert 0 < stopped.exact < 1


def test_an_interrupt_while_counting_keeps_one_count(scene, monkeypatch):
    real, calls = Verifier.objective, []

    def interrupted(self, setup):
        calls.append(setup)
        if len(calls) in (1, 3):
            raise KeyboardInterrupt
        return real(self, setup)

    monkeypatch.setattr(Verifier, "objective", interrupted)
    stopped = search(scene, ring_layout(scene, 2, 6), schedule=SHORT, voxel=0.1)
    assert stopped.outcome is Outcome.INTERRUPTED
    assert stopped.setup == calls[1]
    assert stopped.exact == real(Verifier(scene, 0.1), stopped.setup)


@pytest.fixture(scope="module")
def near_and_far():
    scene = Scene(goals=NEAR_AND_FAR)
    layout, points = ring_layout(scene, 2, 5), TargetPoints(scene, 512, 0)
    return CoverageObjective(scene, layout, points), points.clouds(512), bounds(scene, layout)


@settings(max_examples=20)
@given(drawing.seeds)
def test_gradient_of_the_objective_is_the_central_difference(near_and_far, seed):
    """In 32 bit: a step of 1e-2 and a tolerance to match."""
    objective, clouds, (low, high) = near_and_far
    rng = np.random.default_rng(seed)
    x = rng.uniform(low, high)
    (value,), (slope,) = objective.soft(x[None], 0.2, clouds)
    assert objective.zetas(x[None], clouds, 0.2) == pytest.approx(value, abs=1e-6)
    d = rng.normal(size=x.shape)
    step = 1e-2 / np.linalg.norm(d)
    up, down = objective.soft(np.stack([x + step * d, x - step * d]), 0.2, clouds)[0]
    assert (slope * d).sum() == pytest.approx((up - down) / (2 * step), abs=2e-3 * np.linalg.norm(d))


def test_many_setups_are_as_one_by_one(near_and_far):
    objective, clouds, (low, high) = near_and_far
    many = np.random.default_rng(0).uniform(low, high, (37, *low.shape))
    values, slopes = objective.soft(many, 0.05, clouds)
    shares = objective.zetas(many, clouds)
    for i in (0, 16, 36):
        value, slope = objective.soft(many[i : i + 1], 0.05, clouds)
        assert value == pytest.approx(values[i], abs=1e-6)
        assert slope[0] == pytest.approx(slopes[i], abs=1e-5)
        assert objective.zetas(many[i : i + 1], clouds) == pytest.approx(shares[i], abs=1e-6)


def test_one_compilation_serves_a_search(scene, monkeypatch):
    """Widths, numbers of points and of setups, with slopes or without: all are data to one compiled function."""
    real, traced = CoverageObjective._of_each, []

    def watched(self, *args):
        traced.append(1)
        return real(self, *args)

    monkeypatch.setattr(CoverageObjective, "_of_each", watched)
    stages = (Stage(0.1, 1024, 4, 2), Stage(0.05, 1200, 4, 2, variants=2), Stage(0.03, 3000, 4, 1))
    search(scene, ring_layout(scene, 2, 6), schedule=Schedule(4, stages, draws=16), voxel=0.1)
    assert len(traced) == 1


@given(drawing.seeds)
def test_starts_lie_within_the_bounds_and_repeat(seed):
    scene = Scene()
    layout = ring_layout(scene, 3, 7)
    low, high = bounds(scene, layout)
    drawn = starts(scene, layout, 6, seed)
    assert all(np.all((low <= x) & (x <= high)) for x in drawn)
    assert np.array_equal(drawn, starts(scene, layout, 6, seed))


@given(drawing.seeds)
def test_variants_draw_one_ring_anew(seed):
    scene = Scene()
    layout = ring_layout(scene, 2, 7)
    low, high = bounds(scene, layout)
    rng = np.random.default_rng(seed)
    parents = rng.uniform(low, high, (2, *low.shape))
    varied = variants(scene, layout, parents, 20, rng)
    assert np.all((low <= varied) & (varied <= high))
    changed = (varied[:, None] != parents).any(axis=2).sum(axis=2)
    assert set(changed.min(axis=1)) == {1}


@given(drawing.seeds)
def test_likeness_knows_the_rings_symmetries(seed):
    """Equal rings that change places, and turns about the mount axis, leave a setup's kind; another tilt does not."""
    scene = Scene()
    layout = ring_layout(scene, 2, 7)
    rng = np.random.default_rng(seed)
    one = rng.uniform(*bounds(scene, layout))
    swapped, turned, tilted = one[:, [1, 0, 2, 3, 4]], one.copy(), one.copy()
    turned[2] += 2 * math.pi / 7
    tilted[1, 4] += 0.5
    assert unlike_first(layout, np.stack([one, swapped, turned, tilted]), 0.3).tolist() == [0, 3, 1, 2]
    assert unlike_first(layout, np.stack([swapped, tilted]), 0.3, known=one[None]).tolist() == [1, 0]


def test_the_first_start_is_the_papers():
    layout = ring_layout(Scene(), 3, 16)
    setup, paper = place(layout, starts(Scene(), layout, 1, 0)[0]), named_setup("n3_16_55")
    for key in ("position", "tilt", "phase"):
        a, b = (getattr(ring_values(s), key) for s in (setup, paper))
        assert np.allclose(a, b)
    assert isinstance(ring_values(setup), RingValues)


def test_too_fine_a_voxel_is_refused_before_it_is_tried():
    with pytest.raises(TooFineError, match="on the surface"):
        Verifier(Scene(), 1e-5).verify(named_setup("n1_8_0"), Target("V_S", 0.5))


def test_mean_over_poses_is_weighted(scene):
    verified = Verifier(scene, 0.1).verify(named_setup("n2_16_25"), Target("V_O"))
    assert [p.weight for p in verified.poses] == pytest.approx([2 / 3, 1 / 3])
    assert verified.zeta == pytest.approx(2 / 3 * verified.poses[0].zeta + 1 / 3 * verified.poses[1].zeta)
    certified = Verifier(scene, 0.1, "certified").verify(named_setup("n2_16_25"), Target("V_O"))
    assert certified.low < verified.zeta < certified.high
    assert certified.target_voxels is None
