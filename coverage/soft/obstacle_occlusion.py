"""Occlusion of beams by a cell's obstacles, for the soft estimator.

Convex polyhedra cast shadows with plane sides. When the apex moves, the faces stay, and a plane
through the apex and an edge rotates about the edge. Its value at a point changes by its normal
times the ratio of the point's to the apex's distance from the edge, in the plane. Inside an
obstacle a sensor sees nothing, and the gradient contains no direction out of it.
"""

from typing import Any

import jax.numpy as jnp

from ..arrays import Array, Index, Numbers, dot
from ..solids.polyhedra import NOWHERE, Polyhedron, polyhedron_shadow
from .cones import Near, SoftBeams, by_apex


def _turns(apex: Array, body: Polyhedron) -> tuple[Any, Any]:
    """Return how the planes of ``polyhedron_shadow`` rotate when the apex moves.

    The result are vectors w (K, M, 3) 1/m and numbers c (K, M). For each metre that the apex moves,
    the value of a plane of normal n at a point p decreases by (w . p - c) n.
    """
    start, end = body.edges[None, :, 0], body.edges[None, :, 1]
    v, along = apex[:, None] - start, end - start
    v = v - (dot(v, along) / dot(along, along))[..., None] * along
    square = dot(v, v)
    w = jnp.where((square > 0)[..., None], v / jnp.where(square > 0, square, 1.0)[..., None], 0.0)
    faces = len(body.offset)
    return jnp.pad(w, ((0, 0), (faces, 0), (0, 0))), jnp.pad(dot(w, start), ((0, 0), (faces, 0)))


class CellBeams(SoftBeams):
    """Inner beams less the obstacles' shadows; see ``SoftBeams``.

    ``shadowed`` (K,) states which beams have shadows; None: all of them.
    """

    def __init__(
        self, inner: SoftBeams, obstacles: tuple[Polyhedron, ...], shadowed: Array | None = None
    ) -> None:
        self._inner = inner
        self.cones, self.count, self.columns = inner.cones, inner.count, inner.columns
        apex, self._planes = self.cones.apex, []
        for body in obstacles:
            normal, offset = polyhedron_shadow(apex, body)
            if shadowed is not None:
                normal = jnp.where(shadowed[:, None, None], normal, 0.0)
                offset = jnp.where(shadowed[:, None], offset, -NOWHERE)
            # The padding beam sees nothing in any case: its planes have normals of 0.
            some = (normal, 0.0), (offset, -1.0), *((a, 0.0) for a in _turns(apex, body))
            self._planes.append(
                tuple(
                    jnp.pad(a, ((0, 1), *((0, 0),) * (a.ndim - 1)), constant_values=none)
                    for a, none in some
                )
            )

    def near(self, blocks: tuple[Array, ...], width: Numbers, cut: Numbers) -> Near:
        """See ``SoftBeams``."""
        inner = self._inner.near(blocks, width, cut)

        def beams_of(j: Index) -> tuple[Any, tuple[Any, ...]]:
            chosen, some = inner.beams_of(j)
            return chosen, (
                *some[:1],
                tuple(tuple(a[chosen] for a in planes) for planes in self._planes),
                some,
            )

        return Near(inner.pieces, inner.most, beams_of)

    def pairs(self, points: Array, some: Any, width: Numbers) -> tuple[Any, ...]:
        """Evaluate as ``SoftBeams`` does; also return where an obstacle occludes, and its slopes.

        The slopes are by the apex.
        """
        _, obstacles, inner = some
        t, *geometry = self._inner.pairs(points, inner, width)
        most, slopes = jnp.full_like(t, -jnp.inf), [jnp.zeros_like(t)] * 3
        for planes in obstacles:
            value, *turned = _largest(points, *planes)
            slopes = [
                jnp.where(-value > most, new, old) for new, old in zip(turned, slopes, strict=True)
            ]
            most = jnp.maximum(most, -value)
        hidden = most / width
        return jnp.maximum(t, hidden), *geometry, hidden > t, *slopes

    def slopes(self, points: Array, some: Any, pull: Array, *geometry: Array) -> Any:
        """See ``SoftBeams``."""
        *of_inner, hidden, x, y, z = geometry
        gradient = self._inner.slopes(points, some[2], jnp.where(hidden, 0, pull), *of_inner)
        return gradient + by_apex(jnp.where(hidden, pull, 0), (x, y, z), gradient.shape[2])

    def pulled_back(self, slope: Array) -> tuple[Any, ...]:
        """See ``SoftBeams``."""
        return self._inner.pulled_back(slope)


def _largest(points: Array, normal: Array, offset: Array, w: Array, c: Array) -> tuple[Any, ...]:
    """Return the maximum (g, c, B) m of planes at points (g, B, 3), and its decrease.

    The decrease is that for each metre that the apex moves along x, y and z.
    """
    p = points[:, None]
    value, x, y, z, turn = (
        jnp.full((*offset.shape[:2], points.shape[1]), a, points.dtype)
        for a in (-jnp.inf, 0, 0, 0, 0)
    )
    for i in range(offset.shape[2]):
        n, along = normal[:, :, None, i], w[:, :, None, i]
        plane = dot(p, n) - offset[:, :, None, i]
        more = plane > value
        value = jnp.maximum(value, plane)
        turn = jnp.where(more, dot(p, along) - c[:, :, None, i], turn)
        x, y, z = (jnp.where(more, n[..., k], old) for k, old in enumerate((x, y, z)))
    return value, turn * x, turn * y, turn * z
