"""The soft share that several sensors see: against the definition, against differences, in the
limit, at singular points.
"""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.soft.estimator import CUT, SHARP
from place_rings.coverage.soft.k_coverage import soft_seen
from place_rings.coverage.soft.sampling import cloud
from place_rings.coverage.solids.cones import Cones

from .strategies.solids import padded_cones
from .strategies.units import GENERATORS
from .test_soft_estimator import ALL, around, drawn, on_device, smooth

CONES, POINTS = 6, 200
SIX = padded_cones(CONES)
compiled = jax.jit(soft_seen, static_argnums=3)


def estimate(cones, points, width, least, cut=ALL, slopes=True):
    """Of one shape, so that one compilation serves most tests."""
    return compiled(
        on_device(cones),
        on_device(cloud(points, dtype=np.float64, blocks=4)),
        width,
        least,
        cut,
        slopes,
    )


def chances(apex, axis, cones, points, width):
    f = np.stack(
        [
            Cones(apex, axis, cones.half_angle, cones.range_m).part(points, k)
            for k in range(len(apex))
        ]
    )
    with np.errstate(over="ignore"):
        return 1 / (1 + np.exp(f / width))


def plain(p, least):
    """The chance that at least ``least`` of independent events with chances p (K, N) happen: all
    2^K cases, summed up.
    """
    total = np.zeros(p.shape[1])
    for case in itertools.product([False, True], repeat=len(p)):
        if sum(case) >= least:
            total += np.prod(np.where(np.array(case)[:, None], p, 1 - p), axis=0)
    return float(total.mean())


@settings(max_examples=10)
@given(SIX, st.sampled_from([0.3, 0.1, 0.03]), st.sampled_from([2, 3]), GENERATORS)
def test_value_is_the_definition(cones, width, least, rng):
    points = around(rng, POINTS)
    expected = plain(chances(cones.apex, cones.axis, cones, points, width), least)
    assert float(estimate(cones, points, width, least).zeta) == pytest.approx(expected, abs=1e-12)


@settings(max_examples=10)
@given(SIX, st.sampled_from([0.3, 0.1, 0.05]), st.sampled_from([2, 3]), GENERATORS)
def test_gradient_is_the_central_difference(cones, width, least, rng):
    points = around(rng, POINTS)
    points = points[smooth(cones, points)]
    soft = estimate(cones, points, width, least)
    step = 1e-5
    for _ in range(2):
        da, dx = rng.normal(size=(2, CONES, 3))
        up, down = (
            plain(chances(cones.apex + s * da, cones.axis + s * dx, cones, points, width), least)
            for s in (step, -step)
        )
        slope = float((soft.by_apex * da).sum() + (soft.by_axis * dx).sum())
        assert slope == pytest.approx((up - down) / (2 * step), abs=1e-6)


@settings(max_examples=10)
@given(SIX, st.sampled_from([2, 3]), GENERATORS)
def test_tends_to_the_share_of_points(cones, least, rng):
    points = around(rng, POINTS)
    f = np.stack([cones.part(points, k) for k in range(CONES)])
    on_surface = (np.abs(f).min(axis=0) < 20 * SHARP).mean()
    exact = ((f <= 0).sum(axis=0) >= least).mean()
    assert float(estimate(cones, points, SHARP, least, CUT).zeta) == pytest.approx(
        exact, abs=on_surface + 1e-6
    )


@settings(max_examples=10)
@given(padded_cones(2), GENERATORS)
def test_more_sensors_see_less_and_all_numbers_add_up(cones, rng):
    """The sum over k of the chances of at least k is the expected number of cones."""
    points = around(rng, POINTS)
    one, two = (float(estimate(cones, points, 0.1, k).zeta) for k in (1, 2))
    assert one >= two
    expected = chances(cones.apex, cones.axis, cones, points, 0.1).sum(axis=0).mean()
    assert one + two == pytest.approx(expected, abs=1e-12)


@settings(max_examples=10)
@given(padded_cones(40, least=20), st.sampled_from([0.05, 0.01]), GENERATORS)
def test_pieces_and_cones_left_out_do_not_matter(cones, width, rng):
    """40 cones go through in several pieces; those that are far off are left out, with and without
    slopes.
    """
    points = around(rng, POINTS)
    whole, fewer = (estimate(cones, points, width, 3, cut) for cut in (ALL, CUT))
    assert float(abs(whole.zeta - fewer.zeta)) < len(cones) * np.exp(-CUT)
    for a, b in zip(*map(jax.tree.leaves, (whole[1:], fewer[1:])), strict=True):
        assert float(abs(a - b).max()) < 1e-5 / width
    flat = estimate(cones, points, width, 3, CUT, False)
    assert float(flat.zeta) == float(fewer.zeta)
    assert not np.any(flat.by_apex)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_gradients_are_finite_everywhere(dtype):
    """At the apex, on the axis, on the rim, at the base's centre, behind, and far away; the cones
    are twins and a third.
    """
    axis = np.array([[0.0, 0, 1], [0, 0, 1], [1, 0, 0]])
    cones = Cones(np.zeros((3, 3)), axis, np.full(3, 0.2), np.full(3, 1.5))
    rim = 1.5 * np.tan(0.2)
    points = np.array(
        [
            [0, 0, 0],
            [0, 0, 0.5],
            [0, 0, 1.5],
            [rim, 0, 1.5],
            [0, 0, -1],
            [1e6, 0, 0],
            [0, 1e6, 1e6],
        ],
        float,
    )
    c, p = (
        jax.tree.map(lambda a: jnp.asarray(a, dtype), tree)
        for tree in (cones, cloud(points, 4, dtype))
    )
    for width in (0.1, 1e-3, 1e-6):
        assert all(
            bool(jnp.isfinite(part).all())
            for part in jax.tree.leaves(compiled(c, p, dtype(width), 2))
        )


def test_memory_does_not_grow_with_pairs():
    """1000 cones and a million points: all pairs would take 4 GB."""
    cones, points = drawn(1000, 64)
    c, structure = jax.tree.flatten(jax.tree.map(lambda a: jnp.asarray(a, jnp.float32), cones))
    p = jax.tree.map(lambda a: np.zeros((15625, *a.shape[1:]), np.float32), cloud(points))
    p, structure_of_points = jax.tree.flatten(p)

    def from_arrays(c, p):
        return soft_seen(
            jax.tree.unflatten(structure, c), jax.tree.unflatten(structure_of_points, p), 0.01, 3
        )

    memory = jax.jit(from_arrays).lower(c, p).compile().memory_analysis()
    assert memory.temp_size_in_bytes < 150e6


def test_fewer_than_one_sensor_is_refused():
    cones, points = drawn(12, 300)
    with pytest.raises(ValueError, match="at least 1"):
        soft_seen(on_device(cones), on_device(cloud(points, dtype=np.float64)), 0.1, 0)
