"""Voxels on a ``Canvas``: the faces of a set of voxels that an eye at infinity may see.

A cube shows an eye at infinity at most three faces, the same three for every voxel, and of those
only the ones without a neighbour are exposed.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.solids.base import Solid
from ...coverage.voxels.voxel_set import OFFSET, VoxelSet, encode
from .canvas import Canvas
from .meshes import loops

# Corners of the faces that look along +x, +y and +z, in voxels from the lowest corner, in turn
# around the face.
_FACE = np.array(
    [
        [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)],
        [(0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)],
        [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
    ]
)
_OVER = 0.02  # sides of a voxel, by which its edges lie over its faces
_FLAT = 1e-9  # share of a face's area that an eye sees of it from its edge, by rounding


@dataclass(frozen=True)
class VoxelSkin:
    """The voxels of a set that show a face to the eye.

    voxel: side, m. numbers (N, 3): on the lattice, a voxel lies between k and k + 1 sides. side
    (3,): +1 or -1, which of the two faces across each axis looks at the eye, 0 where the eye sees
    neither. exposed (N, 3): whether that face has no neighbour.
    """

    voxel: float
    numbers: Int[np.ndarray, "N 3"]
    side: Int[np.ndarray, " 3"]
    exposed: Bool[np.ndarray, "N 3"]

    @property
    def faces(self) -> int:
        """How many faces there are to draw."""
        return int(np.count_nonzero(self.exposed))

    @property
    def centres(self) -> Float[np.ndarray, "N 3"]:
        """Centres (N, 3) m of the voxels."""
        return (self.numbers + 0.5) * self.voxel


def voxel_set(voxel: float, numbers: Int[np.ndarray, "N 3"]) -> VoxelSet:
    """The set of voxels of side ``voxel`` m with the lattice numbers (N, 3), in any order, each
    once or more.
    """
    key = np.unique(encode(numbers + OFFSET))
    return VoxelSet.of_cells(voxel, key, np.ones_like(key))


def holds(voxels: VoxelSet, numbers: Int[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
    """Which of the voxels with these lattice numbers (N, 3) belong to the set."""
    return voxels.count_in(encode(numbers + OFFSET), 1) > 0


def skin(voxels: VoxelSet, towards_eye: Float[np.ndarray, " 3"]) -> VoxelSkin:
    """The voxels that show a face to an eye at infinity.

    Args:
        voxels: the set; what is inside it costs little.
        towards_eye: (3,), of any length.
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
    """The voxels on the far side of a plane across ``axis`` at ``at`` m, as seen from its ``side``,
    +1 or -1.
    """
    centres = voxels.centres()
    kept = centres[side * (at - centres[:, axis]) > 0]
    return voxel_set(voxels.voxel, np.rint(kept / voxels.voxel - 0.5).astype(np.int64))


def openness(skin: VoxelSkin, voxels: VoxelSet) -> Float[np.ndarray, " N"]:
    """How little the voxels near each voxel of the skin close it in, in [0, 1]: 1 on flat and
    bulging parts, less in corners and grooves. It looks in 26 ways, up to eight voxels off; of a
    flat face 9 ways are open."""
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
    """Unit normals (N, 3) of a solid near ``points`` (N, 3) m: the gradient of its implicit
    function, by differences over ``step`` m to either side; where it has none, straight up."""
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
    """Add the exposed faces of a set of voxels to a canvas whose eye is at infinity, where ``skin``
    looked for it.

    Args:
        colour: of all voxels, by name or (3,), or of each (N, 3).
        normal: of the solid at each voxel, by which it is lit as a smooth surface; None: lit as
            cubes.
        blend: in [0, 1], how much of the light is the smooth surface's; the rest is that of the
            cubes.
        light: on all voxels, or on each, beside which their colours are as lit as the normals say.
        alpha: opacity.
        line: width in points of the faces' edges, a little darker than the faces; 0: none.

    Raises:
        ValueError: if the canvas's eye is near, which may see other faces.
    """
    if np.isfinite(canvas.distance):
        raise ValueError("voxels are drawn for an eye at infinity; this canvas's is near")
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
