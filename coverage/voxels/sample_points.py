"""One sample point in every voxel: stratified sampling of space, the same for every solid.

A lattice of voxel centres errs by up to half a layer where a flat face lies along it. Points drawn
inside the voxels do not: the number of points in a solid is an unbiased estimate of its volume in
voxels (Cochran, Sampling Techniques, 1977, chapter 5).

The points of a block of 4 x 4 x 4 voxels are one pattern, shifted cyclically inside the voxels by u
(Cranley and Patterson, SIAM J. Numer. Anal. 13, 1976). From block to block, u is a Kronecker
sequence: the fractional part of the block's numbers times irrational numbers, so that neighbours
fill the voxel evenly. The points depend on nothing but the lattice: all layouts share them.
"""

import numpy as np
from jaxtyping import Float, Int, UInt8

from .voxel_bitmask import CORNER, LEVEL, PARTS, PATTERNS, VOXELS
from .voxel_set import centre, decode

_IRRATIONAL = np.sqrt([[2.0, 3.0, 5.0], [7.0, 11.0, 13.0], [17.0, 19.0, 23.0]]) % 1.0


def block_samples(
    numbers: Int[np.ndarray, "B 3"],
) -> tuple[UInt8[np.ndarray, " B"], Float[np.ndarray, "B 3"]]:
    """Return the pattern of each block and its shift, in voxels, from the blocks' numbers."""
    x, y, z = (numbers[:, i, None] * _IRRATIONAL[i] for i in range(3))
    u = PARTS * ((x + y + z) % 1.0)
    whole = np.floor(u)
    pattern = whole @ np.array([PARTS**2, PARTS, 1])
    return pattern.astype(np.uint8), (u - whole) / PARTS


def points_in_blocks(
    numbers: Int[np.ndarray, "B 3"], voxel: float, sampled: bool
) -> Float[np.ndarray, "64 B 3"]:
    """Return the centres or the sample points, m, of the 64 voxels of blocks with these numbers."""
    if not sampled:
        return centre((numbers << LEVEL) + CORNER[:, None], 0, voxel)
    pattern, shift = block_samples(numbers)
    offsets = (PATTERNS[pattern] + shift[:, None]).transpose(1, 0, 2)
    points: np.ndarray = centre(numbers, LEVEL, voxel) + voxel * offsets
    return points


def samples_of(key: Int[np.ndarray, " N"], voxel: float) -> Float[np.ndarray, "N 3"]:
    """Return the sample points, m, of voxels from their keys."""
    numbers = decode(key // VOXELS)
    pattern, shift = block_samples(numbers)
    offsets = PATTERNS[pattern, key % VOXELS] + shift
    points: np.ndarray = centre(numbers, LEVEL, voxel) + voxel * offsets
    return points
