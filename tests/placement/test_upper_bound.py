"""No layout within a budget exceeds its upper bound."""

import json
import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.mounting_errors import MountingErrors
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.solids.polyhedra import box
from place_rings.coverage.targets import Target
from place_rings.coverage.volumes import BoxVolume
from place_rings.coverage.weight_field import WeightField
from place_rings.objectives.criterion import Criterion, judge
from place_rings.objectives.scene import Goal, Limits, Obstacle, Pose, Rules, paper_scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.bound.families import families
from place_rings.placement.bound.price_field import PriceField, TargetGrid
from place_rings.placement.bound.upper_bound import AtPose, Effort, Priced, upper_bound
from place_rings.placement.search.design import Space
from place_rings.placement.search.moves import fresh
from place_rings.placement.search.schedule import usual
from place_rings.placement.search.search import search

from .test_bound_parts import NEAR, drawn_prices

QUICK = Effort(150, 8, 24, 0.8, 60_000, 1)
_COUNT = 0.004  # voxels of 4 cm, as a share of the target


def drawn(space, seed):
    """A setup of a design space."""
    return space.setup(fresh(space, np.random.default_rng(seed)))


@pytest.mark.long
@pytest.mark.parametrize(
    ("target", "sensors", "seed"),  # of rough, smooth and constant prices
    [(Target("V_S", 0.5), 9, 0), (Target("V_S", 1.0), 20, 1), (Target("V_T"), 3, 2)],
)
def test_no_drawn_layout_exceeds_the_bound_of_any_prices(target, sensors, seed):
    scene = paper_scene(goals=(Goal(target),))
    space, verifier = Space(scene, sensors=sensors), Verifier(scene, 0.04)
    pose = AtPose(scene, space, 0)
    grid = TargetGrid.of(scene, target, 0, 60_000)
    zetas = [verifier.verify(drawn(space, k), target).zeta for k in range(8)]
    bounds = [pose.bound(0, QUICK, priced=False).value]
    priced = Priced(pose, grid, QUICK, drawn_prices(PriceField(grid, QUICK.points), seed))
    bounds.append(priced.bound(QUICK))
    assert min(bounds) >= max(zetas) - _COUNT


@pytest.fixture(scope="module")
def found():
    """The layout of a short search for the near shell, and its scene and space."""
    space = Space(NEAR, sensors=9)
    short = usual(NEAR, space, Criterion())[:3]
    return search(NEAR, space, time_cap=3, schedule=short, voxel=0.04), space


@pytest.mark.long
def test_no_search_exceeds_the_bound(found):
    result, space = found
    bound = upper_bound(NEAR, space, effort=QUICK)
    assert bound.informative
    assert result.exact - _COUNT <= bound.value < 0.9
    # prices know where a beam leaves the target, the volume does not
    assert bound.terms[0].by_prices < bound.terms[0].by_volume


def single_shares(scene, points):
    """Which points each sensor of a fine grid of places, tilts and azimuths covers."""
    some = []
    for family in families(Space(scene, sensors=2), 0):
        for p in np.linspace(*family.positions[0], 4):
            for t in np.linspace(*family.tilt, 9):
                apex, look = family.beams(p, t, np.arange(0, 6.28, 0.13))
                along = look @ points.T - (apex * look).sum(axis=1)[:, None]
                square = (points**2).sum(axis=1) - 2 * apex @ points.T
                square += (apex**2).sum(axis=1)[:, None]
                inside = (along >= 0) & (along <= scene.sensor.range_m)
                some.append(inside & (along**2 >= square * math.cos(scene.sensor.half_angle) ** 2))
    return np.concatenate(some)


@pytest.mark.long
@pytest.mark.parametrize(("radius", "close"), [(0.5, 0.05), (1.5, 0.004)])
@pytest.mark.parametrize("seen", [1, 2])
def test_two_sensors_come_close_to_their_bound(radius, close, seen):
    """All pairs of sensors of a fine grid on parts of two links."""
    narrow = Limits(position=(0.4, 0.6), tilt=(0.5, 1.0))
    scene = paper_scene(
        goals=(Goal(Target("V_S", radius)),),
        rules=Rules(sensors=(1, 2), mount="free"),
        limits={"upper_arm": narrow, "forearm": narrow, "tool": Limits(keep_out=((0, 1),))},
    )
    effort = Effort(500, 20, 36, 0.7, 200_000)
    bound = upper_bound(scene, Space(scene, sensors=2), Criterion(seen), effort)
    points = scene.sample(scene.goals[0].target, 0, 4000, 0)
    covers = single_shares(scene, points)
    best = covers[np.argsort(-covers.mean(axis=1))[:600]].astype(np.float32)
    alone, both = best.mean(axis=1), best @ best.T / len(points)
    pair = (alone[:, None] + alone - both if seen == 1 else both - np.diag(alone)).max()
    error = 3 * math.sqrt(pair / len(points))
    assert pair - error <= bound.value <= (alone.max() if seen == 2 else pair) + close + error


@pytest.mark.long
def test_given_rings_fixed_rings_and_single_sensors_count():
    layout = Setup((Ring("upper_arm", 0.2, 4), Ring("forearm", 0.6, 5)))
    known = upper_bound(NEAR, Space(NEAR, layout), effort=QUICK)
    zeta = Verifier(NEAR, 0.04).verify(layout, NEAR.goals[0].target).zeta
    assert zeta - _COUNT <= known.value < 0.9
    ring = Ring("forearm", 0.5, 6, 0.3)
    single = MountedSensor("upper_arm", (0.1, 0, 0), (0, 0, 1), NEAR.sensor)
    held = replace(NEAR, rules=Rules(mount="free", fixed=(ring,), fixed_sensors=(single,)))
    pose = AtPose(held, Space(held, sensors=6), 0)
    assert len(pose.families) == 3
    assert len(pose.held) == 7
    nothing = upper_bound(held, Space(held, sensors=6), effort=QUICK)
    zeta = Verifier(held, 0.04).verify(Setup((ring,), (single,)), held.goals[0].target).zeta
    assert zeta - _COUNT <= nothing.value < 0.7
    more = upper_bound(held, Space(held, sensors=12), effort=QUICK)
    assert more.value > nothing.value


@pytest.mark.long
def test_several_poses_targets_and_sensors_have_bounds():
    scene = replace(
        NEAR,
        poses=(NEAR.poses[0], Pose(np.radians([20.0, -60, 80, -100, -90, 0]), 2.0)),
        goals=(Goal(Target("V_S", 0.5), 2.0), Goal(Target("V_O"))),
    )
    space = Space(scene, sensors=12)
    bound = upper_bound(scene, space, effort=QUICK)
    assert [(t.goal, t.pose) for t in bound.terms] == [(0, 0), (0, 1), (1, 0), (1, 1)]
    setup = drawn(space, 3)
    for aim in (Criterion(), Criterion(losing="ring")):
        value = upper_bound(scene, space, aim, replace(QUICK, steps=0)).value
        assert judge(Verifier(scene, 0.05), setup, aim)[1] <= value + _COUNT
    twice = upper_bound(scene, space, Criterion(seen=2), QUICK).value
    assert judge(Verifier(scene, 0.05), setup, Criterion(seen=2))[1] <= twice <= bound.value
    worst = replace(scene, over_poses="worst")
    volume = replace(QUICK, steps=0)
    mean = upper_bound(scene, space, effort=volume).value
    assert upper_bound(worst, Space(worst, sensors=12), effort=volume).value <= mean
    errors = Criterion(errors=MountingErrors(0.005, 0.03))
    assert upper_bound(scene, space, errors, QUICK) is None


def test_no_bound_is_stated_where_voxels_do_not_give_the_volume():
    """Of flat faces along the voxels and of weight fields: a box of 2.0102 m had a bound of 6.571 %
    and a layout that covers 6.586 %."""
    weights = np.zeros((2, 1, 1))
    weights[0], weights[1] = 0.2, 1.0
    field = WeightField.of(weights, (-2.0, -2.0, -1.0), (2.0, 4.0, 4.0))
    own = Target("box", volume=BoxVolume((2.0102, 2.0102, 2.0102)))
    table = Obstacle("table", box([0.9, 0.0, -0.1], [0.5, 1.0, 0.2]))
    for scene in (
        paper_scene(goals=(Goal(Target("V_S", 0.5, importance=field)),)),
        paper_scene(goals=(Goal(own),)),
        replace(NEAR, obstacles=(table,)),
    ):
        assert upper_bound(scene, Space(scene, sensors=12), effort=QUICK) is None


def test_a_budget_that_covers_all_says_nothing():
    bound = upper_bound(NEAR, Space(NEAR, sensors=120), effort=replace(QUICK, steps=2))
    assert bound.value == 1
    assert not bound.informative


@pytest.mark.long
@pytest.mark.parametrize("more", [(), ("--tolerant",)], ids=["plain", "tolerant"])
def test_the_command_states_the_gap(run, tmp_path, monkeypatch, more):
    quick = partial(upper_bound, effort=replace(QUICK, steps=0))
    monkeypatch.setattr("place_rings.placement.bound.upper_bound.upper_bound", quick)
    args = ("--target", "V_S:1.5", "--sensors", "6", "--paper", "--gap", "--time", "0.5", *more)
    code, out, _ = run(*args, "--voxel", "0.1", "--out", str(tmp_path))
    assert code == 0
    record = json.loads((tmp_path / "result.json").read_text())
    gap, found = record["gap"], record["proposal"]["found"]
    if more:
        assert gap["bound_percent"] is None
        assert "no upper bound is known" in out
        return
    assert gap["gap_points"] == pytest.approx(gap["bound_percent"] - found["exact_percent"])
    assert gap["gap_points"] > -1  # voxels of 0.1 m
    assert gap["terms"][0]["target"] == "V_S(1.5)"
    assert found["bound_percent"] == pytest.approx(gap["bound_percent"], abs=0.01)
    assert f"covers more than {gap['bound_percent']:.2f} %" in out


def test_a_search_without_a_bound_says_nothing_of_one(run, tmp_path):
    code, out, _ = run("--sensors", "6", "--time", "0.5", "--voxel", "0.1", "--out", str(tmp_path))
    assert code == 0
    assert json.loads((tmp_path / "result.json").read_text())["gap"] is None
    assert "Optimality gap" not in out
