"""Parts of an upper bound hold by themselves: blurred beams, prices, rings, budgets."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.sensors.sensor import Sensor
from place_rings.coverage.targets import Target
from place_rings.objectives.scene import Goal, paper_scene
from place_rings.placement.bound.blurred_beam import STEEPEST, BlurredBeam, Profile
from place_rings.placement.bound.families import Budget, families
from place_rings.placement.bound.link_cylinder import LinkCylinder
from place_rings.placement.bound.price_field import PriceField, TargetGrid
from place_rings.placement.bound.ring_values import RingMaxima, RingSums, shares, turns
from place_rings.placement.search.design import Space
from scipy.ndimage import map_coordinates

from ..support import drawing

NEAR = paper_scene(goals=(Goal(Target("V_S", 0.5)),))


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


@pytest.mark.long
def test_long_thin_beams_have_nodes_enough_or_no_prices():
    """160 nodes over 12 m and 32-bit differences of squares missed half of a small target."""
    sensor, sigma = Sensor(math.radians(3.6), 12.0), 0.05
    blurred = BlurredBeam(sensor, sigma)
    for along in (3.0, 6.03, 9.01):
        share = float(blurred.share(np.array([along]), np.array([0.0]))[0])
        assert share == pytest.approx(beam_share(sensor, along, 0.0, sigma, 1), abs=0.012)
    assert blurred.profile.resolves(sigma)
    assert not Profile.of(sensor, 0.01).resolves(0.01)


def test_distances_from_a_long_beam_lose_no_digits(near):
    field = near[0]
    beam = BlurredBeam(Sensor(math.radians(1.0), 12.0), field.sigma)
    look = np.array([[0.6, 0.0, 0.8]])
    apex = field.points[:1] - 11.0 * look
    side = np.array([0.8, 0.0, -0.6])
    exact = field.points - apex
    along, away = exact @ look[0], np.hypot(exact @ side, exact[:, 1])
    slow = beam.share(along, away**2)
    assert shares(beam, field, apex, look)[0] == pytest.approx(slow, abs=2e-4)


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
    field = PriceField(TargetGrid.of(NEAR, NEAR.goals[0].target, 0, 60_000), 300)
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


@pytest.mark.long
@settings(max_examples=3)
@given(drawing.seeds)
def test_no_ring_collects_more_than_its_bound_and_refining_never_raises_it(near, seed):
    field, beam, some = near
    rng, family = np.random.default_rng(seed), some[seed % len(some)]
    prices = drawn_prices(field, seed)
    maxima = RingMaxima(family, beam, field, prices, 0.8)
    before = maxima.bound
    maxima.refine(np.arange(len(family.counts)), 10)
    assert np.all(maxima.bound <= before + 1e-12)
    for _ in range(12):
        i = int(rng.integers(len(family.counts)))
        n = family.counts[i]
        turn = rng.uniform(0, 6) + np.arange(n) * 2 * math.pi / n
        beams = family.beams(rng.uniform(), rng.uniform(*family.tilt), turn)
        assert collected(field, beam, prices, *beams).sum() <= maxima.bound[i] + 1e-6


def collected(field, beam, prices, apex, look):
    """What beams collect of a field of prices in the target, by points in each beam."""
    points, volumes = beam.profile.cloud
    side = np.cross(look, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    frame = np.stack([side, np.cross(look, side), look], axis=1)
    where = (points @ frame + apex[:, None]).reshape(-1, 3)
    values, corner, step = field.sampled(prices, 4)
    price = map_coordinates(values, ((where - corner) / step).T, order=1)
    price *= field.grid.inside(where)
    return price.reshape(len(apex), -1) @ volumes / field.grid.volume


@settings(max_examples=4)
@given(drawing.seeds)
def test_sums_over_cells_are_what_beams_collect(near, seed):
    field, beam, some = near
    rng, family = np.random.default_rng(seed), some[seed % len(some)]
    prices = drawn_prices(field, seed)
    cells = LinkCylinder(family, beam, field, 0.03, 120)
    cells.load(prices)
    tilt = rng.uniform(*family.tilt)
    values = cells.collected(tilt)
    for _ in range(5):
        k, a = rng.integers(len(cells.places)), rng.integers(120)
        beams = family.beams(cells.places[k], tilt, np.array([a * 2 * math.pi / 120]))
        slow = collected(field, beam, prices, *beams)[0]
        assert values[k, a] == pytest.approx(slow, abs=2 * cells.error)


@given(drawing.seeds)
@settings(max_examples=5)
def test_gathering_is_the_transpose_of_sampling(near, seed):
    field = near[0]
    rng, prices = np.random.default_rng(seed), drawn_prices(field, seed)
    points = field.points[rng.integers(len(field.points), size=50)] + rng.normal(size=(50, 3)) / 20
    values, corner, side = field.sampled(prices)
    direct = map_coordinates(values, ((points - corner) / side).T, order=1).sum()
    gathered = field.gathered(points, np.ones(50)) @ prices * field.grid.volume
    assert gathered == pytest.approx(direct, rel=1e-4, abs=1e-6)
