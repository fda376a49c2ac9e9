"""The part of space that is connected to the robot past the obstacles, in cubes of a lattice.

The free space is a box around target and robot, less the cubes whose centre lies in an obstacle.
Reachable are the free cubes that are connected to the robot's curve, face by face. A cube at the
surface of an obstacle, whose centre is blocked, belongs to the reachable side if it touches a
reachable cube and no other free one.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int

from .cube_region import CubeRegion
from .solids.polyhedra import Polyhedron, largest

SIDE = 0.02  # m, of a cube
_MOST = 2e7  # cubes; of a larger box the cubes are larger
_BETWEEN = 10  # points on the robot's curve for each cube that it crosses, at least

Plane = tuple[bytes, bytes, bytes]
"""Normals, offsets and edges of a polyhedron."""


def reachable(
    obstacles: tuple[Polyhedron, ...],
    curve: Float[np.ndarray, "D 3"],
    box: Float[np.ndarray, "2 3"],
) -> CubeRegion:
    """Return the part of a box that is connected to the robot.

    Args:
        obstacles: convex bodies, base frame.
        curve: points (D, 3) m of a polyline through the robot.
        box: lower and upper corner (2, 3) m of the box.

    Raises:
        ValueError: if the robot's curve lies in obstacles.
    """
    keys = tuple(
        (
            np.ascontiguousarray(b.normal, float).tobytes(),
            np.ascontiguousarray(b.offset, float).tobytes(),
            np.ascontiguousarray(b.edges, float).tobytes(),
        )
        for b in obstacles
    )
    return _region(keys, curve.astype(float).tobytes(), box.astype(float).tobytes())


@lru_cache(8)
def _region(planes: tuple[Plane, ...], points: bytes, corners: bytes) -> CubeRegion:
    from scipy.ndimage import binary_dilation, label

    box, curve = (np.frombuffer(data).reshape(-1, 3) for data in (corners, points))
    side = max(SIDE, float((np.ptp(box, axis=0).prod() / _MOST) ** (1 / 3)))
    lowest = np.floor(box[0] / side).astype(np.int64) - 1
    shape = np.ceil(box[1] / side).astype(np.int64) + 1 - lowest
    free = np.ones(tuple(shape), bool)
    for plane in planes:
        _block(free, plane, lowest, side)
    number, _ = label(free)
    crossed = np.floor(_dense(curve, side) / side).astype(np.int64) - lowest
    x, y, z = np.clip(crossed, 0, shape - 1).T
    mine = np.unique(number[x, y, z])
    mine = mine[mine > 0]
    if len(mine) == 0:
        raise ValueError("no place is reachable: obstacles enclose the whole robot")
    inside = np.isin(number, mine)
    around = np.ones((3, 3, 3), bool)
    apart = free & ~inside
    if apart.any():
        edge = ~free & binary_dilation(inside, around) & ~binary_dilation(apart, around)
        inside |= edge
    else:
        inside[...] = True  # obstacles enclose nothing
    return CubeRegion(inside, lowest, side)


def _block(free: Bool[np.ndarray, "X Y Z"], plane: Plane, lowest: np.ndarray, side: float) -> None:
    """Mark the cubes whose centre lies in a polyhedron as not free."""
    normal, offset = (np.frombuffer(data) for data in plane[:2])
    normal, edges = normal.reshape(-1, 3), np.frombuffer(plane[2]).reshape(-1, 3)
    first, last = np.zeros(3, np.int64), np.array(free.shape)
    if len(edges):
        ends = np.stack([edges.min(axis=0), edges.max(axis=0)])
        first = np.clip(np.floor(ends[0] / side).astype(np.int64) - lowest, 0, last)
        last = np.clip(np.ceil(ends[1] / side).astype(np.int64) + 1 - lowest, first, last)
    axes = [
        (np.arange(a, b) + lowest[i] + 0.5) * side for i, (a, b) in enumerate(_ends(first, last))
    ]
    for i, x in enumerate(axes[0]):  # slice by slice, so that memory stays small
        points = np.stack(np.broadcast_arrays(x, axes[1][:, None], axes[2][None]), axis=-1)
        within = largest(points, normal, offset) <= 0
        free[first[0] + i, first[1] : last[1], first[2] : last[2]] &= ~within


def _ends(first: Int[np.ndarray, " 3"], last: Int[np.ndarray, " 3"]) -> list[tuple[int, int]]:
    return list(zip(first.tolist(), last.tolist(), strict=True))


def _dense(curve: Float[np.ndarray, "D 3"], side: float) -> Float[np.ndarray, "N 3"]:
    """Return points on a polyline that are closer to each other than a tenth of a cube."""
    length = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(length)])
    at = np.linspace(0, along[-1], 2 + int(_BETWEEN * along[-1] / side))
    return np.stack([np.interp(at, along, axis) for axis in curve.T], axis=1)
