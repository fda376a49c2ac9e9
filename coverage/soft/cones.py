"""What the soft estimator asks of the sensors' beams: which are near a block of points, the
implicit function of each at each point, and the pull of points on what a beam is made of.

The gradient is written down rather than derived: per cone it is three weighted sums over points,
which are matrix products.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from ..arrays import Array, Index, Numbers, dot
from ..solids.cones import Cones, cone

_PIECE = {"cpu": 16}  # beams a block worked on at once: in cache on a CPU,
_PIECE_ELSEWHERE = 64  # many on an accelerator


class Near(NamedTuple):
    """The near beams of each block of a group, in pieces of the same length for all blocks: how
    many pieces there are, and may be; and for the number of a piece the beams (g, c), K for none,
    and what they are made of (g, c, ...)."""

    pieces: Any
    most: int
    beams_of: Callable[[Any], tuple[Any, tuple[Any, ...]]]


class SoftBeams:
    """K cones as the soft estimator sees them. ``columns``: how many numbers each is made of, as
    far as it has a slope.
    """

    columns = 6

    def __init__(self, cones: Cones) -> None:
        self.cones, self.count = cones, len(cones)
        made_of = (
            cones.apex,
            cones.axis,
            jnp.cos(cones.half_angle),
            jnp.sin(cones.half_angle),
            cones.range_m,
        )
        # One more cone that sees nothing: it stands in where a block looks at fewer cones than its
        # neighbours.
        self.parts: tuple[Any, ...] = tuple(
            jnp.concatenate([a, jnp.full((1, *a.shape[1:]), nothing, a.dtype)])
            for a, nothing in zip(made_of, (0, 0, 0, 0, -jnp.inf), strict=True)
        )

    def near(self, blocks: tuple[Array, ...], width: Numbers, cut: Numbers) -> Near:
        """The beams that come within ``cut`` widths of each block."""
        index, pieces = self._in_pieces(self._reach(blocks, width, cut))

        def beams_of(j: Index) -> tuple[Any, tuple[Any, ...]]:
            chosen = index(j)
            return chosen, tuple(a[chosen] for a in self.parts)

        return Near(*pieces, beams_of)

    def _reach(self, blocks: tuple[Array, ...], width: Numbers, cut: Numbers) -> Any:
        """Which beams come near which block: (g, K)."""
        _, weight, centre, radius = blocks
        gap = cone(centre[:, None], *(a[None, :-1] for a in self.parts[:5])) - radius[:, None]
        return (gap < cut * width) & (weight[:, :1] > 0)

    def _in_pieces(self, near: Array) -> tuple[Callable[[Any], Any], tuple[Any, int]]:
        """Of the near beams of each block (g, K), those of piece j as a function, and how many
        pieces there are and may be."""
        k = self.count
        piece = min(_PIECE.get(jax.default_backend(), _PIECE_ELSEWHERE), k)
        index = jnp.sort(jnp.where(near, jnp.arange(k, dtype=jnp.int32)[None], k), axis=1)
        index = jnp.pad(index, ((0, 0), (0, -k % piece)), constant_values=k)
        pieces = -(-near.sum(axis=1).max() // piece), index.shape[1] // piece
        return lambda j: jax.lax.dynamic_slice_in_dim(index, j * piece, piece, axis=1), pieces

    def pairs(self, points: Array, some: Any, width: Numbers) -> tuple[Any, ...]:
        """For g blocks of B points against c cones each, all (g, c, B): f / width, is f the side's
        (not the base's), distance along the axis, and 1 over the distance from the axis, 0 on it.
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
        """Gradient (g, c, columns) by apex and axis, where the sum over points grows by ``pull``
        (g, c, B) with each f.

        With v = p - apex and u = v less its part along the axis, f grows by ``across`` u +
        ``along`` axis per step of p.
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
        """Gradient by the apexes and by the axes (K, 3) from that by all columns (K, columns)."""
        return slope[:, :3], slope[:, 3:6]


def by_apex(pull: Array, slopes: tuple[Array, Array, Array], columns: int) -> Any:
    """Gradient (g, c, columns), of which the first three are by the apex: where the sum over points
    grows by ``pull`` (g, c, B) with what has these slopes (g, c, B) along x, y and z."""
    found = jnp.stack([(pull * slope).sum(axis=2) for slope in slopes], axis=2)
    return jnp.pad(found, ((0, 0), (0, 0), (0, columns - 3)))
