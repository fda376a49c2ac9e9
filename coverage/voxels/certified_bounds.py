"""A guaranteed interval for zeta, as narrow as asked.

Cells wholly inside or outside are settled at once. Of a cell that surfaces cut, the covered and the
uncovered volume are bounded from below and above (``volume_fraction``); a cell whose bounds still
leave more open than a threshold is split. The threshold falls from pass to pass until the interval
is narrow enough. Passes go depth first and keep no cells, so that memory stays bounded however
narrow the interval, and each pass leaves a valid interval.
"""

import itertools
import math
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import rows
from ..processors import processors
from ..solids.base import LOGIC, Solid, fold, leaves
from ..solids.volume_fraction import VolumeFraction
from .allocation import keep_freed_memory
from .cell_classification import SLACK, scale, verdicts
from .octree_cells import Cells, first_cells
from .voxel_set import centre

_IN_TARGET, _SEEN = 1, 2  # bits of a cell's mark
_LEVELS = 19  # of halving a cell, from the scene's box down to the smallest
# of cell and part worked on at once: enough that arithmetic outweighs calls, some 100 MB
_PAIRS = 1 << 17
# that the first cells are dealt into, at least and at most: for machines of any number of
# processors alike
_SHARES = (4, 64)
_SHARE = 1 << 18  # cells of a pass, from where on another share pays
_WORTH = 2000  # a cell this many times the threshold is split without a look at its shares
# of its box: a target that may be this large at most, and of which nothing is certain, counts as
# empty
_EMPTY = 0.05
_SUM = 1e-12  # rounding of a sum of volumes, relative; adding up such sums adds to it


@dataclass(frozen=True)
class Bracket:
    """Guaranteed bounds of zeta, in [0, 1], and of the target's volume, m^3; and how they were
    reached: passes, cells settled in the last pass, side of the smallest of them, m, and whether
    the interval is as narrow as was asked."""

    low: float
    high: float
    volume_low: float
    volume_high: float
    passes: int
    cells: int
    smallest: float
    reached: bool

    @property
    def width(self) -> float:
        """Of the interval, in [0, 1]."""
        return self.high - self.low


@dataclass
class _Tally:
    """Bounds of the covered and the uncovered volume of the target, m^3, their cells, smallest
    level and number of sums.
    """

    covered_low: float = 0.0
    covered_high: float = 0.0
    uncovered_low: float = 0.0
    uncovered_high: float = 0.0
    cells: int = 0
    level: int = _LEVELS + 2
    sums: int = 0

    def add(
        self, covered: VolumeFraction, uncovered: VolumeFraction, volume: float, level: int
    ) -> None:
        """Settle cells of one ``volume``."""
        sums = [
            volume * float(v.sum())
            for v in (covered.low, covered.high, uncovered.low, uncovered.high)
        ]
        cells = len(covered.low)
        covered_low, covered_high, uncovered_low, uncovered_high = sums
        level = level if cells else self.level
        self.join(_Tally(covered_low, covered_high, uncovered_low, uncovered_high, cells, level, 1))

    def join(self, other: "_Tally") -> None:
        """Add what another thread settled."""
        self.covered_low += other.covered_low
        self.covered_high += other.covered_high
        self.uncovered_low += other.uncovered_low
        self.uncovered_high += other.uncovered_high
        self.cells += other.cells
        self.level = min(self.level, other.level)
        self.sums += other.sums

    def bracket(self, passes: int, unit: float, width: float) -> Bracket:
        """The interval; sums are widened by their rounding."""
        rounding = _SUM + self.sums * 2.0**-52
        c, u = self.covered_low * (1 - rounding), self.uncovered_low * (1 - rounding)
        more_c, more_u = self.covered_high * (1 + rounding), self.uncovered_high * (1 + rounding)
        low = c / (c + more_u) * (1 - _SUM) if c > 0 else 0.0
        high = min(more_c / (more_c + u) * (1 + _SUM), 1.0) if more_c > 0 else 0.0
        return Bracket(
            low,
            high,
            c + u,
            more_c + more_u,
            passes,
            self.cells,
            unit * 2.0**self.level,
            high - low <= width,
        )


class StoppedError(Exception):
    """Asked to stop in the middle of a pass."""


@dataclass(frozen=True)
class _Pass:
    """One descent: cells that leave more than ``threshold`` m^3 open are split, down to level 0; a
    covered volume counts 1 - zeta, an uncovered one zeta, as that is what they move the share by.
    """

    target: Solid
    seen: Solid
    unit: float
    threshold: float
    zeta: float
    slack: float
    stop: threading.Event

    def run(self, start: Cells) -> _Tally:
        """Settle everything below the cells ``start``."""
        tally, stack = _Tally(), [start]
        unions = len(leaves(self.target))
        while stack:
            for cells in stack.pop().slices(_PAIRS):
                if self.stop.is_set():
                    raise StoppedError
                rest = self._decide(cells, unions, tally)
                if len(rest):
                    rest = self._settle(rest, unions, tally)
                if len(rest):
                    stack.append(rest.children())
        return tally

    def _decide(self, cells: Cells, unions: int, tally: _Tally) -> Cells:
        """Settle the cells wholly in or out of both solids; the rest, with what is known of them as
        marks.
        """
        points = centre(cells.numbers, cells.level, self.unit)
        reach = math.sqrt(3) / 2 * self.unit * (1 << cells.level) + self.slack
        t, pairs_t = verdicts(self.target, points, cells.pairs[:unions], reach)
        v, pairs_v = verdicts(self.seen, points, cells.pairs[unions:], reach)
        t = np.where(cells.mark & _IN_TARGET, -1, t)
        v = np.where(cells.mark & _SEEN, -1, v)
        one = np.ones(np.count_nonzero((t < 0) & (v != 0)))
        seen = (v[(t < 0) & (v != 0)] < 0) * one
        tally.add(
            VolumeFraction(seen, seen),
            VolumeFraction(one - seen, one - seen),
            (self.unit * (1 << cells.level)) ** 3,
            cells.level,
        )
        mark = (np.where(t < 0, _IN_TARGET, 0) | np.where(v < 0, _SEEN, 0)).astype(np.int8)
        pairs = (*(_unless(t < 0, p) for p in pairs_t), *(_unless(v < 0, p) for p in pairs_v))
        return cells.left(pairs, mark).only((t == 0) | ((t < 0) & (v == 0)))

    def _settle(self, cells: Cells, unions: int, tally: _Tally) -> Cells:
        """Settle the cells whose shares are known well enough; the rest are to be split."""
        side = self.unit * (1 << cells.level)
        volume = side**3
        if volume > _WORTH * self.threshold and cells.level > 0:
            return cells
        points = centre(cells.numbers, cells.level, self.unit)
        t = self._shares(
            self.target, points, cells.pairs[:unions], side, (cells.mark & _IN_TARGET) > 0
        )
        v = self._shares(self.seen, points, cells.pairs[unions:], side, (cells.mark & _SEEN) > 0)
        covered, uncovered = t & v, t & -v
        open_ = (1 - self.zeta) * (covered.high - covered.low) + self.zeta * (
            uncovered.high - uncovered.low
        )
        split = (volume * open_ > self.threshold) & (cells.level > 0)
        done = ~split
        tally.add(covered.only(done), uncovered.only(done), volume, cells.level)
        return cells.only(split)

    def _shares(
        self,
        solid: Solid,
        points: Float[np.ndarray, "M 3"],
        pairs: tuple[tuple[np.ndarray, np.ndarray], ...],
        side: float,
        inside: np.ndarray,
    ) -> VolumeFraction:
        cubes, unions = len(points), []
        for parts, (cell, index) in zip(leaves(solid), pairs, strict=True):
            union = VolumeFraction(np.zeros(cubes), np.zeros(cubes))
            if len(cell):
                union = parts.shares(rows(points, cell), cell, index, cubes, side, self.slack)
            unions.append(union)
        share = fold(solid, unions, LOGIC)
        return VolumeFraction(np.where(inside, 1.0, share.low), np.where(inside, 1.0, share.high))


def _unless(
    known: Bool[np.ndarray, " M"], pairs: tuple[Int[np.ndarray, " P"], Int[np.ndarray, " P"]]
) -> tuple[Int[np.ndarray, " Q"], Int[np.ndarray, " Q"]]:
    """The pairs of cells of which it is not known."""
    keep = ~known[pairs[0]]
    return pairs[0][keep], pairs[1][keep]


def _run(work: _Pass, start: Cells, cells: int) -> _Tally:
    """One pass after one of so many cells, in shares that are the same on every machine, so that
    sums round alike.
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
    total = _Tally()
    for tally in tallies:
        total.join(tally)
    return total


def _step(width: float, wanted: float) -> float:
    """Factor on the threshold: the interval falls about with its square root; aim a little below,
    and go no more than a hundredth at once."""
    return min(max((0.8 * wanted / width) ** 2, 0.01), 0.5)


def bracket(
    target: Solid,
    seen: Solid,
    width: float = 0.0,
    voxel: float | None = None,
    tell: Callable[[Bracket], None] = lambda bracket: None,
) -> Bracket:
    """Bounds of the share of ``target`` that lies in ``seen``.

    Args:
        target, seen: solids.
        width: of the interval asked for, in [0, 1]; 0 asks for every cell of side ``voxel``.
        voxel: side below which no cell is split, m; None: a millionth of the scene.
        tell: is given the interval after each pass. Ctrl-C ends the work with the last interval,
            ``reached`` False.

    Raises:
        ValueError: if the target is empty, or neither width nor voxel bounds the work.
    """
    if not width > 0 and voxel is None:
        raise ValueError("a guaranteed interval needs a width to reach or a voxel to stop at")
    keep_freed_memory()
    box = target.bounds()
    size = float(np.ptp(box, axis=0).max())
    if not size > 0:
        raise ValueError("the target is empty: its box has no volume")
    furthest = float(np.abs(box).max())  # the lattice ends at 2^19 units from the origin
    unit = voxel if voxel is not None else max(size, 1.001 * furthest) / 2.0**_LEVELS
    slack = SLACK * max(scale(target), scale(seen))
    start = first_cells(leaves(target) + leaves(seen), box, unit, 0)
    volume = float(np.prod(np.ptp(box, axis=0)))
    threshold = width * volume / 100 if width > 0 else 0.0
    work = _Pass(target, seen, unit, threshold, 0.5, slack, threading.Event())
    found: Bracket | None = None
    for passes in itertools.count(1):
        try:
            tally = _run(work, start, found.cells if found else 0)
            before, found = found, tally.bracket(passes, unit, width)
            if found.volume_low == 0 and found.volume_high < _EMPTY * volume:
                raise ValueError(
                    "the target is empty or too thin to tell: nothing is certain to lie in it"
                )
            tell(found)
        except KeyboardInterrupt:
            if found is None:
                raise
            return found
        stuck = before is not None and tally.level == 0 and found.width > 0.99 * before.width
        if found.reached or not threshold > 0 or stuck:
            return found
        zeta = min(max((found.low + found.high) / 2, 0.05), 0.95)
        work = replace(work, zeta=zeta, threshold=work.threshold * _step(found.width, width))
    raise AssertionError("unreachable")
