"""No layout within a budget exceeds its upper bound; the parts of the bound hold by themselves."""

import itertools
import json
import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.mounting_errors import MountingErrors
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.solids.polyhedra import box
from place_rings.coverage.targets import Target
from place_rings.coverage.volumes import BoxVolume
from place_rings.coverage.weight_field import WeightField
from place_rings.objectives.criterion import Criterion, judge
from place_rings.objectives.scene import Goal, Limits, Obstacle, Pose, Rules, paper_scene
from place_rings.objectives.verify import Verifier
from place_rings.placement.bound.blurred_beam import STEEPEST, BlurredBeam, Profile
from place_rings.placement.bound.families import Budget, families
from place_rings.placement.bound.price_field import PriceField, TargetGrid
from place_rings.placement.bound.ring_values import RingMaxima, RingSums, shares, turns
from place_rings.placement.bound.upper_bound import AtPose, Effort, Priced, upper_bound
from place_rings.placement.search.design import Space
from place_rings.placement.search.moves import fresh
from place_rings.placement.search.schedule import usual
from place_rings.placement.search.search import search

from . import drawing

QUICK = Effort(60, 12, 100, (0.2, math.radians(10)), 60_000, 1)
ROUGH = (0.3, math.radians(20))
NEAR = paper_scene(goals=(Goal(Target("V_S", 0.5)),))
_COUNT = 0.004  # voxels of 4 cm, as a share of the target


def beam_share(sensor, along, away, sigma, seed, count=40_000):
    """Share of normal points about a place that lie in a cone or dome about z."""
    rng = np.random.default_rng(seed)
    p = np.array([away, 0.0, along]) + sigma * rng.normal(size=(count, 3))
    d, rho = p[:, 2], np.hypot(p[:, 0], p[:, 1])
    inside = (d >= sensor.near_m) & (rho <= d * math.tan(min(sensor.half_angle, 1.5)))
    if sensor.shape == "dome":
        return (inside & (d * d + rho * rho <= sensor.range_m**2)).mean()
    return (inside & (d <= sensor.range_m)).mean()


sensors = st.builds(
    Sensor,
    st.floats(0.2, 1.8),
    st.floats(0.3, 2.0),
    near_m=st.sampled_from([0.0, 0.2]),
)


@settings(max_examples=6)
@given(sensors, st.floats(-0.5, 2.5), st.floats(0, 1), drawing.seeds)
def test_a_blurred_beam_is_the_share_of_a_gaussian_in_it(sensor, along, away, seed):
    blurred = BlurredBeam(sensor, 0.15)
    share = float(blurred.share(np.array([along]), np.array([away**2]))[0])
    assert share == pytest.approx(beam_share(sensor, along, away, 0.15, seed), abs=0.012)


@pytest.mark.parametrize(
    "sensor",
    [
        Sensor(),
        Sensor(1.0, 2.0, near_m=0.5),
        Sensor(1.0, 1.5, None, 0.6),
        Sensor(2.0, 0.4, shape="dome"),
        Sensor(math.pi, 0.4, shape="dome"),
        Sensor(2.0, 1.0, shape="fan", thickness=0.1),
        Sensor(6.0, 1.0, shape="fan", thickness=0.1),
    ],
    ids=str,
)
def test_a_profile_holds_the_beam_and_closes(sensor):
    profile = Profile.of(sensor)
    assert profile.volume >= sensor.volume * (1 - 1e-3)
    if sensor.plain or (sensor.shape == "beam" and not sensor.square):
        assert profile.volume == pytest.approx(sensor.volume, rel=1e-3)
    points, normals, areas = profile.surface
    # the divergence theorem: a closed surface has no net area, and encloses the volume
    assert (normals * areas[:, None]).sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-3)
    enclosed = ((points * normals).sum(axis=1) * areas).sum() / 3
    assert enclosed == pytest.approx(profile.volume, rel=0.02)


@settings(max_examples=30)
@given(drawing.seeds)
def test_no_prices_make_a_field_steeper_than_stated(seed):
    rng = np.random.default_rng(seed)
    spacing, sigma = 1.0, 0.7
    place, u = rng.uniform(size=3), rng.normal(size=3)
    u /= np.linalg.norm(u)
    z = np.stack(np.meshgrid(*[np.arange(-6, 8)] * 3, indexing="ij"), -1).reshape(-1, 3) - place
    density = np.exp(-(z**2).sum(axis=1) / (2 * sigma**2)) * (spacing / sigma) ** 3
    slopes = (z @ u) / sigma**2 * density / (2 * math.pi) ** 1.5
    assert np.maximum(slopes, 0).sum() <= STEEPEST / sigma  # the worst prices in [0, 1]


@settings(max_examples=15)
@given(st.integers(1, 13), drawing.seeds)
def test_the_largest_sum_over_a_ring_is_that_over_all_phases(count, seed):
    values = np.random.default_rng(seed).uniform(size=24)

    def between(angle):
        return np.interp(angle % 24, np.arange(25), np.append(values, values[0]))

    phases = np.linspace(0, 24 / count, 2000)
    each = [sum(between(p + k * 24 / count) for k in range(count)) for p in phases]
    most = (turns(count, 24) @ values).max()
    assert most >= max(each) - 1e-9
    assert most == pytest.approx(max(each), abs=0.02 * count)
    assert RingSums([count], 24).most(values[None].astype(np.float32))[0, 0] == pytest.approx(most)


@given(st.integers(0, 9), st.sampled_from([None, 1, 2]), drawing.seeds)
def test_the_knapsack_is_that_of_all_choices(sensors, total, seed):
    budget = Budget((2, 1), ((1, 2, 3), (2, 4)), sensors, total)
    rng = np.random.default_rng(seed)
    values = [rng.uniform(size=3), rng.uniform(size=2)]
    value, chosen = budget.best(values)
    choices = itertools.product([None, 0, 1, 2], [None, 0, 1, 2], [None, 0, 1])
    each = []
    for a, b, c in choices:
        rings = [(0, i) for i in (a, b) if i is not None] + ([] if c is None else [(1, c)])
        if sum(budget.counts[f][i] for f, i in rings) > budget.sensors:
            continue
        if budget.total is None or len(rings) <= budget.total:
            each.append(sum(values[f][i] for f, i in rings))
    assert value == pytest.approx(max(each))
    assert sum(values[f][i] for f, i in chosen) == pytest.approx(value)
    more = replace(budget, sensors=budget.sensors + 1)
    assert more.best(values)[0] >= value - 1e-12


def drawn_prices(field, seed):
    """Prices that are rough, smooth or constant."""
    rng = np.random.default_rng(seed)
    rough = rng.uniform(size=len(field.points)) < rng.uniform()
    wave = 0.5 + 0.5 * np.sin(field.points @ rng.normal(size=3) * 4)
    return [rough.astype(float), wave, np.ones(len(rough))][seed % 3] * field.most


@pytest.fixture(scope="module")
def near():
    """A lattice over the near shell, the beam on it, and the families of 12 sensors."""
    field = PriceField(TargetGrid.of(NEAR, NEAR.goals[0].target, 0, 60_000), 60)
    return field, BlurredBeam(NEAR.sensor, field.sigma), families(Space(NEAR, sensors=12), 0)


@settings(max_examples=10)
@given(drawing.seeds)
def test_what_a_sensor_collects_bends_no_more_than_stated(near, seed):
    field, beam, (family, *_) = near
    rng, prices = np.random.default_rng(seed), drawn_prices(field, seed) * field.worth
    place = np.array([rng.uniform(0.2, 0.8), rng.uniform(-1, 1), rng.uniform(0, 6)])
    bends = beam.bends(np.array([place[1]]), family.radius) / field.grid.volume
    for axis, step in enumerate((0.1, 0.1, 0.1)):
        values = []
        for way in (-1, 0, 1):
            p, t, a = place + way * step * np.eye(3)[axis]
            values.append(shares(beam, field, *family.beams(p, t, np.array([a])))[0] @ prices)
        size = step * (family.mount.length if axis == 0 else 1.0)
        sag = values[1] - (values[0] + values[2]) / 2
        assert sag <= bends[axis] * size**2 / 2 * 1.05 + 1e-4


@settings(max_examples=6)
@given(drawing.seeds)
def test_no_ring_collects_more_than_its_bound_and_refining_never_raises_it(near, seed):
    field, beam, some = near
    rng, family = np.random.default_rng(seed), some[seed % len(some)]
    prices = drawn_prices(field, seed)
    maxima = RingMaxima(family, beam, field, prices, ROUGH)
    before = maxima.bound
    maxima.refine(np.arange(len(family.counts)), 30)
    assert np.all(maxima.bound <= before + 1e-12)
    for _ in range(40):
        i = int(rng.integers(len(family.counts)))
        n = family.counts[i]
        turn = rng.uniform(0, 6) + np.arange(n) * 2 * math.pi / n
        apex, look = family.beams(rng.uniform(), rng.uniform(*family.tilt), turn)
        value = (shares(beam, field, apex, look) @ prices).sum() * field.worth
        assert value <= maxima.bound[i] + 1e-6


def drawn(space, seed):
    """A setup of a design space."""
    return space.setup(fresh(space, np.random.default_rng(seed)))


@pytest.mark.parametrize(
    ("target", "sensors"), [(Target("V_S", 0.5), 9), (Target("V_S", 1.0), 20), (Target("V_T"), 3)]
)
def test_no_drawn_layout_exceeds_the_bound_of_any_prices(target, sensors):
    scene = paper_scene(goals=(Goal(target),))
    space, verifier = Space(scene, sensors=sensors), Verifier(scene, 0.04)
    pose = AtPose(scene, space, 0)
    grid = TargetGrid.of(scene, target, 0, 60_000)
    zetas = [verifier.verify(drawn(space, seed), target).zeta for seed in range(8)]
    bounds = [pose.bound(0, QUICK, priced=False).value]
    for seed in range(3):
        field = PriceField(grid, QUICK.points)
        priced = Priced(pose, grid, QUICK, drawn_prices(field, seed))
        bounds.append(priced.bound(replace(QUICK, places=0, boxes=ROUGH)))
    assert min(bounds) >= max(zetas) - _COUNT


@pytest.fixture(scope="module")
def found():
    """The layout of a short search for the near shell, and its scene and space."""
    space = Space(NEAR, sensors=9)
    short = replace(usual(NEAR, space, Criterion()), starts=1)
    return search(NEAR, space, time_cap=3, schedule=short, voxel=0.04), space


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


@pytest.mark.parametrize(("radius", "close"), [(0.5, 0.05), (1.5, 0.002)])
def test_two_sensors_come_close_to_their_bound(radius, close):
    """All pairs of sensors of a fine grid on parts of two links."""
    narrow = Limits(position=(0.4, 0.6), tilt=(0.5, 1.0))
    scene = paper_scene(
        goals=(Goal(Target("V_S", radius)),),
        rules=Rules(sensors=(1, 2), mount="free"),
        limits={"upper_arm": narrow, "forearm": narrow, "tool": Limits(keep_out=((0, 1),))},
    )
    effort = Effort(600, 30, 100, voxels=200_000)
    bound = upper_bound(scene, Space(scene, sensors=2), effort=effort)
    points = scene.sample(scene.goals[0].target, 0, 4000, 0)
    covers = single_shares(scene, points)
    best = covers[np.argsort(-covers.mean(axis=1))[:600]].astype(np.float32)
    alone, both = best.mean(axis=1), best @ best.T / len(points)
    pair = (alone[:, None] + alone - both).max()
    error = 3 * math.sqrt(pair / len(points))
    assert pair - error <= bound.value <= pair + close + error


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
