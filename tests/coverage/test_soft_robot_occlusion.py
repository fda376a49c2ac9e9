"""The smooth first return lies between exact ones, and is the exact one as its width approaches
zero."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.occlusion.occluders import Occluders, beams
from place_rings.coverage.pytrees import mapped
from place_rings.coverage.soft.first_return import FADE, soft_unreported
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.polyhedra import box
from scipy.spatial.transform import Rotation

from ..support import drawing


@jax.jit
def stop(cones, bodies, obstacles, width):
    """The first return of one target."""
    one = jnp.full((len(cones), 1), jnp.inf)
    return soft_unreported(cones, bodies, obstacles, width, one)[:, 0, 0]


THREE = np.array([0.15, 0.15, np.inf])  # separations


@jax.jit
def intervals(cones, bodies, obstacles, width):
    """In which nothing is reported of three targets."""
    several = jnp.broadcast_to(jnp.asarray(THREE), (len(cones), 3))
    return soft_unreported(cones, bodies, obstacles, width, several)


NEAR = 1e-3  # m, error of the distances: of the searches along an axis, and of 32-bit numbers


def on_device(tree, kind=jnp.float64):
    return jax.tree.map(
        lambda a: jnp.asarray(a, kind if np.asarray(a).dtype == float else None), tree
    )


def drawn(seed):
    """Cones outside of some balls, rods and boxes: of one shape, which JAX compiles once."""
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(-0.6, 0.6, (2, 6, 3))
    end[:2] = start[:2]
    bodies = Capsules(start, end, rng.uniform(0.005, 0.12, 6))
    each = [
        (rng.uniform(-0.5, 0.5, 3), rng.uniform(0.02, 0.4, 3), Rotation.random(rng=rng).as_matrix())
        for _ in range(2)
    ]
    cones = drawing.cones(rng, 400)
    free = np.flatnonzero(Occluders(bodies, boxes(each)).holds(np.asarray(cones.apex))[0] < 0)[:100]
    return mapped(lambda a: np.asarray(a)[free], cones), bodies, each


def boxes(each, grown=0.0):
    """The boxes, ``grown`` m thicker on all sides."""
    return tuple(box(c, np.maximum(size + 2 * grown, 1e-9), turn) for c, size, turn in each)


def stops(cones, bodies, each, grown):
    """Where sensors are blinded by bodies that are ``grown`` m thicker, (K,) m, at most as the soft
    estimator has it; 0 of those that then stand in something."""
    bodies = replace(bodies, radius=np.maximum(bodies.radius + grown, 1e-9))
    found = beams(cones, Occluders(bodies, boxes(each, grown)), "blind")
    at = np.where(found.cones.range_m > 0, found.dark[:, 0, 0], 0.0)
    return np.minimum(at, 1.1 * cones.range_m / np.cos(cones.half_angle))


@pytest.mark.slow
@pytest.mark.parametrize("kind", [jnp.float64, jnp.float32])
@settings(max_examples=8, deadline=None)
@given(seed=drawing.seeds, width=st.sampled_from([1e-6, 1e-3, 5e-3, 0.02]))
def test_a_soft_first_return_lies_between_those_of_thicker_and_thinner_bodies(kind, seed, width):
    """By the part of the width over which they fade: as it approaches zero, both are the exact
    one."""
    cones, bodies, each = drawn(seed)
    soft = np.asarray(stop(*on_device((cones, bodies, boxes(each)), kind), width))
    grown = FADE * width + NEAR
    assert np.all(stops(cones, bodies, each, grown) - NEAR <= soft)
    assert np.all(soft <= stops(cones, bodies, each, -grown) + NEAR)


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(seed=drawing.seeds, width=st.sampled_from([1e-6, 1e-3, 5e-3, 0.02]))
def test_soft_intervals_lie_between_those_of_thicker_and_thinner_bodies(seed, width):
    """As sets of distances."""
    cones, bodies, each = drawn(seed)
    away = np.linspace(0, 1.05, 300) * (cones.range_m / np.cos(cones.half_angle))[:, None]
    soft = intervals(*on_device((cones, bodies, boxes(each))), width)

    def exact(grown):
        thicker = replace(bodies, radius=np.maximum(bodies.radius + grown, 1e-9))
        several = replace(cones, separation=np.tile(THREE, (len(cones), 1)))
        return beams(several, Occluders(thicker, boxes(each, grown)), "returns")

    def dark(found, slack=0.0):
        start, end = np.moveaxis(np.asarray(found), (2, 1), (0, 1))[..., None]
        return ((start - slack <= away) & (away < end + slack)).any(axis=0)

    grown = FADE * width + NEAR
    thick, thin, here = exact(grown), exact(-grown), dark(soft)
    inside = thick.cones.range_m < 0
    assert np.all(here | ~dark(thin.dark, -NEAR))
    assert np.all(~here[~inside] | dark(thick.dark, NEAR)[~inside])
    assert (here & ~dark(soft[:, 2:])).any()


@pytest.mark.slow
@settings(max_examples=4, deadline=None)
@given(seed=drawing.seeds)
def test_soft_intervals_have_their_slopes(seed):
    """By apexes and axes, against central differences, in the median, which is free of kinks."""
    cones, bodies, each = drawn(seed)
    rng = np.random.default_rng(seed)
    turn = rng.normal(size=(2, *cones.apex.shape))

    def moved(by):
        turned = cones.axis + by * turn[1]
        return replace(cones, apex=cones.apex + by * turn[0], axis=turned)

    def at(by):
        found = intervals(moved(by), *on_device((bodies, boxes(each))), 0.02)
        return found.reshape(-1, 6)[:, :5]  # the last has no end

    _, slope = jax.jvp(at, (0.0,), (1.0,))
    difference = (at(1e-6) - at(-1e-6)) / 2e-6
    off = np.abs(slope - difference) / (1 + np.abs(difference))
    assert np.median(off) < 1e-6
    assert np.quantile(off, 0.9) < 1e-2
