"""Voxels on a ``Canvas``: the exposed faces of a set of voxels that face an eye at infinity.

An eye at infinity sees at most three faces of a cube, the same three for every voxel. Of those,
only faces without a neighbouring voxel are exposed.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.voxels.voxel_set import OFFSET, VoxelSet, encode
from .canvas import Canvas

# Corners of the faces towards +x, +y and +z, in voxels from the lowest corner, in order around
# the face.
_FACE = np.array(
    [
        [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)],
        [(0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)],
        [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
    ]
)
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


def add_skin(canvas: Canvas, skin: VoxelSkin, colour: Any, alpha: float = 1.0) -> None:
    """Add the exposed faces of voxels to a canvas with an eye at infinity, the eye used for
    ``skin``.

    Args:
        canvas: canvas to draw on.
        skin: voxels to draw.
        colour: one colour for all voxels, by name or (3,), or one for each (N, 3).
        alpha: opacity.

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
        canvas.faces(faces, np.clip(canvas.lit(base, flat), 0, 1), alpha, lit=False)
