"""Laws of detection: monotone, exact at the stated figures, the same in NumPy and JAX."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.detection.aspect import LEVEL, Extent, Vertical, aspect
from place_rings.coverage.detection.detection import RATES, THRESHOLDS, Detection, bounds, detectors
from place_rings.coverage.detection.law import (
    at_least,
    in_time,
    overlap,
    per_frame,
    signal,
)
from place_rings.coverage.detection.pieces import PIECES
from place_rings.coverage.sensors.catalogue import MODELS
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.coverage.solids.beams import InBeam
from scipy.stats import norm

ALL = [effective(Use(name)).sensor for name in MODELS]
OWN = [Sensor(), Sensor(fov=2.0, shape="dome"), Sensor(fov=0.5, near_m=0.1)]
sensors = st.sampled_from([*ALL, *OWN])
shares = st.floats(0.01, 1.0)
sizes = st.floats(0.005, 2.0)
tangents = st.floats(-1.2, 1.2)
factors = st.floats(1.0, 3.0)


def p(sensor, depth, u=0.0, v=0.0, size=(0.1, 0.2), outside=-1.0, up=LEVEL, of=None, **question):
    """Return the probability of one frame at one place of a sensor's frame, for a piece whose front
    is at a depth."""
    of = detectors([sensor], Detection(**question)) if of is None else of
    axis = depth + size[0] / 2
    at = InBeam(*(np.array([x]) for x in (axis, u * axis, v * axis)))
    seen = aspect(at, up, of, Extent(*size))
    return float(per_frame(signal(seen, np.array([outside]), of, Extent(*size)), of)[0])


@st.composite
def verticals(draw):
    v = np.array(draw(st.tuples(*[st.floats(-1, 1)] * 3)))
    length = np.linalg.norm(v)
    return Vertical(*(v / length)) if length > 1e-3 else LEVEL


@given(sensors, st.floats(0.02, 20), tangents, tangents, sizes, sizes, shares, factors, verticals())
def test_monotone_in_width_reflectance_view_and_cross_talk(s, d, u, v, wide, high, rho, k, up):
    d, size = max(d, 1.5 * (s.near_m or 0.0), 0.6), (wide, high)  # beyond every least distance
    d += wide * k + high

    def at(size=size, outside=-0.01, **more):
        return p(s, d - size[0] / 2, u, v, size, outside, up, **more)  # the centre stays

    here, whole = at(reflectance=rho), at(outside=-9.0, reflectance=rho)
    assert 0 <= here <= whole <= 1
    assert at((wide * k, high), -9.0, reflectance=rho) >= whole - 1e-12
    assert at(reflectance=min(rho * k, 1.0)) >= here - 1e-12
    assert at(outside=0.0, reflectance=rho) <= here + 1e-12
    assert at(reflectance=rho, crosstalk=0.1) <= here + 1e-12
    assert at(outside=wide + high) == 0


@given(sensors, st.floats(0.6, 20), tangents, tangents, sizes, sizes, shares, factors)
def test_monotone_in_distance_and_height_of_what_stands_before_a_level_sensor(
    s, d, u, v, wide, high, rho, k
):
    d += wide
    whole = p(s, d, u, v, (wide, high), -9.0, reflectance=rho)
    assert p(s, d, u, v, (wide, high * k), -9.0, reflectance=rho) >= whole - 1e-12
    assert p(s, d * k, u, v, (wide, high), -9.0, reflectance=rho) <= whole + 1e-12
    assert p(s, -d, size=(wide, high)) == 0 or not s.form.ends_flat


@given(st.sampled_from(ALL), st.floats(0.6, 10), shares)
def test_monotone_in_light(s, d, rho):
    levels = MODELS[s.use.name].levels  # the weakest first
    by_light = [p(s, d, size=(50, 50), reflectance=rho, ambient=light) for light in levels]
    assert np.all(np.diff(by_light) <= 1e-12)


@pytest.mark.parametrize("s", ALL, ids=MODELS)
def test_meets_the_stated_rate_at_the_stated_range_and_target(s):
    model = MODELS[s.use.name]
    rate, of = model.detection_rate or 0.9, detectors([s], Detection())
    for r in model.ranges:
        d = max(r.range_m, model.least_m or 0.0)
        u, v = np.where(of.zones[0] % 2 == 0, of.edge[0] / of.zones[0], 0.0)
        got = p(
            s, d, u, v, size=(99, 99), outside=-99.0, ambient=r.ambient, reflectance=r.reflectance
        )
        assert got == pytest.approx(rate, abs=1e-9) if d == r.range_m else got >= rate


@given(st.floats(0, 60), st.floats(*THRESHOLDS), st.floats(*RATES), sensors)
def test_bounds_hold_for_every_threshold_and_rate(s, b, rate, sensor):
    low, high = (float(per_frame(np.array([s]), of)[0]) for of in bounds([sensor], Detection()))
    z = norm.ppf(rate + (1 - rate) * norm.cdf(-b))
    assert low - 1e-9 <= 1 - norm.cdf(b - s * (b + z)) / norm.cdf(b) <= high + 1e-9


@given(st.floats(-1.5, 1.5), st.floats(0.01, 2), st.floats(0.1, 1), st.integers(1, 8))
def test_overlap_is_the_share_of_the_best_zone_by_sampling(centre, half, edge, zones):
    ends = np.linspace(-edge, edge, zones + 1)
    x = (np.arange(4000) + 0.5) / 4000
    covered = [np.mean(abs(a + (b - a) * x - centre) <= half) for a, b in itertools.pairwise(ends)]
    got = float(overlap(np.float64(centre), half, edge, zones))
    assert got == pytest.approx(max(covered), abs=1e-3)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=6), st.integers(1, 6))
def test_at_least_k_is_the_sum_over_all_outcomes(chances, k):
    outcomes = itertools.product((0, 1), repeat=len(chances))
    total = sum(
        np.prod([q if hit else 1 - q for q, hit in zip(chances, hits, strict=True)])
        for hits in outcomes
        if sum(hits) >= k
    )
    got = at_least(k, np.array(chances))
    assert got == pytest.approx(total, abs=1e-12)
    assert at_least(k + 1, np.array(chances)) <= got + 1e-12


@given(st.sampled_from(ALL), st.floats(0, 1), st.floats(0.001, 2), factors)
def test_more_time_detects_no_less(s, chance, seconds, k):
    less, more = (
        float(in_time(np.array([chance]), detectors([s], Detection(seconds=t)))[0])
        for t in (seconds, seconds * k)
    )
    assert less <= more + 1e-12


def test_numpy_and_jax_agree_with_finite_gradients_everywhere():
    question = Detection("hand", seconds=0.5)
    of = detectors([*ALL, *OWN], question)
    edges = np.unique(np.concatenate([(2 * n / 8 - 1) * of.edge[:, 0] for n in range(9)]))[::12]
    depths = np.array([-1.0, 0.0, 0.02, 0.3, 1.0, 4.0])
    points = np.stack(np.meshgrid(depths, [0.0, *edges], [0.0, 0.2]), -1).reshape(-1, 3)
    points[:, 1:] *= np.maximum(abs(points[:, :1]), 0.1)

    def chance(at, of):
        place = InBeam(*(at[..., None, i] for i in range(3)))
        seen = aspect(place, Vertical(*np.array([0.6, 0.0, 0.8])), of, question.extent)
        s = signal(seen, place.away * 0 - 0.01, of, question.extent)
        return in_time(per_frame(s, of), of)

    with jax.enable_x64(True):
        traced = type(of)(*map(jnp.asarray, of))

        def both(at):
            values = chance(at, traced)
            return values.sum(), values

        slopes = jax.jit(jax.vmap(jax.grad(both, has_aux=True)))
        slope, values = slopes(jnp.asarray(points))
    assert np.allclose(chance(points, of), values, atol=1e-6)
    assert np.isfinite(slope).all()


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_every_figure_of_detection_has_a_source(model):
    stated = (model.detection_rate, model.below_least, model.crosstalk)
    assert model.source
    assert model.detection_source or stated == (None, None, None)
    assert all(piece.source for piece in PIECES.values())


def test_a_target_nearer_than_the_least_distance_counts_only_if_it_is_reported():
    wrong = effective(Use("vl53l1x")).sensor
    assert p(wrong, 0.039, size=(1, 1)) == 0 < p(wrong, 0.041, size=(1, 1))
    assert p(effective(Use("vl53l3cx")).sensor, 0.001, size=(1, 1)) == 1
