"""The largest object that fits into the unseen part of a target, between proved bounds.

An object is a ball, or a vertical rod of a stated length. The room r(c) of a place c is the largest
radius of an object about c that lies in the target and that no sensor sees. Cells are free, open or
blocked (``unseen_cells``), which bounds r from both sides:

- An object about the centre c of a free cell that keeps clear of all open cells is unseen: r(c) is
  at least the distance of c from the nearest of them. (Blocked cells lie behind open ones.)
- An object about c that reaches a blocked point is none: r(c) is at most the distance of c from any
  blocked point. For any other place in the cell about c it is at most half a cell's diagonal more.

The largest r lies between the largest of the lower and of the upper bounds. Branch and bound halves
only the cells whose upper bound exceeds the largest lower bound, and the open cells within that
distance of them. Before, a dive halves a few of them to the end, for a large lower bound.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from .inscribed_balls import distances
from .unseen_cells import AT_CENTRE, BLOCKED, FREE, CellGrid, OpenCells, UnseenSpace, halves
from .voxel_set import centre

_RELATIVE = 0.04  # of the lower bound: a difference of the bounds that is always small enough
_MOST_PLACES, _MOST_CELLS = 20_000, 50_000  # cells on a level, before their halves are examined
_TRIED = 64  # places of a level whose lower bounds are computed: those of the largest upper bounds
_FEW = 16  # places of a dive
_LEAF = 64  # points in a leaf of a tree, for points that are almost equally near
_EXACT = 1e-9  # m, by which ends of a rod may miss a layer of cells through rounding


@dataclass(frozen=True)
class ObjectShape:
    """A ball, or a vertical rod."""

    length: float | None = None
    """Length of the rod, m; None: a ball."""

    @property
    def half_diagonal(self) -> float:
        """Half the diagonal of a cell of side 1 in the directions of the radius."""
        return math.sqrt(3 if self.length is None else 2) / 2

    def height(self, cells: float) -> float:
        """Return half the length of a rod that is longer by ``cells`` m; infinity for a ball."""
        return math.inf if self.length is None else (self.length + cells) / 2

    def field(
        self, blocked: Bool[np.ndarray, "X Y Z"], side: float, height: float
    ) -> Float[np.ndarray, "X Y Z"]:
        """Return the distance of each cell's centre from the nearest blocked one, m.

        For a rod it is the horizontal distance from those at most ``height`` m above or below. The
        grid has a rim of blocked cells; ``side`` is that of a cell, m.
        """
        if self.length is None:
            return side * distances(~blocked)
        from scipy.ndimage import maximum_filter1d

        layers = 2 * math.floor(height / side) + 1
        blocked = maximum_filter1d(blocked.view(np.uint8), layers, axis=2, mode="constant") > 0
        return side * distances(~blocked, flat=True)

    def nearest(
        self, centres: Float[np.ndarray, "N 3"], points: Float[np.ndarray, "M 3"], height: float
    ) -> Float[np.ndarray, " N"]:
        """Return the same distance of centres from points; infinity where there is no point."""
        from scipy.spatial import cKDTree

        distance = np.full(len(centres), np.inf)
        if self.length is None:
            return cKDTree(points, _LEAF).query(centres)[0] if len(points) else distance
        points = points[np.argsort(points[:, 2])]
        for z in np.unique(centres[:, 2]):
            low, high = np.searchsorted(points[:, 2], [z - height, z + height])
            if low < high:
                layer = centres[:, 2] == z
                tree = cKDTree(points[low:high, :2], _LEAF)
                distance[layer] = tree.query(centres[layer, :2])[0]
        return distance


BALL = ObjectShape()


@dataclass(frozen=True)
class LargestObject:
    """The largest unseen object of a shape, between bounds."""

    low: float
    """Radius of an object that is unseen, m; 0: there is none."""
    high: float
    """No object of a larger radius is unseen, m."""
    centre: Float[np.ndarray, " 3"] | None
    """Centre of the object of radius ``low``, m; None: there is none."""
    side: float
    """Side of the smallest cells, m."""


def room(grid: CellGrid, shape: ObjectShape) -> Float[np.ndarray, "2 X Y Z"]:
    """Return a lower bound of r at the centre of each cell of a grid, and an upper bound for all
    places in the cell, m; both are 0 in a blocked cell."""
    side, half = grid.side, shape.half_diagonal * grid.side
    low = shape.field(grid.state != FREE, side, shape.height(side) - _EXACT) - half
    high = shape.field(grid.state >= AT_CENTRE, side, shape.height(-side) + _EXACT) + half
    return np.stack([np.maximum(low, 0.0), np.where(grid.state == BLOCKED, 0.0, high)])


def largest_object(
    space: UnseenSpace,
    grid: CellGrid,
    shape: ObjectShape,
    width: float,
    limit: float | None = None,
) -> LargestObject:
    """Return the largest unseen object between bounds of its radius.

    Args:
        space: the unseen space.
        grid: its cells of one level; a rod is longer than their side.
        shape: the object.
        width: requested difference of the bounds, m; of a large object, 4 % of its radius. It is
            missed where very many places have almost the same room.
        limit: a radius, m: the work also ends once the largest one is above it for sure, or not.

    Raises:
        ValueError: for a rod that is not longer than a cell.
    """
    if shape.length is not None and not shape.length > grid.side:
        raise ValueError(f"a rod of {shape.length:g} m is not longer than cells of {grid.side:g} m")
    search = _Search.of(space, grid, shape)
    while True:
        search = search.dive(width)
        best = search.best
        decided = limit is not None and (best.low > limit or best.high <= limit)
        enough = max(width, _RELATIVE * best.low)
        if decided or best.high - best.low <= enough or not search.can_halve:
            return best
        search = search.halved()


@dataclass(frozen=True)
class _Search:
    """One level of the branch and bound."""

    space: UnseenSpace
    shape: ObjectShape
    best: LargestObject
    """The bounds so far."""
    places: Int[np.ndarray, "N 3"]
    """Lattice numbers of the cells that may hold the centre of a larger object."""
    most: Float[np.ndarray, " N"]
    """Upper bound of r in each of these cells, m."""
    open: OpenCells
    """The open cells that may limit r there."""

    @staticmethod
    def of(space: UnseenSpace, grid: CellGrid, shape: ObjectShape) -> "_Search":
        """Return the search at the level of a grid."""
        low, high = room(grid, shape)
        at = np.unravel_index(int(np.argmax(low)), low.shape)
        least, most = float(low[at]), float(high.max())
        place = grid.centres(np.array([at]))[0] if least > 0 else None
        may, side = high > least, grid.side
        near = np.zeros_like(may)
        if may.any():
            reach = most + 2 * shape.half_diagonal * side
            near = shape.field(may, side, shape.height(2 * side)) <= reach
        open_ = grid.open.only(near[tuple((grid.open.cells.numbers - grid.first).T)])
        best = LargestObject(least, most, place, side)
        return _Search(space, shape, best, np.argwhere(may) + grid.first, high[may], open_)

    @property
    def can_halve(self) -> bool:
        """Whether cells can be halved, and are few enough."""
        few = 0 < len(self.places) <= _MOST_PLACES and len(self.open) <= _MOST_CELLS
        return self.open.cells.level > 0 and few

    def only(self, keep: Bool[np.ndarray, " N"]) -> "_Search":
        """Return the search among some of its places."""
        if keep.all() or not keep.any():
            return replace(self, places=self.places[keep], most=self.most[keep])
        side, shape = self.best.side, self.shape
        places, most = self.places[keep], self.most[keep]
        reach = float(most.max()) + shape.half_diagonal * side
        centres, cells = self._at(places), self._at(self.open.cells.numbers)
        near = shape.nearest(cells, centres, shape.height(2 * side)) <= reach
        return replace(self, places=places, most=most, open=self.open.only(near))

    def _at(self, numbers: Int[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        return centre(numbers, self.open.cells.level, self.space.unit)

    def halved(self) -> "_Search":
        """Return the search with halves of its cells; its bounds hold for its places alone."""
        open_ = self.space.halved(self.open)
        most = np.repeat(self.most, 8)
        finer = replace(self, places=halves(self.places), most=most, open=open_)
        centres, cells = finer._at(finer.places), finer._at(open_.cells.numbers)
        shape, side, best = self.shape, self.best.side / 2, self.best
        half = shape.half_diagonal * side
        sure = shape.nearest(centres, cells[open_.at_centre], shape.height(-side) + _EXACT)
        most = np.minimum(sure + half, most)
        first = np.argsort(-most)[:_TRIED]
        least = shape.nearest(centres[first], cells, shape.height(side) - _EXACT) - half
        least[~self.space.free(finer.places[first], open_.cells.level)] = 0.0
        i = int(np.argmax(least))
        if least[i] > best.low:
            best = replace(best, low=float(least[i]), centre=centres[first[i]])
        high = min(max(float(most.max()), best.low), best.high)
        return replace(finer, best=replace(best, high=high, side=side), most=most).above(best.low)

    def above(self, low: float) -> "_Search":
        """Return the search among the places of which r may exceed ``low`` m."""
        return self.only(self.most > low)

    def few(self) -> "_Search":
        """Return the search among those of its places that have the largest upper bounds."""
        keep = np.zeros(len(self.places), bool)
        keep[np.argsort(-self.most, kind="stable")[:_FEW]] = True
        return self.only(keep)

    def dive(self, width: float) -> "_Search":
        """Return the search with the largest object found among a few places, down to bounds that
        differ by ``width`` m there."""
        deep = self.few()
        while deep.can_halve and float(deep.most.max()) - deep.best.low > width:
            deep = deep.halved().few()
        best = replace(self.best, low=deep.best.low, centre=deep.best.centre)
        return replace(self, best=best).above(best.low)
