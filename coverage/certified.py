"""A guaranteed interval for zeta: cells for sure inside or outside, and what the others can do at the most."""

import math
from dataclasses import dataclass

import numpy as np

from .octree import CHUNK, SLACK, first_cells, leaves, verdicts
from .solids import Solid
from .voxelset import centre

_IN_TARGET, _SEEN = 1, 2  # bits of a cell's mark


@dataclass(frozen=True)
class Bracket:
    """Guaranteed bounds of zeta, in [0, 1], and of the target's volume, m^3."""

    low: float
    high: float
    volume_low: float
    volume_high: float


def bracket(target: Solid, seen: Solid, voxel: float) -> Bracket:
    """Bounds of the share of ``target`` that lies in ``seen``, by cells down to the side ``voxel`` m.

    Volume is gathered by what is certain of it: in the target and seen (c), in it and unseen (u), in it and either (e), and
    perhaps in it while seen (pc), unseen (pu) or either (pe). The share is largest when all of e, pc and pe count as
    covered, and least when e, pu and pe count as uncovered.

    Raises:
        ValueError: if nothing of the target was found for sure and nothing perhaps: it is empty.
    """
    box = target.bounds()
    in_target, in_seen = leaves(target), leaves(seen)
    slack = SLACK * max(1.0, float(np.abs(box).max()), float(np.abs(seen.bounds()).max()))
    stack = [first_cells(in_target + in_seen, box, voxel, 0)]
    volume = dict.fromkeys(("c", "u", "e", "pc", "pu", "pe"), 0)
    while stack:
        for cells in stack.pop().slices(CHUNK):
            points = centre(cells.numbers, cells.level, voxel)
            reach = math.sqrt(3) / 2 * voxel * (1 << cells.level) + slack
            n = len(in_target)
            t, pairs_t = verdicts(target, points, cells.pairs[:n], reach)
            v, pairs_v = verdicts(seen, points, cells.pairs[n:], reach)
            t[cells.mark & _IN_TARGET != 0] = -1
            v[cells.mark & _SEEN != 0] = -1
            size = 1 << 3 * cells.level
            volume["c"] += size * int(((t < 0) & (v < 0)).sum())
            volume["u"] += size * int(((t < 0) & (v > 0)).sum())
            undecided = (t == 0) | ((t < 0) & (v == 0))
            if cells.level == 0:
                volume["e"] += int(((t < 0) & (v == 0)).sum())
                for name, state in (("pc", -1), ("pu", 1), ("pe", 0)):
                    volume[name] += int(((t == 0) & (v == state)).sum())
                continue
            mark = (np.where(t < 0, _IN_TARGET, 0) | np.where(v < 0, _SEEN, 0)).astype(np.int8)
            stack.append(cells.left((*pairs_t, *pairs_v), mark).only(undecided).children())
    c, u, e, pc, pu, pe = volume.values()
    if c + u + e + pc + pu + pe == 0:
        raise ValueError("the target is empty: no cell of it was found")
    low = c / (c + u + e + pu + pe) if c else 0.0
    covered = c + e + pc + pe
    high = covered / (covered + u) if covered else 0.0
    return Bracket(low, high, (c + u + e) * voxel**3, (c + u + e + pc + pu + pe) * voxel**3)
