"""Voxels on a ``Canvas``: the exposed faces of a set of voxels that face an eye at infinity.

An eye at infinity sees at most three faces of a cube, the same three for every voxel. Of those,
only faces without a neighbouring voxel are exposed.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.solids.base import Solid
from ...coverage.voxels.voxel_set import OFFSET, VoxelSet, encode
from .canvas import Canvas
from .meshes import loops

# Corners of the faces towards +x, +y and +z, in voxels from the lowest corner, in order around
# the face.
_FACE = np.array(
    [
        [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)],
        [(0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)],
        [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
    ]
)
_OVER = 0.02  # sides of a voxel by which edges are drawn in front of faces
_FLAT = 1e-9  # a face whose visible share is below this is seen edge-on, up to rounding


@dataclass(frozen=True)
class VoxelSkin:
    """The voxels of a set with a face towards the eye."""

    voxel: float
    """Side of a voxel, m."""
    numbers: Int[np.ndarray, "N 3"]
    """Lattice numbers; a voxel lies between k and k + 1 sides."""
    side: Int[np.ndarray, " 3"]
    """The face across each axis that faces the eye, +1 or -1; 0 if neither does."""
    exposed: Bool[np.ndarray, "N 3"]
    """True for each face that has no neighbouring voxel."""

    @property
    def faces(self) -> int:
        """Number of faces to draw."""
        return int(np.count_nonzero(self.exposed))

    @property
    def centres(self) -> Float[np.ndarray, "N 3"]:
        """Centres (N, 3) m of the voxels."""
        return (self.numbers + 0.5) * self.voxel


def voxel_set(voxel: float, numbers: Int[np.ndarray, "N 3"]) -> VoxelSet:
    """Return the set of voxels with given lattice numbers.

    Args:
        voxel: side of a voxel, m.
        numbers: lattice numbers (N, 3), in any order; duplicates are allowed.
    """
    key = np.unique(encode(numbers + OFFSET))
    return VoxelSet.of_cells(voxel, key, np.ones_like(key))


def holds(voxels: VoxelSet, numbers: Int[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
    """Return which voxels with these lattice numbers (N, 3) belong to the set."""
    return voxels.count_in(encode(numbers + OFFSET), 1) > 0


def skin(voxels: VoxelSet, towards_eye: Float[np.ndarray, " 3"]) -> VoxelSkin:
    """Return the voxels with a face towards an eye at infinity.

    Args:
        voxels: set of voxels; its interior costs little time.
        towards_eye: direction of the eye (3,), of any length.
    """
    numbers = np.rint(voxels.centres() / voxels.voxel - 0.5).astype(np.int64)
    side = np.where(np.abs(towards_eye) > _FLAT, np.sign(towards_eye), 0).astype(np.int64)
    exposed = np.zeros((len(numbers), 3), bool)
    for axis in np.flatnonzero(side):
        neighbour = numbers + side[axis] * np.eye(3, dtype=np.int64)[axis]
        exposed[:, axis] = ~holds(voxels, neighbour)
    shown = exposed.any(axis=1)
    return VoxelSkin(voxels.voxel, numbers[shown], side, exposed[shown])


def cut_open(voxels: VoxelSet, axis: int, at: float, side: float) -> VoxelSet:
    """Return the voxels behind a plane.

    Args:
        voxels: set of voxels.
        axis: axis that the plane is perpendicular to.
        at: position of the plane on this axis, m.
        side: side of the plane on which the eye is, +1 or -1.
    """
    centres = voxels.centres()
    kept = centres[side * (at - centres[:, axis]) > 0]
    return voxel_set(voxels.voxel, np.rint(kept / voxels.voxel - 0.5).astype(np.int64))


def openness(skin: VoxelSkin, voxels: VoxelSet) -> Float[np.ndarray, " N"]:
    """Return how open the surroundings of each voxel of the skin are, in [0, 1].

    It is 1 on flat and convex parts and lower in corners and grooves. The estimate follows 26
    directions over up to eight voxels; 9 of them are open above a flat face.
    """
    ways = np.array([w for w in np.ndindex(3, 3, 3) if w != (1, 1, 1)]) - 1
    steps = (1, 2, 4, 8)
    empty = np.zeros(len(skin.numbers))
    for way in ways:
        for step in steps:
            empty += ~holds(voxels, skin.numbers + step * way)
    return np.minimum(empty / (9 * len(steps)), 1)


def normals(
    solid: Solid, points: Float[np.ndarray, "N 3"], step: float
) -> Float[np.ndarray, "N 3"]:
    """Return unit normals (N, 3) of a solid near given points.

    They are gradients of the implicit function by central differences, or straight up where it has
    no gradient.

    Args:
        solid: solid with an implicit function.
        points: points (N, 3) m.
        step: step of the differences to either side, m.
    """
    ends = points[:, None, None] + step * np.array([1, -1])[:, None, None] * np.eye(3)
    value = solid(ends.reshape(-1, 3)).reshape(len(points), 2, 3)
    way = value[:, 0] - value[:, 1]
    length = np.linalg.norm(way, axis=1, keepdims=True)
    normal: np.ndarray = np.where(
        length > _FLAT * step, way / np.maximum(length, _FLAT * step), np.eye(3)[2]
    )
    return normal


def add_skin(
    canvas: Canvas,
    skin: VoxelSkin,
    colour: Any,
    normal: Float[np.ndarray, "N 3"] | None = None,
    blend: float = 1.0,
    light: Float[np.ndarray, " N"] | float = 1.0,
    alpha: float = 1.0,
    line: float = 0.0,
) -> None:
    """Add the exposed faces of voxels to a canvas with an eye at infinity, the eye used for
    ``skin``.

    Args:
        canvas: canvas to draw on.
        skin: voxels to draw.
        colour: one colour for all voxels, by name or (3,), or one for each (N, 3).
        normal: normal of the solid at each voxel, for smooth shading; None to shade cubes.
        blend: weight of the smooth shading in [0, 1]; the rest is that of the cubes.
        light: factor of the light for all voxels, or for each.
        alpha: opacity.
        line: width of the faces' edges in points, slightly darker than the faces; 0 for none.

    Raises:
        ValueError: if the canvas has a near eye, which may see other faces.
    """
    if np.isfinite(canvas.distance):
        raise ValueError("voxels need a canvas with an eye at infinity, got a near eye")
    for axis in np.flatnonzero(skin.side):
        mine = skin.exposed[:, axis]
        corners = _FACE[axis].copy()
        corners[:, axis] = (skin.side[axis] + 1) // 2
        faces = (skin.numbers[mine, None] + corners) * skin.voxel  # (N, 4, 3)
        base = colour if np.ndim(colour) < 2 else colour[mine]
        flat = np.broadcast_to(skin.side[axis] * np.eye(3)[axis], (len(faces), 3))
        rgb = canvas.lit(base, flat)
        if normal is not None:
            rgb = (1 - blend) * rgb + blend * canvas.lit(base, normal[mine])
        rgb = np.clip(rgb * (light[mine, None] if isinstance(light, np.ndarray) else light), 0, 1)
        canvas.faces(faces, rgb, alpha, lit=False)
        if line:
            canvas.lines(loops(faces), np.repeat(0.72 * rgb, 4, axis=0), line, _OVER * skin.voxel)
