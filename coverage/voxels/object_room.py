"""The room of each place: the largest radius of an unseen object about it, between proved bounds.

An object is a ball, or a vertical rod of a stated length. The room r(c) of a place c of a target is
the largest radius of an object about c that reaches into no body and that no sensor sees; it may
stick out of the target. Cells of what bodies and sensors leave are free, open or blocked
(``cell_space``), which bounds r from both sides:

- An object about the centre c of a free cell that keeps clear of all open cells is unseen: r(c) is
  at least the distance of c from the nearest of them. (Blocked cells lie behind open ones.)
- An object about c that reaches a blocked point is none: r(c) is at most the distance of c from any
  blocked point. For any other place in the cell about c it is at most half a cell's diagonal more.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ..solids.base import Difference, Solid
from ..solids.polyhedra import box, polyhedra
from ..solids.spheres import Spheres
from .cell_space import BLOCKED, BLOCKED_AT_CENTRE, FREE, FREE_AT_CENTRE, CellGrid, CellSpace
from .inscribed_balls import distances
from .voxel_set import OFFSET

NOTHING = Spheres(np.zeros((0, 3)), np.zeros(0))
"""A solid without a point."""
_MARGIN = 1.001  # by which the lattice exceeds the solids
_LEAF = 64  # points in a leaf of a tree, for points that are almost equally near
EXACT = 1e-9  # m, by which ends of a rod may miss a layer of cells through rounding


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
class UnseenSpace:
    """What bodies and sensors leave around the places of a target."""

    places: CellSpace
    """The target: where the centre of an object may be."""
    space: CellSpace
    """Where an object may be unseen: a box about the target, less bodies and what sensors see."""
    most: float
    """Radius above which objects are not told apart, m."""
    most_ball: float
    """Largest distance of a place from the bodies, m, or infinity: no ball is larger."""

    @staticmethod
    def about(
        places: Solid,
        bodies: Solid,
        seen: Solid,
        side: float,
        levels: int,
        most: float = 0.5,
        length: float = 0.0,
        most_ball: float = math.inf,
    ) -> "UnseenSpace":
        """Return the space about a target.

        Args:
            places: the target.
            bodies: where no object may be.
            seen: what the sensors see; where it has bounds only, a point counts as seen for sure
                or not.
            side: side of the cells with which work starts, m.
            levels: times by which they can be halved.
            most: radius above which objects are not told apart, m.
            length: length of the longest rod, m.
            most_ball: largest distance of a place from the bodies, m; infinity where not known.
        """
        low, high = places.bounds()
        rim = np.array([most, most, max(most, length / 2)]) + 2 * side
        around = box((low + high) / 2, high - low + 2 * rim)
        room = polyhedra((around,), np.stack([low - rim, high + rim]))
        furthest = float(np.abs(room.bounds()).max()) * _MARGIN
        unit = max(side / 2.0**levels, furthest / (OFFSET / 2))
        objects = CellSpace(Difference(room, bodies), seen, unit)
        return UnseenSpace(CellSpace(places, NOTHING, unit), objects, most, most_ball)

    def limit(self, shape: ObjectShape) -> float:
        """Return the radius above which objects of a shape are not told apart or do not exist."""
        return self.most if shape.length is not None else min(self.most, self.most_ball)

    def grid(self, level: int) -> "TargetCells":
        """Return the states of all cells of a level."""
        grid, target = self.space.grid(level), self.places.grid(level)
        state = np.full_like(grid.state, BLOCKED)
        places = np.argwhere(target.state != BLOCKED)
        at = places + target.first - grid.first
        within = ((at >= 0) & (at < state.shape)).all(axis=1)
        state[tuple(at[within].T)] = target.state[tuple(places[within].T)]
        return TargetCells(self, grid, state)


@dataclass(frozen=True)
class TargetCells:
    """Cells of one level about a target."""

    space: UnseenSpace
    cells: CellGrid
    """Cells of what bodies and sensors leave."""
    place: Int[np.ndarray, "X Y Z"]
    """State of each cell as part of the target."""

    def room(self, shape: ObjectShape) -> Float[np.ndarray, "2 X Y Z"]:
        """Return a lower bound of r at the centre of each cell, and an upper bound for all places
        in the cell, m; 0 where the centre is no place for sure, and where no place is."""
        state, side = self.cells.state, self.cells.side
        half = shape.half_diagonal * side
        low = shape.field(state != FREE, side, shape.height(side) - EXACT) - half
        high = shape.field(state >= BLOCKED_AT_CENTRE, side, shape.height(-side) + EXACT) + half
        low[self.place > FREE_AT_CENTRE] = 0.0
        high[(self.place == BLOCKED) | (state == BLOCKED)] = 0.0
        return np.clip(np.stack([low, high]), 0.0, self.space.limit(shape))
