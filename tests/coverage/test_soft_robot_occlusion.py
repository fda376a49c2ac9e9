"""The smooth first return lies between exact ones."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from place_rings.coverage.occlusion.occluders import Occluders, beams
from place_rings.coverage.soft.first_return import BALLS, GRAZE, _least, soft_stop
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.polyhedra import box

from ..support import drawing

stop = jax.jit(soft_stop)
MIDDLE, SIZE = (0.4, 0.1, 0.2), np.array((0.2, 0.3, 0.1))  # m
BOX = (box(MIDDLE, SIZE),)
FAR = np.full((5, 3), 1e3)  # m, where bodies matter to nobody


def on_device(tree):
    return jax.tree.map(jnp.asarray, tree)


def drawn(seed):
    """Cones that stand outside of some bodies and a box: of one shape, which JAX compiles once."""
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(-0.6, 0.6, (2, 5, 3))
    bodies = Capsules(start, end, rng.uniform(0.03, 0.12, 5))
    cones = drawing.cones(rng, 40)
    free = np.flatnonzero(Occluders(bodies, BOX).holds(np.asarray(cones.apex))[0] < 0)[:8]
    return Cones(*(np.asarray(a)[free] for a in vars(cones).values())), bodies


def stops(cones, bodies, obstacles):
    """Where sensors are blinded, (K,) m, at most as the soft estimator has it."""
    found = beams(cones, Occluders(bodies, obstacles), "blind")
    at = np.where(found.cones.range_m > 0, found.stop, 0.0)  # 0 of those that stand in something
    return np.minimum(at, 1.1 * cones.range_m / np.cos(cones.half_angle))


@pytest.mark.slow
@settings(max_examples=6)
@given(drawing.seeds)
def test_soft_stops_lie_between_exact_ones(seed):
    """What soft stops less than GRAZE e short of the beam's end lies at most e beside it: so they
    are not before the exact ones past bodies and obstacles e thicker. A ball of the row counts
    fully where its inner half stands in the beam, and bodies of half the radius lie within half a
    step of the row of such balls."""
    cones, bodies = drawn(seed)
    short = np.minimum(1, 0.5 / np.linalg.norm(bodies.end - bodies.start, axis=1))[:, None]
    bodies = replace(bodies, end=bodies.start + short * (bodies.end - bodies.start))
    e = 1.1 * (cones.range_m / np.cos(cones.half_angle)).max() / GRAZE
    thick = replace(bodies, radius=bodies.radius + e), (box(MIDDLE, SIZE + 4 * e),)
    step = np.linalg.norm(bodies.end - bodies.start, axis=1).max() / (BALLS - 1)
    soft, by_box = (
        np.asarray(stop(on_device(cones), on_device(stand), on_device(BOX)))
        for stand in (bodies, replace(bodies, start=FAR, end=FAR))
    )
    assert np.all(stops(cones, *thick) - e <= soft + 1e-9)
    assert np.all(
        soft
        <= stops(cones, replace(bodies, radius=bodies.radius / 2), BOX)
        + step / 2
        + bodies.radius.max() / 16
    )
    exact = stops(cones, None, BOX)
    stopped = exact < cones.range_m  # the box stands in the beam, not beside it
    np.testing.assert_allclose(by_box[stopped], exact[stopped], rtol=0, atol=1e-9)
    assert np.all(by_box <= exact + 1e-9)


@given(values=hnp.arrays(float, (4, 5), elements=st.sampled_from([0.0, 1.0, 2.0])))
def test_only_one_of_equal_stops_has_a_slope(values):
    # shared slopes are divided by a number that is 0 where a compiler rounds equal values otherwise
    slope = np.asarray(jax.grad(lambda v: _least(v).sum())(jnp.asarray(values)))
    np.testing.assert_array_equal(_least(jnp.asarray(values)), values.min(axis=1))
    np.testing.assert_array_equal(np.sort(slope, axis=1), np.tile([0, 0, 0, 0, 1], (4, 1)))
    assert (values[slope == 1] == values.min(axis=1)).all()
