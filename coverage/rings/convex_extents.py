"""Extents along the mount axis of convex bodies within a cylinder about it.

The point of a convex body that is furthest along the axis within a cylinder is a corner of the
body, a point at which an edge passes the cylinder, or the furthest point of a face's ellipse on the
cylinder. For bodies of few faces all such points are computed; those that a face excludes are
dropped. Bodies of many faces are left to linear programmes, in which a polygon contains the disc of
the cylinder. Up to rounding, every result errs on the safe side.
"""

import itertools
import math

import numpy as np
from jaxtyping import Bool, Float

from ..solids.polyhedra import NOWHERE

_SIDES = 64  # of the polygon around a disc; it exceeds the disc by 0.12 % of the radius
_FEW = 12  # largest number of faces for which all points are computed
_CHUNK = 256  # bodies that are evaluated at once
_ROUNDING = 1e-6  # m, by which a point may lie beyond a face
_PARALLEL = 1e-10  # least determinant of three normals, and square of a sine, that is solved
Extents = tuple[Float[np.ndarray, " P"], Float[np.ndarray, " P"]]


def extents(
    normal: Float[np.ndarray, "P M 3"],
    offset: Float[np.ndarray, "P M"],
    outer: float,
    within: tuple[float, float],
) -> Extents:
    """Return the least and largest first coordinate (P,) of each body in a cylinder.

    Where body and cylinder do not meet, the least is infinite.

    Args:
        normal: outward unit normals (P, M, 3) of the faces, in axis coordinates.
        offset: offsets (P, M) of the faces, m; of ``NOWHERE`` where a body has fewer.
        outer: radius of the cylinder, m.
        within: ends of the cylinder along its axis, m.
    """
    low, high = np.full(len(normal), np.inf), np.full(len(normal), -np.inf)
    real = offset < NOWHERE / 2
    faces, near = real.sum(axis=1), _near(normal, offset, outer, within)
    for count in np.unique(faces[near]).tolist():
        some = np.flatnonzero(near & (faces == count))
        for which in np.array_split(some, math.ceil(len(some) / _CHUNK)):
            n = normal[which][real[which]].reshape(len(which), count, 3)
            o = offset[which][real[which]].reshape(len(which), count)
            if count <= _FEW:
                low[which], high[which] = _of_points(n, o, outer, within)
            else:
                each = [_programmed(*body, outer, within) for body in zip(n, o, strict=True)]
                low[which], high[which] = np.array(each).T
    return low, high


def _near(
    normal: Float[np.ndarray, "P M 3"],
    offset: Float[np.ndarray, "P M"],
    outer: float,
    within: tuple[float, float],
) -> Bool[np.ndarray, " P"]:
    """Return where no face separates a body from the cylinder."""
    along = np.minimum(normal[..., 0] * within[0], normal[..., 0] * within[1])
    least = along - outer * np.hypot(normal[..., 1], normal[..., 2])
    near: np.ndarray = np.all(least <= offset + _ROUNDING, axis=1)
    return near


def _of_points(
    normal: Float[np.ndarray, "P M 3"],
    offset: Float[np.ndarray, "P M"],
    outer: float,
    within: tuple[float, float],
) -> Extents:
    """Return the extents as those of all points that may be the furthest."""
    caps = np.broadcast_to([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], (len(normal), 2, 3))
    n = np.concatenate([normal, caps], axis=1)
    o = np.concatenate([offset, np.tile([within[1], -within[0]], (len(offset), 1))], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        points = [_corners(n, o), *_passes(n, o, outer), *_ellipses(n, o, outer)]
    p = np.concatenate(points, axis=1)
    # a point that does not exist is not a number, and no comparison with it holds
    inside = np.all(np.einsum("pkj,pmj->pkm", p, n) <= o[:, None] + _ROUNDING, axis=2)
    inside &= np.hypot(p[..., 1], p[..., 2]) <= outer + _ROUNDING
    x = p[..., 0]
    return np.where(inside, x, np.inf).min(axis=1), np.where(inside, x, -np.inf).max(axis=1)


def _corners(
    n: Float[np.ndarray, "P K 3"], o: Float[np.ndarray, "P K"]
) -> Float[np.ndarray, "P T 3"]:
    """Return the points common to three planes."""
    i, j, k = np.array(list(itertools.combinations(range(n.shape[1]), 3))).T
    a, b, c = (np.cross(n[:, u], n[:, v]) for u, v in ((j, k), (k, i), (i, j)))
    volume = np.sum(n[:, i] * a, axis=-1)[..., None]
    points = o[:, i, None] * a + o[:, j, None] * b + o[:, k, None] * c
    corners: np.ndarray = points / np.where(np.abs(volume) > _PARALLEL, volume, np.nan)
    return corners


def _passes(
    n: Float[np.ndarray, "P K 3"], o: Float[np.ndarray, "P K"], outer: float
) -> list[Float[np.ndarray, "P E 3"]]:
    """Return the points at which the line common to two planes passes the cylinder."""
    i, j = np.array(list(itertools.combinations(range(n.shape[1]), 2))).T
    d = np.cross(n[:, i], n[:, j])
    square = np.sum(d * d, axis=-1)[..., None]
    square = np.where(square > _PARALLEL, square, np.nan)
    start = o[:, i, None] * np.cross(n[:, j], d) + o[:, j, None] * np.cross(d, n[:, i])
    start, d = start / square, d / np.sqrt(square)
    a, b = (np.sum(d[..., 1:] * v[..., 1:], axis=-1) for v in (d, start))
    root = np.sqrt(b * b - a * (np.sum(start[..., 1:] ** 2, axis=-1) - outer**2))
    return [start + ((sign * root - b) / a)[..., None] * d for sign in (-1, 1)]


def _ellipses(
    n: Float[np.ndarray, "P K 3"], o: Float[np.ndarray, "P K"], outer: float
) -> list[Float[np.ndarray, "P K 3"]]:
    """Return the points of each plane that are furthest along the axis on the cylinder; the plane's
    point on the axis where it is perpendicular to it."""
    steep = np.hypot(n[..., 1], n[..., 2])[..., None]
    points = []
    for sign in (-1.0, 1.0):
        across = np.where(steep > _PARALLEL, sign * outer * n[..., 1:] / steep, 0.0)
        along = (o - np.sum(n[..., 1:] * across, axis=-1)) / n[..., 0]
        points.append(np.concatenate([along[..., None], across], axis=-1))
    return points


def _programmed(
    normal: Float[np.ndarray, "M 3"],
    offset: Float[np.ndarray, " M"],
    outer: float,
    within: tuple[float, float],
) -> tuple[float, float]:
    """Return the extents of one body by two linear programmes."""
    from scipy.optimize import linprog

    angle = 2 * math.pi * np.arange(_SIDES) / _SIDES
    sides = np.stack([np.zeros(_SIDES), np.cos(angle), np.sin(angle)], axis=1)
    faces = np.concatenate([normal, sides])
    limits = np.concatenate([offset, np.full(_SIDES, outer)])
    box = [within, (None, None), (None, None)]
    ends = []
    for sign in (1.0, -1.0):
        least = linprog([sign, 0.0, 0.0], A_ub=faces, b_ub=limits, bounds=box)
        if least.status == 2:  # no point satisfies all constraints
            return math.inf, -math.inf
        if not least.success:
            return within
        ends.append(sign * float(least.fun))
    return ends[0], ends[1]
