"""Cells of the part of a solid that another one leaves, with states that are proved.

A cell is *free* if all of it belongs to the part, and *blocked* if no point of it does. Both are
proved by the octree's test of a cell (``cell_classification``). Of the other cells, which are open,
the centre may be proved to be free or blocked. A free and a blocked cell never touch, as their
common points would be both: between them there are open cells.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ..solids.base import Solid, leaves
from .cell_classification import SLACK, scale, target_verdicts
from .octree_cells import CHILD, Cells, first_cells, joined
from .voxel_set import centre, encode

FREE, FREE_AT_CENTRE, OPEN, BLOCKED_AT_CENTRE, BLOCKED = -2, -1, 0, 1, 2
"""States of a cell: free, open with a free centre, open, open with a blocked centre, blocked."""
_PAIRS = 1 << 17  # pairs of cell and part processed at once


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
    """States of all cells of one level in the box of a solid, with a rim of blocked cells."""

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
class CellSpace:
    """The part of a solid that another one leaves."""

    solid: Solid
    """The solid."""
    without: Solid
    """What does not belong to the part; of solids that have bounds only, such as occluded beams,
    a point counts as inside for sure or as undecided."""
    unit: float
    """Side of a cell of level 0, m."""

    @property
    def _slack(self) -> float:
        """Rounding error of the implicit functions, m."""
        return SLACK * max(scale(self.solid), scale(self.without))

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
            state[state == OPEN] = np.sign(inner)  # FREE_AT_CENTRE, OPEN or BLOCKED_AT_CENTRE
        return state, rest

    def _states(
        self, cells: Cells, points: Float[np.ndarray, "M 3"], reach: float
    ) -> tuple[Int[np.ndarray, " M"], Cells]:
        t, v, marked = target_verdicts(self.solid, self.without, cells, points, reach)
        free, blocked = (t < 0) & (v > 0), (t > 0) | (v < 0)
        return np.where(free, FREE, np.where(blocked, BLOCKED, OPEN)).astype(np.int8), marked

    def states(self, numbers: Int[np.ndarray, "N 3"], level: int) -> Int[np.ndarray, " N"]:
        """Return the states of cells of a level, by their lattice numbers."""
        parts = self._paired(numbers, level)
        return np.concatenate([np.zeros(0, np.int8), *(self.settle(part)[0] for part in parts)])

    def states_at(self, points: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
        """Return whether points m are free, blocked, or on the edge (open)."""
        state, first = np.zeros(len(points), np.int8), 0
        for part in self._paired(np.zeros((len(points), 3), np.int64), 0):
            some = slice(first, first + len(part))
            state[some] = self._states(part, points[some], self._slack)[0]
            first += len(part)
        return state

    def _paired(self, numbers: Int[np.ndarray, "N 3"], level: int) -> Iterator[Cells]:
        """Yield cells, paired with all parts, a few at a time."""
        unions = [*leaves(self.solid), *leaves(self.without)]
        most = max(_PAIRS // max(sum(map(len, unions)), 1), 1)
        for start in range(0, len(numbers), most):
            some = numbers[start : start + most]
            n, mark = len(some), np.zeros(len(some), np.int64)
            pairs = tuple(
                (np.repeat(np.arange(n), len(parts)), np.tile(np.arange(len(parts)), n))
                for parts in unions
            )
            yield Cells(level, some, encode(some << level), mark, pairs)

    def grid(self, level: int) -> CellGrid:
        """Return the states of all cells of a level."""
        unions = [*leaves(self.solid), *leaves(self.without)]
        cells = first_cells(unions, self.solid.bounds(), self.unit, 0, level)
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
                at_centre = state[tuple((open_.numbers - first).T)] == BLOCKED_AT_CENTRE
                return CellGrid(state, first, self.unit * (1 << level), OpenCells(open_, at_centre))
            cells, first = open_.children(), 2 * first + 1  # the rim stays as thick as a cell
            for axis in range(3):
                state = state.repeat(2, axis=axis)
            state = state[1:-1, 1:-1, 1:-1]

    def halved(self, open_: OpenCells) -> tuple[OpenCells, Int[np.ndarray, " M"]]:
        """Return those halves of open cells that are open, and the first keys of blocked ones."""
        rest, at_centre, blocked = list[Cells](), list[np.ndarray](), list[np.ndarray]()
        for part in open_.cells.children().slices(_PAIRS):
            state, left = self.settle(part)
            rest.append(left)
            at_centre.append(state[(state != FREE) & (state != BLOCKED)] == BLOCKED_AT_CENTRE)
            blocked.append(part.key[state == BLOCKED])
        return OpenCells(joined(rest), np.concatenate(at_centre)), np.concatenate(blocked)


def halves(numbers: Int[np.ndarray, "N 3"]) -> Int[np.ndarray, "M 3"]:
    """Return the lattice numbers of the eight halves of each cell."""
    return (2 * numbers[:, None] + CHILD).reshape(-1, 3)
