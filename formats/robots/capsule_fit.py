"""Capsules that contain a link's surface, which is cut along an axis into slabs, each enclosed in a
small capsule.

A capsule is convex, so one that contains the corners of a triangle contains the triangle. Triangles
are cut by the planes between slabs, and each slab's capsule contains the corners of the pieces.
Therefore the capsules together contain the whole surface and not only its vertices.
"""

import itertools
import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize
from scipy.spatial import ConvexHull, QhullError

from ...coverage.solids.capsules import Capsules
from .enclosing_circle import across, circle_centre

SLABS = 8  # slabs along an axis, between which capsules begin and end
WORTH = 0.05  # share of the volume that an additional capsule must save
_MOST = 2000  # most corners for which a capsule is optimised; it then grows to contain all
_FEW = 500  # of a slab with more than these, for which cuts are compared
_PRODUCTS = 2**22  # most distances at once, 32 MB
_AXES = 4  # most axes along which a link is cut
_GROW = 1 + 1e-7  # factor on a radius, against rounding


def _corners(points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "M 3"]:
    """Return the corners of the convex hull, or all points if they lie in a plane."""
    if len(points) < 8:
        return points
    points = np.unique(points, axis=0)  # a point is a corner of many triangles
    try:
        corners: np.ndarray = points[ConvexHull(points).vertices]
        return corners
    except QhullError:
        return points


def _thinned(points: Float[np.ndarray, "N 3"], few: int = _MOST) -> Float[np.ndarray, "M 3"]:
    """Return the points that lie farthest in ``few`` evenly spread directions; at most ``_MOST``
    points as they are."""
    if len(points) <= _MOST:
        return points
    i = np.arange(few) + 0.5
    z, turn = 1 - 2 * i / few, math.pi * (1 + math.sqrt(5)) * i
    around = np.sqrt(1 - z**2)
    towards = np.stack([around * np.cos(turn), around * np.sin(turn), z])
    parts = np.array_split(towards, 1 + few * len(points) // _PRODUCTS, axis=1)
    farthest = np.concatenate([(points @ part).argmax(axis=0) for part in parts])
    thinned: np.ndarray = points[np.unique(farthest)]
    return thinned


def _on_line(
    along: Float[np.ndarray, " N"], away: Float[np.ndarray, " N"], longer: float = 0.0
) -> tuple[float, float, float]:
    """Return the smallest capsule on a line that contains points: start, end and radius, m.

    Args:
        along: positions (N,) of the points along the line, m.
        away: distances (N,) from the line, m.
        longer: difference of the radius and the largest distance, m.
    """
    radius = float(away.max()) + longer
    half = np.sqrt(np.maximum(radius**2 - away**2, 0.0))
    low, high = float((along + half).min()), float((along - half).max())
    return (low, high, radius) if low <= high else ((low + high) / 2, (low + high) / 2, radius)


def _volume(low: float, high: float, radius: float) -> float:
    return math.pi * radius**2 * (high - low + 4 / 3 * radius)


def _starts(
    points: Float[np.ndarray, "N 3"], axes: Sequence[Float[np.ndarray, " 3"]]
) -> list[tuple[float, Float[np.ndarray, " 5"], Float[np.ndarray, " 3"]]]:
    """Return capsules about each axis that contain the points: volume, variables (lateral offset,
    lateral tilt, growth) and axis."""
    xy = points @ np.stack([across(axis).T for axis in axes])  # (A, N, 2)
    centre = circle_centre(xy)
    away = np.linalg.norm(xy - centre[:, None], axis=-1)
    return [
        (_volume(*_on_line(points @ axis, off)), np.array([*c, 0.0, 0.0, 0.0]), axis)
        for axis, off, c in zip(axes, away, centre, strict=True)
    ]


def _axes(points: Float[np.ndarray, "N 3"]) -> list[Float[np.ndarray, " 3"]]:
    centred = points - points.mean(axis=0)
    return (
        list(np.linalg.svd(centred, full_matrices=False)[2]) if len(points) > 2 else list(np.eye(3))
    )


def enclosing(
    points: Float[np.ndarray, "N 3"],
    axes: Sequence[Float[np.ndarray, " 3"]] = (),
    polish: bool = True,
) -> Capsules:
    """Return a small capsule that contains all points.

    For a given line (a direction and a lateral offset) and radius, the smallest capsule is known in
    closed form. Its volume is minimised over lines and radii by the Nelder-Mead simplex method,
    from the best of the given and the principal axes.

    Args:
        points: points (N, 3), m, at least one.
        axes: unit vectors (3,), starts besides the principal axes.
        polish: whether to optimise the line.
    """
    return _enclosing(_corners(points), axes, polish)


def _enclosing(
    corners: Float[np.ndarray, "N 3"], axes: Sequence[Float[np.ndarray, " 3"]], polish: bool
) -> Capsules:
    """See ``enclosing``; of points without those inside their hull."""
    few = _thinned(corners)
    origin = few.mean(axis=0)
    seen = few - origin
    scale = max(float(np.linalg.norm(seen, axis=1).max()), 1e-9)
    seen = seen / scale
    begun = _starts(seen, [*axes, *_axes(seen)])

    def line(
        x: Float[np.ndarray, " 5"],
        axis: Float[np.ndarray, " 3"],
        frame: Float[np.ndarray, "2 3"],
    ) -> tuple[np.ndarray, np.ndarray, tuple[float, float, float]]:
        through = x[:2] @ frame
        direction = axis + x[2:4] @ frame
        direction = direction / np.linalg.norm(direction)
        v = seen - through
        along = v @ direction
        away = np.sqrt(np.maximum((v * v).sum(axis=1) - along**2, 0.0))
        return through, direction, _on_line(along, away, abs(float(x[4])))

    best, x, axis = min(begun, key=lambda b: b[0])
    if polish:
        for _, x0, axis0 in sorted(begun, key=lambda b: b[0])[:2]:
            simplex = x0 + np.vstack([np.zeros(5), 0.05 * np.eye(5)])
            optimum = minimize(
                lambda x, axis, frame: _volume(*line(x, axis, frame)[2]),
                x0,
                (axis0, across(axis0)),
                method="Nelder-Mead",
                options={"initial_simplex": simplex, "maxfev": 600, "xatol": 1e-4, "fatol": 1e-5},
            )
            if optimum.fun < best:
                best, x, axis = float(optimum.fun), optimum.x, axis0
    through, direction, (low, high, radius) = line(x, axis, across(axis))
    ends = [origin + scale * (through + t * direction) for t in (low, high)]
    capsule = Capsules(ends[0], ends[1], scale * radius * _GROW)
    short = float(capsule.distance(corners).max())
    return capsule if short <= 0 else Capsules(ends[0], ends[1], capsule.radius + 1.01 * short)


def _cells(
    triangles: Float[np.ndarray, "T 3 3"], axis: Float[np.ndarray, " 3"], count: int
) -> list[Float[np.ndarray, "N 3"]]:
    """Return the corners (N, 3) m of the part of the surface in each of ``count`` even slabs across
    an axis.

    They are the corners of the triangles inside the slab and the points where edges cross its two
    planes.
    """
    along = triangles @ axis
    levels = np.linspace(along.min(), along.max(), count + 1)
    low, high = along.min(axis=1), along.max(axis=1)
    cells = []
    for a, b in itertools.pairwise(levels):
        here = (high >= a) & (low <= b)
        t, at = triangles[here], along[here]
        parts = [t[(at >= a) & (at <= b)]]
        for i, j in ((0, 1), (1, 2), (2, 0)):
            for level in (a, b):
                crossing = (at[:, i] - level) * (at[:, j] - level) < 0
                s = ((level - at[crossing, i]) / (at[crossing, j] - at[crossing, i]))[:, None]
                parts.append(t[crossing, i] * (1 - s) + t[crossing, j] * s)
        points = np.concatenate(parts)
        cells.append(_corners(points) if len(points) else points)
    return cells


def fit_capsules(
    triangles: Float[np.ndarray, "T 3 3"],
    axes: Sequence[Float[np.ndarray, " 3"]] = (),
    most: int = 3,
    slabs: int = SLABS,
) -> list[Capsules]:
    """Return a few capsules that together contain a surface.

    Along each candidate axis the surface is cut at ``slabs - 1`` evenly spaced planes. Dynamic
    programming finds, for each number of capsules, the cuts with the least sum of volumes. An
    additional capsule must save ``WORTH`` of the volume. The capsules of the best cuts are then
    optimised one by one.

    Args:
        triangles: corners (T, 3, 3) of the surface's triangles, m, at least one.
        axes: unit vectors (3,), directions of cuts besides the principal axes.
        most: largest number of capsules.
        slabs: slabs along an axis, at least ``most``.

    Returns:
        The capsules, in order along the axis of the cuts.
    """
    points = triangles.reshape(-1, 3)
    candidates: list[Float[np.ndarray, " 3"]] = []
    for axis in [*axes, *_axes(_corners(points))]:
        if all(abs(float(axis @ other)) < 0.99 for other in candidates):
            candidates.append(axis)
    best: list[Float[np.ndarray, "N 3"]] = [_corners(points)]
    one = enclosing(best[0], candidates)
    least = one.volume
    for axis in candidates[:_AXES] if most > 1 else ():
        if float(np.ptp(triangles @ axis)) < 1e-6:
            continue
        for value, parts in _cut_best(triangles, axis, candidates, most, slabs):
            if value < least * (1 - WORTH) ** (len(parts) - len(best)):
                least, best = value, parts
    return [enclosing(part, candidates) for part in best] if len(best) > 1 else [one]


def _cut_best(
    triangles: Float[np.ndarray, "T 3 3"],
    axis: Float[np.ndarray, " 3"],
    candidates: Sequence[Float[np.ndarray, " 3"]],
    most: int,
    slabs: int,
) -> list[tuple[float, list[Float[np.ndarray, "N 3"]]]]:
    """Return, for 2 to ``most`` capsules, the least sum of volumes, m^3, of cuts across ``axis``,
    and the corners of the surface's parts."""
    whole = _cells(triangles, axis, slabs)
    cells, many = [_thinned(cell, _FEW) for cell in whole], any(len(cell) > _MOST for cell in whole)
    parts: dict[tuple[int, int], Float[np.ndarray, "N 3"]] = {}
    cost: dict[tuple[int, int], float] = {}
    for i, j in itertools.combinations(range(slabs + 1), 2):
        # the corners of the whole are corners of its parts
        part = np.concatenate([parts[i, j - 1], cells[j - 1]]) if j > i + 1 else cells[i]
        corners = _corners(part) if len(part) else part
        many |= len(corners) > _MOST
        parts[i, j] = _thinned(corners, _FEW)
        cost[i, j] = _enclosing(parts[i, j], candidates, False).volume if len(part) else 0.0
    path: dict[tuple[int, int], tuple[float, list[tuple[int, int]]]] = {(0, 0): (0.0, [])}
    for k in range(1, most + 1):
        for j in range(k, slabs + 1):
            options = [(path[k - 1, i][0] + cost[i, j], i) for i in range(j) if (k - 1, i) in path]
            if options:
                value, i = min(options)
                path[k, j] = (value, [*path[k - 1, i][1], (i, j)])
    if many:  # the capsules contain all corners, not only those for which cuts were compared
        parts = {cut: np.concatenate(whole[cut[0] : cut[1]]) for cut in parts}
    best = [path[k, slabs] for k in range(2, most + 1)]
    return [(value, [parts[cut] for cut in cuts if len(parts[cut])]) for value, cuts in best]


def union_volume(capsules: Sequence[Capsules], points: int = 200_000) -> float:
    """Return the volume of the capsules' union, m^3, from points of a lattice in their bounding
    box, accurate to about one percent."""
    reach = np.array(
        [
            [c.start - c.radius, c.end - c.radius, c.start + c.radius, c.end + c.radius]
            for c in capsules
        ]
    )
    low, high = reach.reshape(-1, 3).min(axis=0), reach.reshape(-1, 3).max(axis=0)
    i = np.arange(points)[:, None] + 0.5
    # the plastic ratio's analogue in three dimensions: an even spread of points
    g = 1.22074408460575947536
    p = low + np.mod(i * g ** -np.arange(1.0, 4.0), 1.0) * (high - low)
    inside = np.zeros(points, bool)
    for c in capsules:
        inside |= c.distance(p) <= 0
    return float(np.prod(high - low) * inside.mean())
