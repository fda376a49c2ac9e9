"""Mixed cones and pyramids for the soft estimator: values of f and the hand-written gradient.

At each point, a pyramid's f is one of five functions that are linear in p, in the axis and in the
vectors across it. Its gradient therefore also consists of weighted sums over points. The gradient
by side = up x axis contributes to those by up and by axis.
"""

from typing import Any

import jax
import jax.numpy as jnp

from ..arrays import Array, Numbers, cross, dot
from ..solids.sensor_beams import MixedBeams
from .cones import SoftBeams


class SquareBeams(SoftBeams):
    """K beams, cones or pyramids; see ``SoftBeams``.

    Their parameters also include ``up`` and the half angle along it.
    """

    columns = 9

    def __init__(self, optics: MixedBeams) -> None:
        super().__init__(optics)
        more = (
            # of the padding beam, which sees nothing
            jnp.concatenate([a, jnp.zeros((1, *a.shape[1:]), a.dtype)])
            for a in (optics.up, optics.half_up)
        )
        self.parts = (*self.parts, *more)

    def _reach(self, blocks: tuple[Array, ...], width: Numbers, cut: Numbers) -> Any:
        _, weight, centre, radius = blocks
        gap = self.cones.part(centre[:, None], jnp.arange(self.count)[None]) - radius[:, None]
        return (gap < cut * width) & (weight[:, :1] > 0)

    def pairs(self, points: Array, some: Any, width: Numbers) -> tuple[Any, ...]:
        """Evaluate g blocks of B points against c beams each, all (g, c, B).

        Returns:
            f / width; the growth of f per m across a cone's axis (over the distance from it), along
                the axis, along side and along up; and the distance along the axis.
        """
        apex, axis, cosine, sine, range_m, up, half_up = (a[..., None] for a in some[:7])
        v = tuple(points[:, None, :, i] - apex[:, :, i] for i in range(3))
        side = jnp.moveaxis(cross(some[5], some[1]), -1, 0)[..., None]

        def along(e: Array | list[Array]) -> Any:
            return v[0] * e[0] + v[1] * e[1] + v[2] * e[2]

        d, x, y = (
            along([axis[:, :, i] for i in range(3)]),
            along(side),
            along([up[:, :, i] for i in range(3)]),
        )
        square, base = half_up > 0, d - range_m
        u = tuple(v[i] - d * axis[:, :, i] for i in range(3))
        round_ = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
        inverse = jax.lax.rsqrt(jnp.where(round_ > 0, round_, 1.0)) * (round_ > 0)
        cone_side = round_ * inverse * cosine - d * sine
        cos_up, sin_up = jnp.cos(half_up), jnp.sin(half_up)
        first, second = jnp.abs(x) * cosine - d * sine, jnp.abs(y) * cos_up - d * sin_up
        mantle = jnp.where(square, jnp.maximum(first, second), cone_side)
        on_mantle, on_first = mantle >= base, first >= second
        across = jnp.where(on_mantle & ~square, cosine * inverse, 0)
        on_x, on_y = (on_mantle & square & which for which in (on_first, ~on_first))
        lean = jnp.where(on_y, sin_up, sine)
        by_side, by_up = (
            jnp.where(on_x, jnp.sign(x) * cosine, 0),
            jnp.where(on_y, jnp.sign(y) * cos_up, 0),
        )
        return (
            jnp.maximum(mantle, base) * (1 / width),
            across,
            jnp.where(on_mantle, -lean, 1.0),
            by_side,
            by_up,
            d,
        )

    def slopes(self, points: Array, some: Any, pull: Array, *geometry: Array) -> Any:
        """Return the gradient (g, c, 9) by apex, axis and up; see ``SoftBeams``."""
        apex, axis, up = some[0], some[1], some[5]
        across, along, by_side, by_up, d = geometry
        with_one = jnp.concatenate([points, jnp.ones_like(points[..., :1])], axis=2)
        weights = [pull * across, pull * across * d, pull * along, pull * by_side, pull * by_up]
        sums = jnp.concatenate(weights, axis=1) @ with_one
        v1, v2, v3, v4, v5 = (s[..., :3] - s[..., 3:] * apex for s in jnp.split(sums, 5, axis=1))
        _, _, total, total_side, total_up = jnp.split(sums[..., 3:], 5, axis=1)
        side = cross(up, axis)
        by_apex = -(
            v1 - dot(v1, axis)[..., None] * axis + total * axis + total_side * side + total_up * up
        )
        by_axis = v3 - (v2 - dot(v2, axis)[..., None] * axis) + cross(v4, up)
        return jnp.concatenate([by_apex, by_axis, v5 + cross(axis, v4)], axis=2)

    def pulled_back(self, slope: Array) -> tuple[Any, ...]:
        """Return the gradient by the apexes, the axes and the up vectors (K, 3)."""
        return *super().pulled_back(slope), slope[:, 6:9]
