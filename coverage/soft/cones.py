"""Beams for the soft estimator: the beams near a block of points, the implicit function of each
beam at each point, and its gradient by the beams' parameters.

The gradient is hand-written, not derived automatically. For a cone it consists of three weighted
sums over points, which are matrix products.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from ..arrays import Array, Index, Numbers, dot
from ..solids.cones import Cones, cone

_PIECE = {"cpu": 16}  # beams of a block processed at once: they fit in cache on a CPU,
_PIECE_ELSEWHERE = 64  # more on an accelerator


class Near(NamedTuple):
    """The near beams of each block of a group, in pieces of the same length for all blocks."""

    pieces: Any
    """Number of pieces."""
    most: int
    """Maximum number of pieces."""
    beams_of: Callable[[Any], tuple[Any, tuple[Any, ...]]]
    """Function from a piece's index to its beams (g, c), K for none, and their parameters
    (g, c, ...)."""


class SoftBeams:
    """K cones for the soft estimator."""

    columns = 6
    """Number of differentiable parameters of a beam."""

    def __init__(self, cones: Cones) -> None:
        self.cones, self.count = cones, len(cones)
        made_of = (
            cones.apex,
            cones.axis,
            jnp.cos(cones.half_angle),
            jnp.sin(cones.half_angle),
            cones.range_m,
        )
        # One further cone that sees nothing: padding for blocks with fewer cones than their
        # neighbours.
        self.parts: tuple[Any, ...] = tuple(
            jnp.concatenate([a, jnp.full((1, *a.shape[1:]), nothing, a.dtype)])
            for a, nothing in zip(made_of, (0, 0, 0, 0, -jnp.inf), strict=True)
        )

    def near(self, blocks: tuple[Array, ...], width: Numbers, cut: Numbers) -> Near:
        """Return the beams that come within ``cut`` widths of each block."""
        index, pieces = self._in_pieces(self._reach(blocks, width, cut))

        def beams_of(j: Index) -> tuple[Any, tuple[Any, ...]]:
            chosen = index(j)
            return chosen, tuple(a[chosen] for a in self.parts)

        return Near(*pieces, beams_of)

    def _reach(self, blocks: tuple[Array, ...], width: Numbers, cut: Numbers) -> Any:
        """Return which beams come near which block: (g, K)."""
        _, weight, centre, radius = blocks
        gap = cone(centre[:, None], *(a[None, :-1] for a in self.parts[:5])) - radius[:, None]
        return (gap < cut * width) & (weight[:, :1] > 0)

    def _in_pieces(self, near: Array) -> tuple[Callable[[Any], Any], tuple[Any, int]]:
        """Return a function from j to piece j of each block's near beams (g, K), and piece counts.

        The counts are the actual and the maximum number of pieces.
        """
        k = self.count
        piece = min(_PIECE.get(jax.default_backend(), _PIECE_ELSEWHERE), k)
        index = jnp.sort(jnp.where(near, jnp.arange(k, dtype=jnp.int32)[None], k), axis=1)
        index = jnp.pad(index, ((0, 0), (0, -k % piece)), constant_values=k)
        pieces = -(-near.sum(axis=1).max() // piece), index.shape[1] // piece
        return lambda j: jax.lax.dynamic_slice_in_dim(index, j * piece, piece, axis=1), pieces

    def pairs(self, points: Array, some: Any, width: Numbers) -> tuple[Any, ...]:
        """Evaluate g blocks of B points against c cones each, all (g, c, B).

        Returns:
            f / width; whether f is that of the side, not of the base; the distance along the axis;
                and 1 over the distance from the axis, 0 on it.
        """
        apex, axis, cosine, sine, range_m = (a[..., None] for a in some[:5])
        x, y, z = (points[:, None, :, i] - apex[:, :, i] for i in range(3))
        a, b, c = (axis[:, :, i] for i in range(3))
        d = x * a + y * b + z * c
        x, y, z = x - d * a, y - d * b, z - d * c
        square = x * x + y * y + z * z
        inverse = jax.lax.rsqrt(jnp.where(square > 0, square, 1.0)) * (square > 0)
        side, base = square * inverse * cosine - d * sine, d - range_m
        return jnp.maximum(side, base) * (1 / width), side >= base, d, inverse

    def slopes(self, points: Array, some: Any, pull: Array, *geometry: Array) -> Any:
        """Return the gradient (g, c, columns) by apex and axis of a sum over points.

        The sum grows by ``pull`` (g, c, B) with each f. With v = p - apex and u = v less its part
        along the axis, f grows by ``across`` u + ``along`` axis per step of p.
        """
        apex, axis, cosine, sine = some[:4]
        on_side, d, inverse = geometry
        across = jnp.where(on_side, pull * cosine[..., None] * inverse, 0)
        along = jnp.where(on_side, -pull * sine[..., None], pull)
        with_one = jnp.concatenate([points, jnp.ones_like(points[..., :1])], axis=2)
        sums = jnp.concatenate([across, across * d, along], axis=1) @ with_one
        v1, v2, v3 = (s[..., :3] - s[..., 3:] * apex for s in jnp.split(sums, 3, axis=1))
        total = jnp.split(sums[..., 3:], 3, axis=1)[2]
        by_apex = -(v1 - dot(v1, axis)[..., None] * axis + total * axis)
        by_axis = v3 - (v2 - dot(v2, axis)[..., None] * axis)
        return jnp.concatenate([by_apex, by_axis], axis=2)

    def pulled_back(self, slope: Array) -> tuple[Any, ...]:
        """Return the gradient by apexes and axes (K, 3) from that by all columns (K, columns)."""
        return slope[:, :3], slope[:, 3:6]


def by_apex(pull: Array, slopes: tuple[Array, Array, Array], columns: int) -> Any:
    """Return the gradient (g, c, columns) of a sum over points by the apex (3 columns).

    The sum grows by ``pull`` (g, c, B) with a function that has the slopes (g, c, B) along x, y and
    z.
    """
    gradient = jnp.stack([(pull * slope).sum(axis=2) for slope in slopes], axis=2)
    return jnp.pad(gradient, ((0, 0), (0, 0), (0, columns - 3)))
