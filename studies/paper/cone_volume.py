"""Volume of the paper's cone by counting voxels of several sizes, beside its closed form."""

import numpy as np

from ...coverage.sensors.sensor import PAPER_SENSOR
from ...coverage.solids.cones import Cones
from ...coverage.voxels.octree import Rule, count

VOXELS = (0.2, 0.1, 0.05, 0.025)  # m
PLACES = 100  # positions of a cone on the lattice, over which a volume is averaged
_RULES: tuple[Rule, ...] = ("centre", "touch")
# m, offset from the lattice on each axis: an apex on the lattice touches extra voxels
_OFF = VOXELS[-1] / 3


def cone_volumes() -> list[dict[str, float | str]]:
    """Return the volume of the paper's cone for each rule and size of voxels.

    Returns:
        For each: rule, voxel m, voxels, volume_m3, and over random positions on the lattice mean_m3
            and deviation_m3.
    """
    rows: list[dict[str, float | str]] = []
    for rule in _RULES:
        for voxel in VOXELS:
            counted = _count(np.full(3, _OFF), voxel, rule)
            moved = _OFF + np.random.default_rng(0).uniform(0, voxel, (PLACES, 3))
            counts = [_count(apex, voxel, rule) for apex in moved]
            rows.append(
                {
                    "rule": rule,
                    "voxel": voxel,
                    "voxels": counted,
                    "volume_m3": counted * voxel**3,
                    "mean_m3": float(np.mean(counts)) * voxel**3,
                    "deviation_m3": float(np.std(counts)) * voxel**3,
                }
            )
    return rows


def _count(apex: np.ndarray, voxel: float, rule: Rule) -> int:
    """Return the number of voxels in the paper's cone, upright on an apex (3,) m."""
    half, height = PAPER_SENSOR.fov / 2, PAPER_SENSOR.range_m
    cone = Cones(apex[None], np.eye(3)[2:], np.array([half]), np.array([height]))
    return count(cone, voxel, rule)
