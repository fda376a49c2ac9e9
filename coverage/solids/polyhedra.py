"""Convex polyhedra: the obstacles of a cell, and the shadows behind them.

A convex polyhedron is the intersection of half-spaces. Its implicit function is the maximum of
plane functions with unit normals: 1-Lipschitz, convex and without curvature. Its shadow from an
apex outside (see ``shadows``) is again a convex polyhedron. It is bounded by the half-spaces of the
faces that face the apex, and by the planes through the apex and each silhouette edge, between a
face that faces the apex and one that does not.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array, Index, Vector, dot, namespace
from ..definitions.equality import equal_fields
from ..pytrees import tree
from .base import CubePairs
from .tangent_bounds import TangentParts, under_planes
from .volume_fraction import VolumeFraction

_DIGITS = 7  # decimals of normals: faces of a hull that agree to these are merged
MOST_FACES = 2000  # of a solid in a scene; each adds a plane to the occlusion test
_PRODUCTS = 2**24  # most distances of corners from planes at once, 128 MB
NOWHERE = 1e9  # m, offset at which a plane function of normal 0 is never the maximum


@tree
@dataclass(frozen=True)
class Polyhedron:
    """The points p with ``normal . p <= offset`` for all F faces.

    A half-space has one face and no edge.
    """

    normal: Float[Array, "F 3"]
    """Unit normals of the faces."""
    offset: Float[Array, " F"]
    """Offsets of the faces, m."""
    edges: Float[Array, "E 2 3"]
    """Ends of the edges, m."""
    faces: Int[Array, "E 2"]
    """The two faces that meet at each edge."""

    __eq__ = equal_fields

    def __call__(self, points: Float[Array, "*batch 3"]) -> Float[Array, "*batch"]:
        """Return the implicit function (...) m: at most 0 inside, 1-Lipschitz."""
        each = dot(points[..., None, :], self.normal) - self.offset
        farthest: Array = each.max(axis=-1)
        return farthest


def half_space(height: float) -> Polyhedron:
    """Return the half-space z <= ``height`` m: the floor."""
    none = np.zeros((0, 2))
    return Polyhedron(
        np.array([[0.0, 0, 1]]), np.array([height]), np.zeros((0, 2, 3)), none.astype(int)
    )


def box(centre: Vector, size: Vector, rotation: np.ndarray | None = None) -> Polyhedron:
    """Return a box.

    Args:
        centre: (3,) m.
        size: sides (3,) m along the columns of ``rotation``.
        rotation: (3, 3); None: the identity.

    Raises:
        ValueError: if a side is not positive.
    """
    centre, half = np.asarray(centre, float), np.asarray(size, float) / 2
    if not (half > 0).all():
        raise ValueError(f"the sides of a box must be positive, got {tuple(2 * half)}")
    rotation = np.eye(3) if rotation is None else np.asarray(rotation, float)
    normal = np.concatenate([rotation.T, -rotation.T])
    offset = normal @ centre + np.tile(half, 2)
    edges, faces = [], []
    for axis in range(3):
        j, k = (axis + 1) % 3, (axis + 2) % 3
        for second, third in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            ends = np.zeros((2, 3))
            ends[:, j], ends[:, k] = second * half[j], third * half[k]
            ends[:, axis] = -half[axis], half[axis]
            edges.append([centre + rotation @ end for end in ends])
            faces.append([j + 3 * (second < 0), k + 3 * (third < 0)])
    return Polyhedron(normal, offset, np.array(edges), np.array(faces))


def hull(points: Float[np.ndarray, "N 3"], most: int | None = None) -> Polyhedron:
    """Return the convex hull of points (N, 3) m; coplanar triangles are merged into one face.

    Args:
        points: the points.
        most: largest number of faces; None: any.

    Raises:
        ValueError: if the points span no volume, or the hull has more faces.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        convex = ConvexHull(points)
    except (QhullError, ValueError) as error:
        raise ValueError(
            "the points span no volume; a hull needs 4 that are not coplanar"
        ) from error
    planes, face = np.unique(np.round(convex.equations, _DIGITS), axis=0, return_inverse=True)
    if most is not None and len(planes) > most:
        raise ValueError(f"the hull has {len(planes)} faces, allowed: at most {most}; simplify it")
    normal = planes[:, :3]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    corners = points[convex.vertices]
    # rounding must not exclude a corner
    parts = np.array_split(normal, 1 + len(normal) * len(corners) // _PRODUCTS)
    offset = np.concatenate([(corners @ part.T).max(axis=0) for part in parts])
    meet: dict[tuple[int, int], list[int]] = {}
    for triangle, of in zip(convex.simplices, face.reshape(-1), strict=True):
        for a, b in ((0, 1), (1, 2), (2, 0)):
            first, last = sorted((triangle[a], triangle[b]))
            meet.setdefault((first, last), []).append(int(of))
    edges = [(pair, of) for pair, of in meet.items() if of[0] != of[1]]
    return Polyhedron(
        normal,
        offset,
        points[[pair for pair, _ in edges]].reshape(-1, 2, 3),
        np.array([of for _, of in edges]),
    )


def box_of(
    body: Polyhedron,
) -> tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, " 3"]] | None:
    """Return the pose (4, 4) m of a box's centre and the sizes (3,) m along its axes; None if the
    polyhedron is no box with its faces in the order of ``box``."""
    if body.normal.shape != (6, 3):
        return None
    R = np.asarray(body.normal[:3]).T
    if not np.allclose(R.T @ R, np.eye(3), atol=1e-9) or np.linalg.det(R) < 0:
        return None
    if not np.allclose(body.normal[3:], -R.T, atol=1e-9):
        return None
    T = np.eye(4)
    T[:3, :3] = R
    T[:3, 3] = R @ ((body.offset[:3] - body.offset[3:]) / 2)
    return T, np.asarray(body.offset[:3] + body.offset[3:])


def placed(body: Polyhedron, T: Float[np.ndarray, "4 4"]) -> Polyhedron:
    """Return ``body`` in the frame in which its own frame has the pose ``T`` (4, 4) m."""
    normal = body.normal @ T[:3, :3].T
    edges = body.edges @ T[:3, :3].T + T[:3, 3]
    return Polyhedron(normal, body.offset + normal @ T[:3, 3], edges, body.faces)


def polyhedron_shadow(
    apex: Float[Array, "K 3"], body: Polyhedron
) -> tuple[Float[Array, "K M 3"], Float[Array, "K M"]]:
    """Return the shadow of ``body`` from each of K apexes (K, 3) m outside of it.

    The result are normals (K, M, 3) and offsets (K, M) m of planes, as in ``Polyhedron``. Faces and
    edges that do not bound the shadow have the normal 0 and are never the maximum.

    M is the number of faces and edges. An edge's plane bounds the shadow if exactly one of its
    faces faces the apex.
    """
    xp = namespace(apex)
    looks = dot(apex[:, None], body.normal[None]) > body.offset[None]
    normal = xp.where(looks[..., None], body.normal[None], 0.0)
    offset = xp.where(looks, body.offset[None], NOWHERE)
    if len(body.edges) == 0:
        return normal, offset
    first, second = looks[:, body.faces[:, 0]], looks[:, body.faces[:, 1]]
    rim = first != second
    a, b = body.edges[None, :, 0], body.edges[None, :, 1]
    n = xp.cross(a - apex[:, None], b - apex[:, None])
    length = xp.sqrt(xp.where(rim, dot(n, n), 1.0))
    rim = rim & (length > 0)
    n = xp.where(rim[..., None], n, 0.0) / xp.where(rim, length, 1.0)[..., None]
    # Outward is away from the body: the normals of both faces together point that way.
    outward = body.normal[body.faces[:, 0]] + body.normal[body.faces[:, 1]]
    n = n * xp.where(dot(n, outward[None]) >= 0, 1.0, -1.0)[..., None]
    return (
        xp.concatenate([normal, n], axis=1),
        xp.concatenate([offset, xp.where(rim, dot(n, apex[:, None]), NOWHERE)], axis=1),
    )


def largest(points: Array, normal: Array, offset: Array) -> Any:
    """Return the maximum plane function (...) m at ``points`` (..., 3) m.

    The planes are normals (..., M, 3) and offsets (..., M) m; shapes broadcast.
    """
    xp = namespace(points)
    value = dot(points, normal[..., 0, :]) - offset[..., 0]
    for i in range(1, normal.shape[-2]):
        value = xp.maximum(value, dot(points, normal[..., i, :]) - offset[..., i])
    return value


def crossing(height: Array, slope: Array, end: Any, axis: int = -1) -> tuple[Any, Any]:
    """Return the places on lines, from 0 to ``end``, between which they run through polyhedra.

    The first exceeds the second where a line misses the body.

    Args:
        height: heights above the planes of a body, which lie along ``axis``, at the place 0, m.
        slope: their growth with the place.
        end: the last place.
        axis: axis of the planes.
    """
    xp = namespace(height)
    flat = xp.abs(slope) < 1e6 * xp.finfo(slope.dtype).tiny  # parallel: the quotient overflows
    place = -height / xp.where(flat, 1.0, slope)
    beside = flat & (height > 0)
    enter = xp.where((slope < 0) & ~flat, place, 0.0).max(axis=axis)
    leave = xp.where(beside, -xp.inf, xp.where((slope > 0) & ~flat, place, end)).min(axis=axis)
    return xp.maximum(enter, 0.0), xp.minimum(leave, end)


def crossed(a: Array, b: Array, normal: Array, offset: Array) -> Any:
    """Return whether segments ``a``-``b`` (..., 3) m intersect polyhedra, of planes (..., M, 3) and
    (..., M); shapes broadcast."""
    first, last = (dot(p[..., None, :], normal) - offset for p in (a, b))
    enter, leave = crossing(first, last - first, 1.0)
    return enter <= leave


@tree
@dataclass(frozen=True)
class Polyhedra(TangentParts):
    """A union of K convex polyhedra."""

    normal: Float[Array, "K M 3"]
    """Normals of the planes, padded with zero normals that never bound a body."""
    offset: Float[Array, "K M"]
    """Offsets of the planes, m."""
    box: Float[Array, "2 3"]
    """Box that contains all evaluated points, m; bodies such as a floor are unbounded."""

    __eq__ = equal_fields

    def __len__(self) -> int:
        return len(self.offset)

    def part(self, points: Array, index: Index) -> Any:
        return largest(points, self.normal[index], self.offset[index])

    def each_share(self, pairs: CubePairs) -> tuple[VolumeFraction, Any, Any]:
        """See ``TangentParts.each_share``; each face is a plane."""
        normal, offset = np.asarray(self.normal)[pairs.part], np.asarray(self.offset)[pairs.part]
        return under_planes(dot(pairs.points[:, None], normal) - offset, normal, pairs)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        return np.asarray(self.box)


def polyhedra(bodies: tuple[Polyhedron, ...], box: Float[np.ndarray, "2 3"]) -> Polyhedra:
    """Return the union of ``bodies``, to be evaluated inside ``box`` (2, 3) m only."""
    most = max((len(b.offset) for b in bodies), default=1)
    normal, offset = np.zeros((len(bodies), most, 3)), np.full((len(bodies), most), NOWHERE)
    for i, b in enumerate(bodies):
        normal[i, : len(b.offset)], offset[i, : len(b.offset)] = b.normal, b.offset
    return Polyhedra(normal, offset, box)
