"""The largest object that is unseen in a target, between proved bounds.

The largest room of any place (``object_room``) lies between the largest of the lower and of the
upper bounds. Branch and bound halves only the cells whose upper bound exceeds the largest lower
bound, and the open cells within that distance of them. Before, a dive halves a few of them to the
end, for a large lower bound.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from .cell_space import BLOCKED, FREE, FREE_AT_CENTRE, OpenCells, halves
from .object_room import EXACT, ObjectShape, TargetCells, UnseenSpace
from .voxel_set import centre, encode

_RELATIVE = 0.04  # of the lower bound: a difference of the bounds that is always small enough
_MOST_PLACES, _MOST_CELLS = 20_000, 50_000  # cells on a level, before their halves are examined
_TRIED = 128  # places of a level whose lower bounds are computed: of the largest upper bounds
_FEW = 8  # places of a dive of the largest upper bounds, and as many of the largest lower ones


@dataclass(frozen=True)
class LargestObject:
    """The largest unseen object of a shape, between bounds."""

    low: float
    """Radius of an object that is unseen, m; 0: there is none."""
    high: float
    """No object of a larger radius is unseen, m; at the limit of the space: not bounded."""
    centre: Float[np.ndarray, " 3"] | None
    """Centre of the object of radius ``low``, m; None: there is none."""
    side: float
    """Side of the smallest cells, m."""


def largest_object(
    grid: TargetCells, shape: ObjectShape, width: float, limit: float | None = None
) -> LargestObject:
    """Return the largest unseen object between bounds of its radius.

    Args:
        grid: cells of one level about a target; a rod is longer than their side.
        shape: the object.
        width: requested difference of the bounds, m; of a large object, 4 % of its radius. It is
            missed where very many places have almost the same room.
        limit: a radius, m: the work also ends once the largest one is above it for sure, or not.

    Raises:
        ValueError: for a rod that is not longer than a cell.
    """
    side = grid.cells.side
    if shape.length is not None and not shape.length > side:
        raise ValueError(f"a rod of {shape.length:g} m is not longer than cells of {side:g} m")
    search = _Search.of(grid, shape)
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
    least: Float[np.ndarray, " N"]
    """Lower bound of r at the centre of each, m; 0 where none was computed."""
    state: Int[np.ndarray, " N"]
    """State of each of these cells as part of the target."""
    open: OpenCells
    """The open cells that may limit r there."""

    @staticmethod
    def of(grid: TargetCells, shape: ObjectShape) -> "_Search":
        """Return the search at the level of a grid."""
        low, high = grid.room(shape)
        cells = grid.cells
        at = np.unravel_index(int(np.argmax(low)), low.shape)
        least, most = float(low[at]), float(high.max())
        place = cells.centres(np.array([at]))[0] if least > 0 else None
        may, side = high > least, cells.side
        near = np.zeros_like(may)
        if may.any():
            reach = most + 2 * shape.half_diagonal * side
            near = shape.field(may, side, shape.height(2 * side)) <= reach
        open_ = cells.open.only(near[tuple((cells.open.cells.numbers - cells.first).T)])
        best = LargestObject(least, most, place, side)
        state = grid.place[may]
        places = np.argwhere(may) + cells.first
        return _Search(grid.space, shape, best, places, high[may], low[may], state, open_)

    @property
    def can_halve(self) -> bool:
        """Whether cells can be halved, and are few enough."""
        few = 0 < len(self.places) <= _MOST_PLACES and len(self.open) <= _MOST_CELLS
        return self.open.cells.level > 0 and few

    def selected(self, keep: Bool[np.ndarray, " N"]) -> "_Search":
        """Return the search among some of its places, with all open cells."""
        each = (values[keep] for values in (self.places, self.most, self.least, self.state))
        places, most, least, state = each
        return replace(self, places=places, most=most, least=least, state=state)

    def only(self, keep: Bool[np.ndarray, " N"]) -> "_Search":
        """Return the search among some of its places, with the open cells that matter to them."""
        some = self.selected(keep)
        if keep.all() or not keep.any():
            return some
        side, shape = self.best.side, self.shape
        reach = float(some.most.max()) + shape.half_diagonal * side
        centres, cells = self._at(some.places), self._at(self.open.cells.numbers)
        near = shape.nearest(cells, centres, shape.height(2 * side)) <= reach
        return replace(some, open=self.open.only(near))

    def _at(self, numbers: Int[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        return centre(numbers, self.open.cells.level, self.space.space.unit)

    def halved(self) -> "_Search":
        """Return the search with halves of its cells; its bounds hold for its places alone."""
        open_, blocked = self.space.space.halved(self.open)
        places = halves(self.places)
        most, state = np.repeat(self.most, 8), np.repeat(self.state, 8)
        finer = replace(self, places=places, most=most, least=0.0 * most, state=state, open=open_)
        finer = finer.selected(~np.isin(encode(places << open_.cells.level), blocked)).in_target()
        centres, cells = finer._at(finer.places), finer._at(open_.cells.numbers)
        shape, side, best = self.shape, self.best.side / 2, self.best
        half = shape.half_diagonal * side
        sure = shape.nearest(centres, cells[open_.at_centre], shape.height(-side) + EXACT)
        most = np.minimum(sure + half, finer.most)
        first = finer.centred(most)[:_TRIED]
        low = shape.nearest(centres[first], cells, shape.height(side) - EXACT) - half
        low[self.space.space.states(finer.places[first], open_.cells.level) != FREE] = 0.0
        least = finer.least.copy()
        least[first] = np.clip(low, 0.0, self.space.limit(shape))
        i = int(np.argmax(least)) if len(least) else 0
        if len(least) and least[i] > best.low:
            best = replace(best, low=float(least[i]), centre=centres[i])
        high = min(max(float(most.max(initial=0.0)), best.low), best.high)
        best = replace(best, high=high, side=side)
        return replace(finer, best=best, most=most, least=least).above(best.low)

    def in_target(self) -> "_Search":
        """Return the search among the places of which some point may lie in the target."""
        state, edge = self.state.copy(), self.state != FREE
        state[edge] = self.space.places.states(self.places[edge], self.open.cells.level)
        return replace(self, state=state).selected(state != BLOCKED)

    def centred(self, most: Float[np.ndarray, " N"]) -> Int[np.ndarray, " M"]:
        """Return the places of which the centre lies in the target for sure, those of the largest
        upper bounds first."""
        order = np.argsort(-most, kind="stable")
        return order[self.state[order] <= FREE_AT_CENTRE]

    def above(self, low: float) -> "_Search":
        """Return the search among the places of which r may exceed ``low`` m."""
        return self.only(self.most > low)

    def few(self) -> "_Search":
        """Return the search among those of its places that have the largest bounds, and a centre
        in the target if there are any."""
        first = self.centred(self.most)
        if not len(first):
            first = np.argsort(-self.most, kind="stable")
        keep = np.zeros(len(self.places), bool)
        keep[first[:_FEW]] = True
        keep[np.argsort(-self.least, kind="stable")[:_FEW]] = True
        return self.only(keep)

    def dive(self, width: float) -> "_Search":
        """Return the search with the largest object found among a few places, down to bounds that
        differ by ``width`` m there."""
        deep = self.few()
        while deep.can_halve and float(deep.most.max()) - deep.best.low > width:
            deep = deep.halved().few()
        best = replace(self.best, low=deep.best.low, centre=deep.best.centre)
        return replace(self, best=best).above(best.low)
