"""The soft estimator after a loss: against the plain estimator without the lost cones, against
differences, in the limit.
"""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.soft.estimator import CUT, SHARP
from place_rings.coverage.soft.leave_one_out import soft_losses
from place_rings.coverage.soft.sampling import cloud
from place_rings.coverage.solids.cones import Cones

from .strategies.solids import padded_cones
from .strategies.units import GENERATORS
from .test_soft_estimator import ALL, around, on_device, plain, smooth

GROUP = np.array([0, 0, 1, 1, 1, 3])  # nothing is lost with group 2
CONES, POINTS = len(GROUP), 200
SIX = padded_cones(CONES)
compiled = jax.jit(lambda c, p, width, weights, cut: soft_losses(c, GROUP, p, width, weights, cut))


def estimate(cones, points, width, weights, cut=ALL):
    """Of one shape, so that one compilation serves all tests."""
    p = on_device(cloud(points, dtype=np.float64, blocks=4))
    return compiled(on_device(cones), p, width, jnp.asarray(weights, float), cut)


def without(cones, g):
    """The cones that are not of group ``g``."""
    return Cones(*(np.delete(a, np.flatnonzero(g == GROUP), axis=0) for a in vars(cones).values()))


def plain_losses(cones, points, width):
    """The plain estimator without each group."""
    return [plain(c.apex, c.axis, c, points, width) for c in (without(cones, g) for g in range(4))]


@settings(max_examples=20)
@given(SIX, st.sampled_from([0.3, 0.1, 0.03]), GENERATORS)
def test_value_is_the_plain_one_without_the_group(cones, width, rng):
    points = around(rng, POINTS)
    expected = plain_losses(cones, points, width)
    assert np.asarray(estimate(cones, points, width, np.ones(4)).zeta) == pytest.approx(
        expected, abs=1e-12
    )


@settings(max_examples=20)
@given(SIX, st.sampled_from([0.3, 0.1, 0.05]), GENERATORS)
def test_gradient_is_the_central_difference(cones, width, rng):
    points = around(rng, POINTS)
    points = points[smooth(cones, points)]
    weights, step = rng.uniform(0, 1, 4), 1e-5
    soft = estimate(cones, points, width, weights)
    for _ in range(2):
        da, dx = rng.normal(size=(2, CONES, 3))
        moved = (
            replace(cones, apex=cones.apex + h * da, axis=cones.axis + h * dx)
            for h in (step, -step)
        )
        up, down = (weights @ plain_losses(c, points, width) for c in moved)
        slope = float((soft.by_apex * da).sum() + (soft.by_axis * dx).sum())
        assert slope == pytest.approx((up - down) / (2 * step), abs=1e-6)


@settings(max_examples=20)
@given(SIX, GENERATORS)
def test_tends_to_the_share_of_points(cones, rng):
    points = around(rng, POINTS)
    f = np.stack([cones.part(points, k) for k in range(CONES)])
    on_surface = (np.abs(f).min(axis=0) < 20 * SHARP).mean()
    exact = [(without(cones, g)(points) <= 0).mean() for g in range(4)]
    soft = estimate(cones, points, SHARP, np.ones(4), CUT)
    assert np.asarray(soft.zeta) == pytest.approx(exact, abs=on_surface + 1e-6)
    assert all(bool(jnp.isfinite(part).all()) for part in jax.tree.leaves(soft))
