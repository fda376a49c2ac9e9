"""The soft estimator alone: its share and slopes, and cones as rings of one sensor."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from place_rings.coverage.soft.beams import RingsAt
from place_rings.coverage.soft.estimator import choices, log_uncovered
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.sensor_beams import BeamShapes


def rings_of_one(cones: Cones) -> RingsAt:
    """Rings without a radius, whose one sensor looks along ``zero``, in 32 bit; no ring where a
    cone sees nothing."""
    n, look = len(cones), np.asarray(cones.axis)
    axis = np.cross(look, np.eye(3)[np.abs(look).argmin(axis=1)])
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    there = np.asarray(cones.range_m) > -np.inf
    frame = (np.asarray(cones.apex), axis, look, np.cross(axis, look))
    none = np.zeros(n)
    each = [*frame, none, none, there, np.arange(n), none]
    shapes = BeamShapes(np.float32(cones.half_angle), np.float32(cones.range_m))
    kinds = [np.int32 if i == 7 else np.float32 for i in range(len(each))]
    return RingsAt(*(np.asarray(a, kind) for a, kind in zip(each, kinds, strict=True)), shapes)


MOVING = ("centre", "axis", "zero", "side", "tilt", "phase", "radius")


@jax.jit
def share_and_slopes(rings, points, width, occluding=None):
    """The soft share of points (N, 3), two sensors of each ring counting, and its slopes by where
    the rings and the bodies are."""
    chosen = choices(rings, points, 2, width, occluding)

    def share(moving, bodies):
        past = None if bodies is None else replace(occluding, bodies=bodies)
        free = log_uncovered(replace(rings, **moving), points, width, chosen, past)
        return -jnp.expm1(free.sum(axis=(0, 1))).mean()

    moving = {key: getattr(rings, key) for key in MOVING}
    bodies = None if occluding is None else occluding.bodies
    return jax.value_and_grad(share, (0, 1))(moving, bodies)
