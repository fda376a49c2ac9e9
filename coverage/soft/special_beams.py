"""Domes, fans and beams with a least range for the soft estimator, beside cones and pyramids.

At each point, f is one of a few smooth functions. Each grows, per step of p, by a multiple of the
part of v = p - apex across the axis, and by multiples of axis, side and up. The slopes of
``SquareBeams`` therefore serve unchanged.
"""

from typing import Any

import jax
import jax.numpy as jnp

from ..arrays import Array, Numbers, cross
from ..solids.fans import FULL
from ..solids.sensor_beams import SpecialBeams
from .pyramids import SquareBeams


def _inverse(square: Array) -> Any:
    """Return 1 / sqrt, and 0 at 0."""
    return jax.lax.rsqrt(jnp.where(square > 0, square, 1.0)) * (square > 0)


class SpecialSoftBeams(SquareBeams):
    """K beams of any shape; see ``SquareBeams``."""

    def __init__(self, optics: SpecialBeams) -> None:
        super().__init__(optics)
        full = optics.half_angle > jnp.pi - FULL
        more = (
            jnp.concatenate([jnp.asarray(a, optics.apex.dtype), jnp.zeros(1, optics.apex.dtype)])
            for a in (optics.dome, optics.half_thickness, optics.near, full)
        )
        self.parts = (*self.parts, *more)

    def pairs(self, points: Array, some: Any, width: Numbers) -> tuple[Any, ...]:
        """Evaluate as ``SquareBeams`` does."""
        t, across, along, by_side, by_up, d = super().pairs(points, some, width)
        apex, _, cosine, sine, range_m, up = (a[..., None] for a in some[:6])
        domed, thick, near, full = (a[..., None] for a in some[7:11])
        side = jnp.moveaxis(cross(some[5], some[1]), -1, 0)[..., None]
        v = tuple(points[:, None, :, i] - apex[:, :, i] for i in range(3))
        x = v[0] * side[0] + v[1] * side[1] + v[2] * side[2]
        y = v[0] * up[:, :, 0] + v[1] * up[:, :, 1] + v[2] * up[:, :, 2]
        square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
        aside = jnp.maximum(square - d * d, 0)
        f = t * width

        # a dome: the mantle of its cone, or the ball about the apex
        distance, off = _inverse(square), _inverse(aside)
        mantle, ball = aside * off * cosine - d * sine, square * distance - range_m
        on_ball, is_dome = ball > mantle, domed > 0
        f = jnp.where(is_dome, jnp.maximum(mantle, ball), f)
        across = jnp.where(is_dome, jnp.where(on_ball, distance, cosine * off), across)
        along = jnp.where(is_dome, jnp.where(on_ball, d * distance, -sine), along)
        by_side, by_up = (jnp.where(is_dome, 0, a) for a in (by_side, by_up))

        # a fan: its slab, its cylinder, or its wedge
        flat = _inverse(d * d + x * x)
        slab, sector = jnp.abs(y) - thick, (d * d + x * x) * flat - range_m
        wedge = jnp.where(full > 0, sector, jnp.abs(x) * cosine - d * sine)
        most, is_fan = jnp.maximum(jnp.maximum(slab, sector), wedge), thick > 0
        on_slab, on_sector = slab >= most, sector >= most
        of_rest = (
            jnp.where(on_sector, d * flat, -sine),
            jnp.where(on_sector, x * flat, jnp.sign(x) * cosine),
        )
        f = jnp.where(is_fan, most, f)
        across = jnp.where(is_fan, 0, across)
        along = jnp.where(is_fan, jnp.where(on_slab, 0, of_rest[0]), along)
        by_side = jnp.where(is_fan, jnp.where(on_slab, 0, of_rest[1]), by_side)
        by_up = jnp.where(is_fan, jnp.where(on_slab, jnp.sign(y), 0), by_up)

        # the plane at which a cone or pyramid begins
        begins = (near > 0) & (near - d > f)
        f = jnp.where(begins, near - d, f)
        across, by_side, by_up = (jnp.where(begins, 0, a) for a in (across, by_side, by_up))
        return f / width, across, jnp.where(begins, -1.0, along), by_side, by_up, d
