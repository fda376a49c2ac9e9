"""Soft beams past bodies and obstacles: in the limit the exact share, slopes that are central differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from place_rings.coverage.beams import Occluders, beams
from place_rings.coverage.capsules import Capsules
from place_rings.coverage.cloud import cloud
from place_rings.coverage.polyhedra import box
from place_rings.coverage.soft import SHARP, soft_zeta
from place_rings.coverage.soft_cell import InCell
from place_rings.coverage.soft_hidden import Hidden
from place_rings.coverage.solids import Cones

from . import drawing

estimate = jax.jit(soft_zeta)
BOX = (box((0.4, 0.1, 0.2), (0.2, 0.3, 0.1)),)


def on_device(tree):
    return jax.tree.map(jnp.asarray, tree)


def drawn(seed, count=8):
    """Cones that stand outside of some bodies and a box, and 400 points, of which one may lie on a surface."""
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(-0.6, 0.6, (2, 5, 3))
    bodies = Capsules(start, end, rng.uniform(0.03, 0.12, 5))
    cones = drawing.cones(rng, 40)
    free = np.flatnonzero(Occluders(bodies, BOX).holds(np.asarray(cones.apex))[0] < 0)[:count]
    return Cones(*(np.asarray(a)[free] for a in vars(cones).values())), bodies, rng.uniform(-1, 1, (400, 3))


def hidden(cones, bodies, occlusion):
    return Hidden(on_device(cones), Capsules(*on_device(tuple(bodies))), occlusion)


@settings(max_examples=20)
@given(drawing.seeds)
def test_tends_to_the_exact_share(seed):
    cones, bodies, points = drawn(seed)
    p = on_device(cloud(points, dtype=np.float64))
    shadow = beams(cones, Occluders(bodies), "shadow")(points)
    assert float(estimate(hidden(cones, bodies, "shadow"), p, SHARP).zeta) == pytest.approx((shadow <= 0).mean(), abs=0.003)
    past_all = beams(cones, Occluders(bodies, BOX), "shadow")(points)
    among = InCell(hidden(cones, bodies, "shadow"), on_device(BOX))
    assert float(estimate(among, p, SHARP).zeta) == pytest.approx((past_all <= 0).mean(), abs=0.003)
    alone = beams(cones, Occluders(None, BOX), "ignore")(points)
    among = InCell(on_device(cones), on_device(BOX))
    assert float(estimate(among, p, SHARP).zeta) == pytest.approx((alone <= 0).mean(), abs=0.003)


@settings(max_examples=20)
@given(drawing.seeds)
def test_blinded_beams_see_about_what_they_should(seed):
    """The soft end of a beam is smooth, so only nearly where the exact one is; no beam sees more than its cone."""
    cones, bodies, points = drawn(seed, 20)
    p = on_device(cloud(points, dtype=np.float64))
    soft = float(estimate(hidden(cones, bodies, "blind"), p, SHARP).zeta)
    assert soft <= float((cones(points) <= 0).mean()) + 1e-6
    assert soft == pytest.approx((beams(cones, Occluders(bodies), "blind")(points) <= 0).mean(), abs=0.15)


@pytest.mark.parametrize("occlusion", ["shadow", "blind"])
@settings(max_examples=15)
@given(seed=drawing.seeds)
def test_slopes_are_central_differences(occlusion, seed):
    cones, bodies, points = drawn(seed, 4)
    p, rng, step, width = on_device(cloud(points, dtype=np.float64)), np.random.default_rng(seed), 1e-6, 0.05
    soft = estimate(hidden(cones, bodies, occlusion), p, width)

    def at(s, da, dx):
        moved = Cones(cones.apex + s * da, cones.axis + s * dx, cones.half_angle, cones.range_m)
        return float(estimate(hidden(moved, bodies, occlusion), p, width).zeta)

    off = []
    for _ in range(5):
        da, dx = rng.normal(size=(2, *cones.apex.shape))
        slope = float((soft.by_apex * da).sum() + (soft.by_axis * dx).sum())
        off.append(abs(slope - (at(step, da, dx) - at(-step, da, dx)) / (2 * step)))
    assert np.median(off) < 2e-3  # a point on a crease, or a body that comes to matter, spoils one now and then
