"""Voxels of a target volume, and limits on their number and on the beams that reach beyond."""

import math
from collections.abc import Iterable
from typing import Literal

import numpy as np

from ..coverage.sensors.sensor import Sensor
from ..coverage.solids.base import Difference
from ..coverage.voxels.octree import voxels
from ..coverage.voxels.octree_cells import Region
from ..coverage.voxels.voxel_set import FURTHEST, VoxelSet

_MOST = 1e10  # voxels on the surface of a target: more would take days
_CELL = 100.0  # m: a lattice that is smaller has voxels too fine for any count
_ROBOT_VOXELS = 1 << 12  # of the lattice, left for the robot that carries the beams


class TooFineError(ValueError):
    """Voxels are so small that counting them would take days."""


def target_voxels(
    solid: Difference,
    voxel: float,
    rule: Literal["sampled", "centre", "touch"],
    region: Region | None = None,
    memory: float | None = None,
) -> VoxelSet:
    """Return the voxels of the target volume, Omega(V_max), in the whole or in one region.

    Under the rule ``touch``, as in the paper, these are the voxels that the outer solid touches
    less those that V_R touches.
    """
    if rule != "touch":
        return voxels(solid, voxel, rule, region=region, memory=memory)
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


def check_beams(sensors: Iterable[Sensor], voxel: float) -> None:
    """Reject sensors whose beams extend further than a lattice of ``voxel`` m.

    A beam ends in a flat base, so its width grows without limit as the field of view approaches
    180 degrees.

    Raises:
        ValueError: naming the field of view and the largest one at that range.
    """
    furthest = (FURTHEST - _ROBOT_VOXELS) * voxel
    if not furthest > _CELL:  # the voxels are to blame
        return
    for sensor in sensors:
        if sensor.farthest < furthest:
            continue
        half = max(sensor.circumscribed_half_angle, sensor.half_angle)
        beam = f"fov {math.degrees(sensor.fov):.6g}°"
        if sensor.fov_up is not None:
            beam += f" by {math.degrees(sensor.fov_up):.6g}°"
        if sensor.range_m >= furthest:
            raise ValueError(
                f"sensor: found range {sensor.range_m:g} m, allowed: below {furthest:.4g} m for"
                f" voxels of {voxel:g} m"
            )
        # of a square beam with two equal angles, whose corner lies furthest
        widest = math.sqrt(furthest**2 / sensor.range_m**2 - 1)
        most = 2 * math.degrees(math.atan(widest / (math.sqrt(2) if sensor.square else 1)))
        raise ValueError(
            f"sensor: found {beam} at range {sensor.range_m:g} m, a beam"
            f" {2 * sensor.range_m * math.tan(half):,.0f} m wide at its end; allowed: up to"
            f" {math.floor(1e3 * most) / 1e3:.6g}° for voxels of {voxel:g} m"
        )
