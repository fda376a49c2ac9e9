"""Areas of a floor, as polygons: which places lie in them, and their shares of the cells of a
grid."""

import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from .definitions.field_types import Coordinate, Items, Pair
from .solids.segments import point_to_segment

Polygon = Annotated[Items[Pair[Coordinate]], Field(min_length=3, max_length=1000)]
Polygons = Sequence[Sequence[Sequence[float]]]
_FINE = 4  # sample points along each side of a cell
_CHUNK = 2**18  # points at once


def in_areas(
    x: Float[np.ndarray, " N"], y: Float[np.ndarray, " N"], areas: Polygons, near: float = 0.0
) -> Bool[np.ndarray, " N"]:
    """Return which places lie in an area or at most ``near`` m beside it."""
    flat, result = np.stack([x, y, np.zeros(len(x))], axis=1), np.zeros(len(x), bool)
    for area in areas:
        odd = np.zeros(len(x), bool)
        for (ax, ay), (bx, by) in zip(area, (*area[1:], area[0]), strict=True):
            if ay != by:
                odd ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) / (by - ay) * (bx - ax))
            if near > 0:
                a, b = np.array([ax, ay, 0.0]), np.array([bx, by, 0.0])
                result |= point_to_segment(flat, a, b) <= near
        result |= odd
    return result


def area_shares(
    areas: Polygons, side: float, most: int
) -> tuple[Float[np.ndarray, "X Y"], tuple[float, float], tuple[float, float]]:
    """Return the share of each cell of a grid that lies in the areas, by sample points.

    Args:
        areas: polygons of corners (x, y), m.
        side: length of a cell that is wanted, m; of large areas cells are longer.
        most: largest number of cells.

    Returns:
        The shares (X, Y), the lower corner (x, y) of the grid, and the sides (x, y) of a cell, m.
    """
    corners = np.concatenate([np.asarray(area, float) for area in areas])
    low, extent = corners.min(axis=0), np.maximum(np.ptp(corners, axis=0), 1e-6)
    side = max(side, math.sqrt(float(extent.prod()) / most), float(extent.max()) / most)
    count = np.maximum(np.floor(extent / side + 1e-9).astype(int), 1)
    step = extent / count / _FINE
    xs, ys = (low[i] + step[i] * (np.arange(count[i] * _FINE) + 0.5) for i in (0, 1))
    rows = max(_CHUNK // len(ys), 1)
    inside = np.concatenate(
        [
            in_areas(np.repeat(part, len(ys)), np.tile(ys, len(part)), areas)
            for part in np.array_split(xs, -(-len(xs) // rows))
        ]
    )
    shares = inside.reshape(count[0], _FINE, count[1], _FINE).mean(axis=(1, 3))
    (x, y), (a, b) = low.tolist(), (step * _FINE).tolist()
    return shares, (x, y), (a, b)
