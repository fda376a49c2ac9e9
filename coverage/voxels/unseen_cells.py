"""Cells of a target that no sensor sees, proved by the implicit functions of target and beams.

A cell is *free* if all of it lies in the target and no sensor sees any of it, and *blocked* if no
point of it is so. Both are proved, by the octree's test of a cell (``cell_classification``). Of the
other cells, which are open, only the centre may be proved to be blocked. A free and a blocked cell
never touch, as their common points would be both: between them there are open cells.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ..solids.base import Solid, leaves
from .cell_classification import SLACK, scale, target_verdicts
from .octree_cells import CHILD, Cells, first_cells, joined
from .voxel_set import OFFSET, centre, encode

FREE, OPEN, AT_CENTRE, BLOCKED = -1, 0, 1, 2
"""States of a cell: free, open, open with a blocked centre, blocked."""
_PAIRS = 1 << 17  # pairs of cell and part processed at once
_MARGIN = 1.001  # by which the lattice exceeds the solids


@dataclass(frozen=True)
class OpenCells:
    """Open cells of one level."""

    cells: Cells
    """The cells."""
    at_centre: Bool[np.ndarray, " M"]
    """Whether the centre of each is blocked."""

    def __len__(self) -> int:
        return len(self.cells)

    def only(self, keep: Bool[np.ndarray, " M"]) -> "OpenCells":
        """Return the selected cells."""
        return OpenCells(self.cells.only(keep), self.at_centre[keep])


@dataclass(frozen=True)
class CellGrid:
    """States of all cells of one level in the box of a target, with a rim of blocked cells."""

    state: Int[np.ndarray, "X Y Z"]
    """State of each cell."""
    first: Int[np.ndarray, " 3"]
    """Lattice number of the first cell."""
    side: float
    """Side of a cell, m."""
    open: OpenCells
    """The open cells."""

    def centres(self, numbers: Int[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Return the centres (N, 3) m of cells by their places in the grid."""
        level = self.open.cells.level
        return centre(numbers + self.first, level, self.side / (1 << level))


@dataclass(frozen=True)
class UnseenSpace:
    """The part of a target that no sensor sees."""

    target: Solid
    """The target: where objects may be."""
    seen: Solid
    """What the sensors see; where it has bounds only, a point counts as seen for sure or not."""
    unit: float
    """Side of a cell of level 0, m."""

    @staticmethod
    def of(target: Solid, seen: Solid, side: float, levels: int) -> "UnseenSpace":
        """Return the space with cells of ``side`` m that can be halved up to ``levels`` times."""
        furthest = float(np.abs(target.bounds()).max()) * _MARGIN
        return UnseenSpace(target, seen, max(side / 2.0**levels, furthest / (OFFSET / 2)))

    @property
    def _slack(self) -> float:
        """Rounding error of the implicit functions, m."""
        return SLACK * max(scale(self.target), scale(self.seen))

    def settle(self, cells: Cells) -> tuple[Int[np.ndarray, " M"], Cells]:
        """Return the state of each cell, and the open ones."""
        if len(cells) == 0:
            return np.zeros(0, np.int8), cells
        points = centre(cells.numbers, cells.level, self.unit)
        reach = math.sqrt(3) / 2 * self.unit * (1 << cells.level) + self._slack
        state, marked = self._states(cells, points, reach)
        rest = marked.only(state == OPEN)
        if len(rest):
            inner, _ = self._states(rest, points[state == OPEN], self._slack)
            state[state == OPEN] = np.where(inner == BLOCKED, AT_CENTRE, OPEN)
        return state, rest

    def _states(
        self, cells: Cells, points: Float[np.ndarray, "M 3"], reach: float
    ) -> tuple[Int[np.ndarray, " M"], Cells]:
        t, v, marked = target_verdicts(self.target, self.seen, cells, points, reach)
        free, blocked = (t < 0) & (v > 0), (t > 0) | (v < 0)
        return np.where(free, FREE, np.where(blocked, BLOCKED, OPEN)).astype(np.int8), marked

    def free(self, numbers: Int[np.ndarray, "N 3"], level: int) -> Bool[np.ndarray, " N"]:
        """Return which cells of a level are free, by their lattice numbers."""
        n, mark = len(numbers), np.zeros(len(numbers), np.int64)
        pairs = tuple(
            (np.repeat(np.arange(n), len(parts)), np.tile(np.arange(len(parts)), n))
            for parts in [*leaves(self.target), *leaves(self.seen)]
        )
        cells = Cells(level, numbers, encode(numbers << level), mark, pairs)
        return np.concatenate([self.settle(part)[0] == FREE for part in cells.slices(_PAIRS)])

    def grid(self, level: int) -> CellGrid:
        """Return the states of all cells of a level."""
        unions = [*leaves(self.target), *leaves(self.seen)]
        cells = first_cells(unions, self.target.bounds(), self.unit, 0, level)
        first = cells.numbers.min(axis=0) - 1
        state = np.full(cells.numbers.max(axis=0) - first + 2, BLOCKED, np.int8)
        while True:
            rest = list[Cells]()
            for part in cells.slices(_PAIRS):
                known, left = self.settle(part)
                state[tuple((part.numbers - first).T)] = known
                rest.append(left)
            open_ = joined(rest)
            if open_.level == level:
                at_centre = state[tuple((open_.numbers - first).T)] == AT_CENTRE
                return CellGrid(state, first, self.unit * (1 << level), OpenCells(open_, at_centre))
            cells, first = open_.children(), 2 * first + 1  # the rim stays as thick as a cell
            for axis in range(3):
                state = state.repeat(2, axis=axis)
            state = state[1:-1, 1:-1, 1:-1]

    def halved(self, open_: OpenCells) -> OpenCells:
        """Return those halves of open cells that are open."""
        rest, at_centre = list[Cells](), list[np.ndarray]()
        for part in open_.cells.children().slices(_PAIRS):
            state, left = self.settle(part)
            rest.append(left)
            at_centre.append(state[(state == OPEN) | (state == AT_CENTRE)] == AT_CENTRE)
        return OpenCells(joined(rest), np.concatenate(at_centre))


def halves(numbers: Int[np.ndarray, "N 3"]) -> Int[np.ndarray, "M 3"]:
    """Return the lattice numbers of the eight halves of each cell."""
    return (2 * numbers[:, None] + CHILD).reshape(-1, 3)
