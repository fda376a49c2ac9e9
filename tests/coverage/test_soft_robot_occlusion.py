"""Soft beams past bodies and obstacles: in the limit the exact share, slopes that are central
differences.
"""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from place_rings.coverage.occlusion.occluders import Occluders, beams
from place_rings.coverage.soft.beams import Hidden, InCell
from place_rings.coverage.soft.estimator import SHARP, soft_zeta
from place_rings.coverage.soft.first_return import BALLS, GRAZE, _least, soft_stop
from place_rings.coverage.soft.sampling import cloud
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.polyhedra import box, hull

from ..support import drawing

pytestmark = pytest.mark.slow

estimate, stop = jax.jit(soft_zeta), jax.jit(soft_stop)
MIDDLE, SIZE = (0.4, 0.1, 0.2), np.array((0.2, 0.3, 0.1))  # m
BOX = (box(MIDDLE, SIZE),)
_OPPOSITE = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
WEDGE = (hull(MIDDLE + SIZE / 2 * _OPPOSITE),)  # in the box, with half its planes to compile
FAR = np.full((5, 3), 1e3)  # m, where bodies matter to nobody


def on_device(tree):
    return jax.tree.map(jnp.asarray, tree)


def drawn(seed):
    """Cones that stand outside of some bodies and a box, and 400 points: of one shape, for all to
    share what is compiled.
    """
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(-0.6, 0.6, (2, 5, 3))
    bodies = Capsules(start, end, rng.uniform(0.03, 0.12, 5))
    cones = drawing.cones(rng, 40)
    free = np.flatnonzero(Occluders(bodies, BOX).holds(np.asarray(cones.apex))[0] < 0)[:8]
    return (
        Cones(*(np.asarray(a)[free] for a in vars(cones).values())),
        bodies,
        rng.uniform(-1, 1, (400, 3)),
    )


def hidden(cones, bodies, occlusion):
    return Hidden(on_device(cones), on_device(bodies), occlusion)


def share_and_width(seen, points):
    """The exact share of points, and a width far below the distance of any of them from a
    surface.
    """
    value = seen(points)
    return (value <= 0).mean(), sharp(value)


def sharp(value):
    """A plain float, whichever is less: JAX compiles anew for a scalar of NumPy."""
    return float(min(SHARP, np.abs(value).min() / 40))


@pytest.mark.slow
@settings(max_examples=4)
@given(drawing.seeds)
@example(4394)  # a point 0.75 um from a surface
def test_tends_to_the_exact_share(seed):
    cones, bodies, points = drawn(seed)
    p = on_device(cloud(points, dtype=np.float64))
    share, width = share_and_width(beams(cones, Occluders(bodies, WEDGE), "shadow"), points)
    among = InCell(hidden(cones, bodies, "shadow"), on_device(WEDGE))
    assert float(estimate(among, p, width).zeta) == pytest.approx(share, abs=1e-6)


def test_obstacles_go_into_a_search_of_32_bits_without_a_warning():
    """JAX warns where it traces a 64 bit number in 32 bits; nothing is compiled."""
    cones, bodies, points = drawn(1)
    with jax.enable_x64(False):
        seen = Hidden(*(jax.tree.map(jnp.float32, x) for x in (cones, bodies)), "blind")
        found = jax.eval_shape(soft_zeta, InCell(seen, BOX), on_device(cloud(points)), 0.01)
    assert {part.dtype for part in jax.tree.leaves(found)} == {np.dtype(np.float32)}


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
    cones, bodies, points = drawn(seed)
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
    # and this is where the estimator cuts beams off
    p = on_device(cloud(points, dtype=np.float64))
    away = np.linalg.norm(points[:, None] - cones.apex, axis=2) - soft
    value = np.maximum(cones.part(points[:, None], np.arange(len(soft))[None]), away).min(axis=1)
    among = InCell(hidden(cones, bodies, "blind"), on_device(BOX))
    zeta = float(estimate(among, p, sharp(value)).zeta)
    assert zeta == pytest.approx((value <= 0).mean(), abs=1e-6)


@pytest.mark.parametrize("occlusion", ["shadow", "blind"])
@settings(max_examples=2)
@given(seed=drawing.seeds)
@example(seed=56)  # a stop that moves 75 m per m, by a point: the step must be small
@example(seed=1466)  # a box that stops a beam at its mantle, whatever the length of the axis
def test_slopes_are_central_differences(occlusion, seed):
    cones, bodies, points = drawn(seed)
    p, rng, step, width = (
        on_device(cloud(points, dtype=np.float64)),
        np.random.default_rng(seed),
        1e-8,
        0.05,
    )

    def at(cones):
        return estimate(
            InCell(
                hidden(cones, bodies, occlusion), on_device(WEDGE if occlusion == "shadow" else BOX)
            ),
            p,
            width,
        )

    def along(s, da, dx):
        return float(
            at(
                Cones(cones.apex + s * da, cones.axis + s * dx, cones.half_angle, cones.range_m)
            ).zeta
        )

    off, soft = [], at(cones)
    for _ in range(5):
        da, dx = rng.normal(size=(2, *cones.apex.shape))
        slope = float((soft.by_apex * da).sum() + (soft.by_axis * dx).sum())
        off.append(abs(slope - (along(step, da, dx) - along(-step, da, dx)) / (2 * step)))
    # a point on a crease, or a body that comes to matter, spoils one now and then
    assert np.median(off) < 1e-5


@given(values=hnp.arrays(float, (4, 5), elements=st.sampled_from([0.0, 1.0, 2.0])))
def test_only_one_of_equal_stops_has_a_slope(values):
    # shared slopes are divided by a number that is 0 where a compiler rounds equal values otherwise
    slope = np.asarray(jax.grad(lambda v: _least(v).sum())(jnp.asarray(values)))
    np.testing.assert_array_equal(_least(jnp.asarray(values)), values.min(axis=1))
    np.testing.assert_array_equal(np.sort(slope, axis=1), np.tile([0, 0, 0, 0, 1], (4, 1)))
    assert (values[slope == 1] == values.min(axis=1)).all()
