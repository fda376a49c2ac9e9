"""The room of many places, each between proved bounds (``object_room``)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .cell_space import BLOCKED, FREE, FREE_AT_CENTRE, OpenCells
from .object_room import EXACT, ObjectShape, TargetCells, UnseenSpace
from .voxel_set import centre

_MOST_CELLS = 1_500_000  # open cells, of which halves are about four times as many
_MOST_PLACES = 20_000


@dataclass(frozen=True)
class ObjectMap:
    """The open cells of a target's surroundings, as fine as a bounded cost allows."""

    space: UnseenSpace
    open: OpenCells

    @staticmethod
    def of(grid: TargetCells) -> "ObjectMap":
        """Return the map of a target, from its cells of one level."""
        open_ = grid.cells.open
        while open_.cells.level > 0 and 4 * len(open_) <= _MOST_CELLS:
            open_, _ = grid.space.space.halved(open_)
        return ObjectMap(grid.space, open_)

    def room(
        self, points: Float[np.ndarray, "N 3"], shape: ObjectShape
    ) -> Float[np.ndarray, "2 N"]:
        """Return a lower and an upper bound of r at places of the target, m."""
        side = self.space.space.unit * (1 << self.open.cells.level)
        cells = centre(self.open.cells.numbers, self.open.cells.level, self.space.space.unit)
        state = self.space.space.states_at(points)
        low = shape.nearest(points, cells, shape.height(side) - EXACT)
        high = shape.nearest(points, cells[self.open.at_centre], shape.height(-side) + EXACT)
        low = np.where(state == FREE, low - shape.half_diagonal * side, 0.0)
        high = np.where(state == BLOCKED, 0.0, high)
        room: np.ndarray = np.clip(np.stack([low, high]), 0.0, self.space.limit(shape))
        return room


def places(grid: TargetCells) -> Float[np.ndarray, "N 3"]:
    """Return places of a target on a cubic lattice: its cells' centres, or some of them, m."""
    inside, step = grid.place <= FREE_AT_CENTRE, 1
    while np.count_nonzero(inside[::step, ::step, ::step]) > _MOST_PLACES:
        step += 1
    return grid.cells.centres(step * np.argwhere(inside[::step, ::step, ::step]))
