"""The soft estimator: against the plain formula, against differences, in the limit, at singular
points, in memory.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.soft.estimator import CUT, SHARP, soft_zeta
from place_rings.coverage.soft.sampling import Cloud, cloud, sample
from place_rings.coverage.solids.base import Difference
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.spheres import sphere

from ..strategies.solids import padded, padded_cones, some_cones
from ..strategies.units import GENERATORS

compiled = jax.jit(soft_zeta)
of_many = jax.jit(
    jax.vmap(jax.vmap(lambda c, *p: soft_zeta(Cones(*c), *p), (None, 0, 0)), (0, None, None))
)
ALL = np.inf  # no cone is left out
CONES, POINTS = 16, 600  # one shape for all, in blocks of 16 points, so that JAX compiles once


def on_device(tree):
    return jax.tree.map(jnp.asarray, tree)


def blocks(points, number=40, dtype=np.float64):
    return on_device(cloud(points, 16, dtype, number))


def estimate(cones, points, width, cut=CUT, slopes=True):
    """With all arguments traced, so that one compilation serves all of one shape."""
    return compiled(cones, points, width, cut, slopes)


def around(rng, points):
    """Points (N, 3) of a cube that most cones lie in, m."""
    return rng.uniform(-1, 1, (points, 3))


def plain(apex, axis, cones, points, width):
    """1 - prod(1 - sigmoid(-f / width)), averaged: the definition, spelled out in NumPy."""
    f = np.stack(
        [
            Cones(apex, axis, cones.half_angle, cones.range_m).part(points, k)
            for k in range(len(apex))
        ]
    )
    with np.errstate(over="ignore"):
        return float(np.mean(1 - np.prod(1 - 1 / (1 + np.exp(f / width)), axis=0)))


@given(padded_cones(CONES), st.sampled_from([0.3, 0.1, 0.03, 0.01]), GENERATORS)
def test_value_is_the_definition(cones, width, rng):
    points = around(rng, POINTS)
    soft = estimate(on_device(cones), blocks(points), width, ALL)
    assert float(soft.zeta) == pytest.approx(
        plain(cones.apex, cones.axis, cones, points, width), abs=1e-12
    )


def smooth(cones, points):
    """Points away from the rim, where side and base meet, and from the axis."""
    v = points[:, None] - cones.apex
    d = (v * cones.axis).sum(axis=2)
    rho = np.linalg.norm(v - d[..., None] * cones.axis, axis=2)
    side = rho * np.cos(cones.half_angle) - d * np.sin(cones.half_angle)
    return ((np.abs(side - (d - cones.range_m)) > 1e-3) & (rho > 1e-2)).all(axis=1)


@settings(max_examples=10)
@given(some_cones(1, 4), st.sampled_from([0.3, 0.1, 0.05]), GENERATORS)
def test_gradient_is_the_central_difference(cones, width, rng):
    """The axis is varied as a free vector about its unit length, as the gradient is."""
    points = around(rng, 100)
    points, cones = points[smooth(cones, points)], padded(cones, CONES)
    soft = estimate(on_device(cones), blocks(points), width, ALL)
    step = 1e-5
    for _ in range(4):
        da, dx = rng.normal(size=(2, CONES, 3))
        up, down = (
            plain(cones.apex + s * da, cones.axis + s * dx, cones, points, width)
            for s in (step, -step)
        )
        slope = float((soft.by_apex * da).sum() + (soft.by_axis * dx).sum())
        assert slope == pytest.approx((up - down) / (2 * step), abs=1e-6)


@given(padded_cones(CONES, least=8), st.sampled_from([0.05, 0.01, 0.002]), GENERATORS)
def test_cones_left_out_do_not_matter(cones, width, rng):
    c, p = on_device(cones), blocks(around(rng, POINTS))
    whole, fewer = estimate(c, p, width, ALL), estimate(c, p, width)
    assert float(abs(whole.zeta - fewer.zeta)) < len(cones) * np.exp(-CUT)
    for a, b in zip(*map(jax.tree.leaves, (whole[1:], fewer[1:])), strict=True):
        assert float(abs(a - b).max()) < 1e-5 / width


@settings(max_examples=3)
@given(st.lists(padded_cones(CONES, least=8), min_size=3, max_size=3), GENERATORS)
def test_many_setups_and_clouds_at_once_are_as_one_by_one(setups, rng):
    """Under vmap the loops run as long as the longest needs, and blocks without points are passed
    over.
    """
    setups = [on_device(cones) for cones in setups]
    clouds = [blocks(around(rng, n)) for n in (100, POINTS)]
    parts = [jnp.stack(a) for a in zip(*map(jax.tree.leaves, setups), strict=True)]
    stacked, width = jax.tree.map(lambda *a: jnp.stack(a), *clouds), jnp.array([0.1, 0.01])
    many = of_many(parts, stacked, width)
    for i, j in np.ndindex(3, 2):
        one = estimate(setups[i], clouds[j], width[j])
        for a, b in zip(*map(jax.tree.leaves, (many, one)), strict=True):
            assert np.allclose(a[i, j], b, rtol=0, atol=1e-12 / float(width[j]))


@settings(max_examples=5)
@given(padded_cones(CONES), GENERATORS)
def test_padding_and_slopes_leave_the_value(cones, rng):
    points = around(rng, POINTS)
    c, small, large = on_device(cones), blocks(points), blocks(points, 80)
    assert large.weight.shape == (80, 16)
    soft, more = estimate(c, small, 0.05), estimate(c, large, 0.05)
    flat = estimate(c, small, 0.05, slopes=False)
    assert float(soft.zeta) == pytest.approx(float(more.zeta), abs=1e-14)
    assert np.allclose(soft.by_apex, more.by_apex, atol=1e-13)
    assert float(flat.zeta) == float(soft.zeta)
    assert not np.any(flat.by_apex)


@given(padded_cones(CONES), GENERATORS)
def test_tends_to_the_share_of_points(cones, rng):
    points = around(rng, 300)
    c, p = on_device(cones), blocks(points)
    exact = float((cones(points) <= 0).mean())
    distance = np.abs(np.stack([cones.part(points, k) for k in range(len(cones))])).min(axis=0)
    on_surface = float((distance < 20 * SHARP).mean())
    assert float(estimate(c, p, SHARP).zeta) == pytest.approx(exact, abs=on_surface + 1e-6)
    assert float(estimate(c, p, float(distance.min()) / 40).zeta) == pytest.approx(exact, abs=1e-9)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_gradients_are_finite_everywhere(dtype):
    """At the apex, on the axis, on the rim, at the base's centre, behind, and far away."""
    cones = Cones(
        np.zeros((2, 3)),
        np.array([[0.0, 0, 1], [1.0, 0, 0]]),
        np.array([0.2, 0.2]),
        np.array([1.5, 1.5]),
    )
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

    def as_type(tree):
        return jax.tree.map(lambda a: jnp.asarray(a, dtype), tree)

    for width in (0.1, 1e-3, 1e-6):
        soft = estimate(as_type(padded(cones, CONES)), blocks(points, dtype=dtype), dtype(width))
        assert all(bool(jnp.isfinite(part).all()) for part in jax.tree.leaves(soft))


@settings(max_examples=5)
@given(padded_cones(CONES, least=8), st.sampled_from([0.1, 0.05, 0.02, 0.008]), GENERATORS)
def test_single_precision_is_enough_for_a_search(cones, width, rng):
    """At all widths of the search: zeta to 1e-5, which is a tenth of a voxel's worth, slopes to
    1e-3 of the steepest.

    Coordinates of about 1 m are rounded by 1e-7 m, so f by a few of these: at 8 mm an exponent by
    1e-4, and a slope, which is made of differences of such, by as much; one more power of ten
    covers the worst point of few.
    """
    points = around(rng, POINTS)
    double = estimate(on_device(cones), blocks(points), width)
    single = estimate(
        jax.tree.map(lambda a: jnp.asarray(a, jnp.float32), cones),
        blocks(points, dtype=np.float32),
        np.float32(width),
    )
    assert all(part.dtype == jnp.float32 for part in jax.tree.leaves(single))
    assert float(abs(double.zeta - single.zeta)) < 1e-5
    for a, b in zip(*map(jax.tree.leaves, (double[1:], single[1:])), strict=True):
        assert float(abs(a - b).max()) < 1e-3 * float(abs(a).max())


def test_memory_does_not_grow_with_pairs():
    """1000 cones and a million points: all pairs would take 4 GB."""
    shapes, points = ((3,), (3,), (), ()), cloud(np.ones((64, 3)))
    cones = [np.ones((1000, *shape), np.float32) for shape in shapes]
    points = [np.zeros((15625, *a.shape[1:]), np.float32) for a in jax.tree.leaves(points)]

    def from_arrays(cones, points):
        return soft_zeta(Cones(*cones), Cloud(*points), 0.01)

    made = jax.jit(from_arrays).lower(cones, points).compile()
    assert made.memory_analysis().temp_size_in_bytes < 100e6


@settings(max_examples=10)
@given(GENERATORS, st.integers(1, 400), st.sampled_from([1, 7, 64]))
def test_clouds_keep_every_point_once(rng, n, block):
    points = around(rng, n)
    c = cloud(points, block, np.float64)
    kept = c.points.reshape(-1, 3)[c.weight.reshape(-1) > 0]
    assert np.array_equal(kept[np.lexsort(kept.T)], points[np.lexsort(points.T)])
    assert np.all(np.linalg.norm(c.points - c.centre[:, None], axis=2) <= c.radius[:, None] + 1e-12)


def test_sampled_points_are_inside_uniform_and_repeatable():
    shell = Difference(sphere([0.0, 0, 0], 1.0), sphere([0.0, 0, 0], 0.5))
    p = sample(shell, 20_000, 7)
    assert np.all(shell(p) <= 0)
    assert np.array_equal(p, sample(shell, 20_000, 7))
    assert not np.array_equal(p, sample(shell, 20_000, 8))
    assert np.abs(p.mean(axis=0)).max() < 0.01
    inner = (np.linalg.norm(p, axis=1) < 0.75).mean()
    assert inner == pytest.approx((0.75**3 - 0.5**3) / (1 - 0.5**3), abs=0.01)
