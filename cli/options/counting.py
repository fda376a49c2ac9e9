"""How the exact coverage is counted, from the options."""

import math
from dataclasses import dataclass

from ...coverage.choices import Rule
from ...formats.errors import UserError
from ...objectives.verify import VOXEL

LEAST_MEMORY = 0.01  # GB
WIDTH = 0.1  # points, of a guaranteed interval where none is asked for


@dataclass(frozen=True)
class Counting:
    """How to count: rule, side of a voxel in m, bytes that sets of voxels may take, and, when
    certified, the width of the interval in [0, 1]; 0: none."""

    rule: Rule
    voxel: float | None
    memory: float | None = None
    width: float = 0.0


def resolve_counting(
    rule: Rule, voxel: float | None, width: float | None, memory: float | None
) -> Counting:
    """What ``--rule``, ``--voxel``, ``--width`` (points) and ``--memory`` (GB) mean together."""
    if memory is not None and not memory >= LEAST_MEMORY:
        raise UserError(f"--memory: found {memory:g}, allowed: GB, {LEAST_MEMORY:g} and more")
    if voxel is not None and not (math.isfinite(voxel) and voxel > 0):
        raise UserError(f"--voxel: found {voxel:g}, allowed: a positive number of metres")
    if rule != "certified":
        if width is not None:
            raise UserError(f"--width: found {width:g}, allowed: only with --rule certified")
        return Counting(
            rule, VOXEL if voxel is None else voxel, None if memory is None else memory * 1e9
        )
    if width is not None and not 0 < width <= 100:
        raise UserError(f"--width: found {width:g}, allowed: points, above 0 and at most 100")
    if width is None:
        width = WIDTH if voxel is None else 0.0
    return Counting(rule, voxel, None, width / 100)
