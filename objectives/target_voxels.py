"""Voxels of a target volume, and the limit on their number."""

import math
from typing import Literal

import numpy as np

from ..coverage.solids.base import Difference
from ..coverage.voxels.octree import voxels
from ..coverage.voxels.octree_cells import Region
from ..coverage.voxels.voxel_set import VoxelSet

_MOST = 1e10  # voxels on the surface of a target: more would take days


class TooFineError(ValueError):
    """Voxels are so small that counting them would take days."""


def target_voxels(
    solid: Difference,
    voxel: float,
    rule: Literal["centre", "touch"],
    region: Region | None = None,
    memory: float | None = None,
) -> VoxelSet:
    """Return the voxels of the target volume, Omega(V_max), in the whole or in one region.

    Under the rule ``touch``, as in the paper, these are the voxels that the outer solid touches
    less those that V_R touches.
    """
    if rule == "centre":
        return voxels(solid, voxel, region=region, memory=memory)
    outer, body = (
        voxels(s, voxel, "touch", region=region, memory=memory) for s in (solid.a, solid.b)
    )
    return outer - body


def surface_voxels(solid: Difference, voxel: float) -> float:
    """Return a generous estimate of the number of voxels on a solid's surface, which are stored.

    It is a few times the number of voxels on the surface of its bounding box.
    """
    x, y, z = np.ptp(solid.bounds(), axis=0)
    return float(4 * (x * y + y * z + z * x) / voxel**2)


def check_voxel(solid: Difference, voxel: float) -> None:
    """Reject a voxel size for which the count would take days.

    Raises:
        ValueError: if the size is not positive and finite.
        TooFineError: if the surface has more than 10^10 voxels.
    """
    if not (math.isfinite(voxel) and voxel > 0):
        raise ValueError(f"voxel {voxel} is not a positive number of metres")
    surface = surface_voxels(solid, voxel)
    if surface > _MOST:
        raise TooFineError(
            f"voxels of {voxel:g} m give about {surface:.1g} voxels on the target's surface, above"
            f" the limit of {_MOST:.0e}; use {voxel * math.sqrt(surface / _MOST):.1g} m or more"
        )
