"""A guaranteed interval for zeta, of a requested width.

Cells wholly inside or outside are settled at once. For a cell that surfaces intersect, the covered
and the uncovered volume are bounded from below and above (``volume_fraction``). A cell whose bounds
differ by more than a threshold is split. The threshold decreases from pass to pass until the
interval is narrow enough. Passes go depth first and keep no cells, so memory stays bounded however
narrow the interval, and each pass yields a valid interval.
"""

import itertools
import math
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ..processors import processors
from ..solids.base import Solid, leaves
from ..solids.volume_fraction import VolumeFraction
from ..weight_field import WeightField
from .allocation import keep_freed_memory
from .cell_classification import IN_TARGET, SEEN, SLACK, inside_leaves, scale, target_verdicts
from .octree_cells import Cells, first_cells
from .volume_tally import COVERED, LEVELS, OPEN, OUTSIDE, UNCOVERED, Bracket, VolumeTally
from .voxel_set import centre
from .voxel_shares import cell_shares

# pairs of cell and part processed at once: enough that arithmetic outweighs calls, about 100 MB
_PAIRS = 1 << 18
# minimum and maximum number of work shares for the first cells; the same on all machines,
# independent of their number of processors
_SHARES = (4, 64)
_SHARE = 1 << 18  # cells of a pass for which another share pays off
_WORTH = 2000  # a cell this many times the threshold is split without computing its shares
_KNOWN = 1e-6  # width of the bounds of a cell's mean weight, below which it counts as known
_FAR = 1e-3  # factor on the threshold below which two steps cost less than one that misses
_NEARER = 1 / 3  # power of the factor that the first of two steps takes
_AIM = 0.98  # width that a step aims at, of the requested one
# of the threshold, with which intervals shrink: measured where bounds follow the surfaces'
# curvature (0.57 to 0.60), and where they are planes
_POWER, _POWER_OF_PLANES = 0.56, 0.5
# of its box: a target of at most this volume, no part of which is certain, counts as empty
_EMPTY = 0.05


class StoppedError(Exception):
    """A pass was stopped before its end."""


@dataclass(frozen=True)
class _Pass:
    """One descent, which splits cells with an open volume above a threshold, down to level 0.

    Open covered volume has the weight 1 - zeta and open uncovered volume the weight zeta, because
    they move the share by these factors.
    """

    target: Solid
    """The target."""
    seen: Solid
    """The visible region."""
    unit: float
    """Side of a cell of level 0, m."""
    threshold: float
    """Weighted open volume above which a cell is split, m^3."""
    zeta: float
    """Estimate of zeta, for the weights."""
    slack: float
    """Rounding error of implicit functions, m."""
    stop: threading.Event
    """Stops the pass when set."""
    weights: WeightField | None = None
    """How much each place matters, relative to the largest weight; None: all the same."""
    keep: bool = False
    """Whether settled cells are kept."""

    def run(self, start: Cells) -> VolumeTally:
        """Settle all cells below the cells ``start``."""
        tally, stack = VolumeTally(), [start]
        unions = len(leaves(self.target))
        while stack:
            for cells in stack.pop().slices(_PAIRS):
                if self.stop.is_set():
                    raise StoppedError
                rest = self._decide(cells, tally)
                if len(rest):
                    rest = self._settle(rest, unions, tally)
                if len(rest):
                    stack.append(rest.children())
        return tally

    def _decide(self, cells: Cells, tally: VolumeTally) -> Cells:
        """Settle the cells wholly inside or outside both solids, and return the others.

        The marks of the returned cells record in which solid they lie.
        """
        points = centre(cells.numbers, cells.level, self.unit)
        reach = math.sqrt(3) / 2 * self.unit * (1 << cells.level) + self.slack
        t, v, marked = target_verdicts(self.target, self.seen, cells, points, reach)
        done, side = (t < 0) & (v != 0), self.unit * (1 << cells.level)
        if self.weights is None:
            mean = VolumeFraction(np.ones(done.sum()), np.ones(done.sum()))
        else:
            weight = self.weights.in_cubes(points, side, self.slack).mean
            done &= (weight.high - weight.low < _KNOWN) | (cells.level == 0)
            mean = weight.only(done)
        seen = v[done] < 0
        tally.add(
            VolumeFraction(seen * mean.low, seen * mean.high),
            VolumeFraction(~seen * mean.low, ~seen * mean.high),
            side**3,
            cells.level,
        )
        if self.keep:
            state = np.where(t > 0, OUTSIDE, np.where(v < 0, COVERED, UNCOVERED))
            known = (t > 0) | done
            tally.settled.append((cells.level, cells.key[known], state[known]))
        return marked.only((t <= 0) & ~done)

    def _settle(self, cells: Cells, unions: int, tally: VolumeTally) -> Cells:
        """Settle the cells whose shares are known well enough; return the cells to be split."""
        side = self.unit * (1 << cells.level)
        volume = side**3
        if volume > _WORTH * self.threshold and cells.level > 0:
            return cells
        points = centre(cells.numbers, cells.level, self.unit)
        t = self._share(self.target, slice(0, unions), cells, points)
        v = self._share(self.seen, slice(unions, len(cells.pairs)), cells, points)
        known = cells.mark & IN_TARGET > 0, cells.mark & SEEN > 0
        for share, whole in zip((t, v), known, strict=True):
            share.low[whole] = share.high[whole] = 1.0
        covered, uncovered = t & v, t & -v
        if self.weights is not None:
            weight = self.weights.in_cubes(points, side, self.slack)
            covered, uncovered = weight.of(covered), weight.of(uncovered)
        open_ = (1 - self.zeta) * (covered.high - covered.low) + self.zeta * (
            uncovered.high - uncovered.low
        )
        split = (volume * open_ > self.threshold) & (cells.level > 0)
        done = ~split
        tally.add(covered.only(done), uncovered.only(done), volume, cells.level)
        if self.keep:
            tally.settled.append((cells.level, cells.key[done], np.full(done.sum(), OPEN)))
        return cells.only(split)

    def _share(
        self, solid: Solid, some: slice, cells: Cells, points: Float[np.ndarray, "M 3"]
    ) -> VolumeFraction:
        """Return bounds of the cells' shares in a solid; its leaves are ``some`` of all."""
        pairs, side = cells.pairs[some], self.unit * (1 << cells.level)
        inside = inside_leaves(cells.mark, some.start, len(pairs))
        # a checker of the settled cells knows planes only
        return cell_shares(solid, points, pairs, side, self.slack, inside, not self.keep)


def _run(work: _Pass, start: Cells, cells: int) -> VolumeTally:
    """Run one pass; ``cells`` is the number of cells of the previous pass.

    The work shares are the same on every machine, so that sums round identically.
    """
    shares = min(max(cells // _SHARE, _SHARES[0]), _SHARES[1])
    share = np.arange(len(start)) % shares
    with ThreadPoolExecutor(processors()) as pool:
        jobs = [pool.submit(work.run, start.only(share == i)) for i in range(shares)]
        try:
            tallies = [job.result() for job in jobs]
        except BaseException:
            work.stop.set()
            raise
    total = VolumeTally()
    for tally in tallies:
        total.join(tally)
    return total


def _step(width: float, wanted: float, power: float) -> float:
    """Return the factor on the threshold, with a power of which the interval shrinks.

    The step aims slightly below the requested width; where that is far, in two steps.
    """
    factor: float = (_AIM * wanted / width) ** (1 / power)
    return min(factor**_NEARER if factor < _FAR else factor, 0.5)


def bracket(
    target: Solid,
    seen: Solid,
    width: float = 0.0,
    voxel: float | None = None,
    tell: Callable[[Bracket], None] = lambda bracket: None,
    weights: WeightField | None = None,
    keep: bool = False,
) -> Bracket:
    """Return guaranteed bounds of the share of ``target`` that lies in ``seen``.

    Args:
        target, seen: solids.
        width: requested width of the interval, in [0, 1]; 0: descend to every cell of side
            ``voxel``.
        voxel: side below which no cell is split, m; None: a millionth of the scene.
        tell: called with the interval after each pass. Ctrl-C ends the work with the last interval,
            with ``reached`` False.
        weights: how much each place matters; volumes then count by the mean weight in them,
            relative to the largest one. None: all the same.
        keep: whether the interval holds the settled cells, about 10 bytes each.

    Raises:
        ValueError: if the target is empty, or neither width nor voxel bounds the work.
    """
    if not width > 0 and voxel is None:
        raise ValueError("a guaranteed interval needs a width or a voxel side: set one of them")
    keep_freed_memory()
    box = target.bounds()
    if weights is not None and (support := weights.support()) is not None:
        low = np.maximum(box[0], support[0])
        box = np.stack([low, np.maximum(np.minimum(box[1], support[1]), low)])
    size = float(np.ptp(box, axis=0).max())
    volume = float(np.prod(np.ptp(box, axis=0)))
    if not volume > 0:
        raise ValueError("the target is empty: its box has no volume")
    furthest = float(np.abs(box).max())  # the lattice extends 2^19 units from the origin
    if keep:  # the cells beyond these are then far from the target, measured by their size
        furthest *= 2
        box = furthest * np.array([[-1.0] * 3, [1.0] * 3])
    unit = voxel if voxel is not None else max(size, 1.001 * furthest) / 2.0**LEVELS
    slack = SLACK * max(scale(target), scale(seen))
    start = first_cells(leaves(target) + leaves(seen), box, unit, 0)
    threshold = 100 * width * width * volume  # an interval about a hundred times as wide
    fine = width * volume / 100  # small enough to call a target empty
    work = _Pass(target, seen, unit, threshold, 0.5, slack, threading.Event(), weights, keep)
    interval: Bracket | None = None
    for passes in itertools.count(1):
        try:
            tally = _run(work, start, interval.cells if interval else 0)
            before, interval = interval, tally.bracket(passes, unit, width)
            lost = interval.volume_low == 0 and interval.volume_high < _EMPTY * volume
            if lost and work.threshold <= fine:
                raise ValueError(
                    "the target is empty or too thin: no part of its volume is certain"
                )
            tell(interval)
        except KeyboardInterrupt:
            if interval is None:
                raise
            return interval
        if lost:  # what is left may be smaller than these cells
            work = replace(work, threshold=fine)
            continue
        stuck = before is not None and tally.level == 0 and interval.width > 0.99 * before.width
        if interval.reached or not threshold > 0 or stuck:
            return interval
        zeta = min(max((interval.low + interval.high) / 2, 0.05), 0.95)
        step = _step(interval.width, width, _POWER_OF_PLANES if keep else _POWER)
        work = replace(work, zeta=zeta, threshold=work.threshold * step)
    raise AssertionError("unreachable")
