"""A weight field: how much each place of a target matters, constant on each cell of a grid."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field
from pydantic_core import core_schema

from .arrays import Vector
from .definitions.definition import definition, refuse
from .definitions.field_types import Coordinate, Items, Metres, Pair, Point, Triple
from .floor_areas import Polygon, area_shares
from .solids.volume_fraction import VolumeFraction

LEVELS = 65_535  # weights are whole multiples of the largest over this
MOST_CELLS = 200_000  # of a field
_Row = Annotated[str, Field(max_length=4_000_000)]
_PLAN_CELL = 0.05  # m, of a floor plan
_SPAN = 4  # cells along an axis up to which the mean over a cube is computed


@dataclass(frozen=True)
class MeanWeight:
    """Bounds of the weight in each of N cubes, in [0, 1]."""

    least: Float[np.ndarray, " N"]
    """Lower bound of the weight at any point of the cube."""
    most: Float[np.ndarray, " N"]
    """Upper bound of the weight at any point of the cube."""
    mean: VolumeFraction
    """Bounds of the mean over the cube."""

    def only(self, keep: np.ndarray) -> "MeanWeight":
        """Return the bounds for some cubes, selected by truth values."""
        return MeanWeight(self.least[keep], self.most[keep], self.mean.only(keep))

    def of(self, share: VolumeFraction) -> VolumeFraction:
        """Return bounds of the weight in a part of each cube, as a share of the cube's volume.

        A part of share s holds at least s times the least weight, and at least the mean less (1 -
        s) times the largest weight; the upper bound follows likewise.
        """
        low = np.maximum(self.least * share.low, self.mean.low - self.most * (1 - share.low))
        high = np.minimum(self.most * share.high, self.mean.high - self.least * (1 - share.high))
        return VolumeFraction(np.maximum(low, 0.0), np.maximum(high, 0.0))


@dataclass(frozen=True, eq=False)
class WeightField:
    """Weights on a grid along the axes of the base frame, relative to the largest one.

    A field is the same as another if their cells and weights are.
    """

    level: Int[np.ndarray, "X Y Z"]
    """Weight of each cell, in ``LEVELS`` parts of the largest weight."""
    origin: tuple[float, float, float]
    """Lower corner of the grid, m."""
    cell: tuple[float, float, float]
    """Sides of a cell, m."""
    outside: int
    """Weight outside the grid, in the same parts."""

    @staticmethod
    def of(
        weights: Float[np.ndarray, "X Y Z"], origin: Vector, cell: Vector, outside: float = 0.0
    ) -> "WeightField":
        """Return the field of weights (X, Y, Z), rounded to whole parts of the largest one.

        Args:
            weights: weights, 0 or more.
            origin: lower corner of the grid (3,), m.
            cell: sides of a cell (3,), m.
            outside: weight outside the grid.

        Raises:
            ValueError: for too many cells, a negative weight, none above 0, or sides that are not
                positive.
        """
        weights = np.asarray(weights, float)
        if weights.ndim != 3 or not 0 < weights.size <= MOST_CELLS:
            raise ValueError(
                f"a weight field has 1 to {MOST_CELLS} cells in 3 dimensions, got shape"
                f" {weights.shape}"
            )
        if not (np.isfinite(weights).all() and (weights >= 0).all()):
            raise ValueError("the weights of a field must be finite and 0 or more")
        if not (math.isfinite(outside) and outside >= 0):
            raise ValueError(f"the weight outside a field must be 0 or more, got {outside}")
        sides, corner = np.asarray(cell, float), np.asarray(origin, float)
        if sides.shape != (3,) or not (np.isfinite(sides).all() and (sides > 0).all()):
            raise ValueError(f"the sides of a cell must be three positive lengths, got {cell}")
        if corner.shape != (3,) or not np.isfinite(corner).all():
            raise ValueError(f"the origin of a field must be three numbers, got {origin}")
        largest = max(float(weights.max()), outside)
        if not largest > 0:
            raise ValueError("a weight field needs a weight above 0")
        level = np.rint(weights / largest * LEVELS).astype(np.int64)
        level.setflags(write=False)
        x, y, z = corner.tolist()
        a, b, c = sides.tolist()
        return WeightField(level, (x, y, z), (a, b, c), round(outside / largest * LEVELS))

    @cached_property
    def _key(self) -> tuple[object, ...]:
        return self.level.shape, self.level.tobytes(), self.origin, self.cell, self.outside

    def __eq__(self, other: object) -> bool:
        return isinstance(other, WeightField) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        """A file states a field as a ``WeightTable``."""
        return core_schema.no_info_wrap_validator_function(
            lambda value, table: value if isinstance(value, cls) else table(value).field(),
            handler.generate_schema(WeightTable),
            serialization=core_schema.wrap_serializer_function_ser_schema(
                lambda value, table: table(WeightTable.of(value))
            ),
        )

    def turned(self) -> "WeightField":
        """Return the field turned by 180° about z of the base."""
        far = [o + n * c for o, n, c in zip(self.origin, self.level.shape, self.cell, strict=True)]
        level = np.ascontiguousarray(self.level[::-1, ::-1])
        return replace(self, level=level, origin=(-far[0], -far[1], self.origin[2]))

    @property
    def weights(self) -> Float[np.ndarray, "X Y Z"]:
        """Weights of the cells, relative to the largest weight."""
        relative: np.ndarray = self.level / LEVELS
        return relative

    @property
    def outside_weight(self) -> float:
        """Weight outside the grid, relative to the largest weight."""
        return self.outside / LEVELS

    def support(self) -> Float[np.ndarray, "2 3"] | None:
        """Return a box (2, 3) m outside of which all weights are 0; None if there is none."""
        if self.outside:
            return None
        places = np.argwhere(self.level > 0)
        ends = np.stack([places.min(axis=0), places.max(axis=0) + 1])
        box: np.ndarray = np.array(self.origin) + ends * np.array(self.cell)
        return box

    def levels_at(self, points: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
        """Return the weight at points (N, 3) m, in ``LEVELS`` parts of the largest."""
        index = np.floor((points - np.array(self.origin)) / np.array(self.cell)).astype(np.int64)
        return self._levels(index)

    def _levels(self, index: Int[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
        shape = np.array(self.level.shape)
        within = ((index >= 0) & (index < shape)).all(axis=1)
        x, y, z = np.clip(index, 0, shape - 1).T
        return np.where(within, self.level[x, y, z], self.outside)

    def in_cubes(self, points: Float[np.ndarray, "N 3"], side: float, slack: float) -> MeanWeight:
        """Return bounds of the weight in cubes of ``side`` m about ``points`` (N, 3) m.

        The mean is a sum over the cells that a cube meets, up to ``_SPAN`` along an axis; of larger
        cubes only the bounds of all weights are known. ``slack`` is the rounding error of a
        coordinate, m.
        """
        cell, n = np.array(self.cell), len(points)
        low, high = ((points + s * side / 2 - np.array(self.origin)) / cell for s in (-1, 1))
        first = np.floor(low - slack / cell).astype(np.int64)
        span = np.floor(high + slack / cell).astype(np.int64) - first  # (N, 3)
        known = (span < _SPAN).all(axis=1)
        smallest = min(int(self.level.min()), self.outside) / LEVELS
        largest = max(int(self.level.max()), self.outside) / LEVELS
        least, most = np.full(n, smallest), np.full(n, largest)
        mean = VolumeFraction(least.copy(), most.copy())
        if known.any():
            total, lowest, highest = self._sums(first[known], span[known], low[known], high[known])
            error = (highest - lowest) * min(12 * slack / side, 1.0) + 1e-12
            least[known], most[known] = lowest, highest
            mean.low[known] = np.maximum(total - error, lowest)
            mean.high[known] = np.minimum(total + error, highest)
        return MeanWeight(least, most, mean)

    def _sums(
        self, first: np.ndarray, span: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return mean, least and largest weight (N,) in boxes, by the cells that they meet.

        ``first`` and ``span`` (N, 3) are the first cells and the number of further ones; ``low``
        and ``high`` (N, 3) are the boxes in units of cells.
        """
        total, lowest, highest = np.zeros(len(first)), np.ones(len(first)), np.zeros(len(first))
        for step in itertools.product(*(range(int(s) + 1) for s in span.max(axis=0))):
            met = (np.array(step) <= span).all(axis=1)
            index = first + np.array(step)
            weight = self._levels(index) / LEVELS
            part = np.clip(np.minimum(high, index + 1) - np.maximum(low, index), 0, None)
            share = (part / (high - low)).prod(axis=1)
            total += np.where(met, weight * share, 0.0)
            lowest = np.where(met, np.minimum(lowest, weight), lowest)
            highest = np.where(met, np.maximum(highest, weight), highest)
        return total, lowest, highest


@definition
class WeightTable:
    """A weight field on a grid along the axes of the base frame, as files state it.

    The weights stand in a ``file``, or in ``rows``: each row holds the weights along x, the rows
    follow each other along y, and then layer by layer along z. Only their ratios count; they are
    rounded to 1/65535 of the largest. Or ``areas`` of a floor plan between two ``heights`` have the
    weight 1; cells of 5 cm or more at their edges have that of the share inside.
    """

    origin: Point | None = None
    """Lower corner of the grid in the base frame, m."""
    cell: Triple[Metres] | None = None
    """Sides of a cell along x, y, z, m."""
    outside: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    """Weight outside the grid."""
    file: Annotated[str, Field(min_length=1, max_length=1000)] | None = None
    """CSV or NumPy file (.csv, .npy, .npz) with the weights, in the file's folder."""
    layers: Annotated[int, Field(ge=1, le=MOST_CELLS)] = 1
    """Number of layers along z in the rows."""
    rows: Annotated[Items[_Row], Field(min_length=1, max_length=MOST_CELLS)] | None = None
    """Weights, row by row."""
    areas: Annotated[Items[Polygon], Field(min_length=1, max_length=100)] | None = None
    """Areas of a floor plan, polygons of corners (x, y) in the base frame, m."""
    heights: Pair[Coordinate] | None = None
    """Lower and upper height of the areas, m."""

    def __post_init__(self) -> None:
        kinds = [key for key in ("file", "rows", "areas") if getattr(self, key) is not None]
        if len(kinds) != 1:
            refuse([((), kinds or None, "exactly one of file, rows and areas")])
        plan = self.areas is not None
        for key in ("origin", "cell"):
            if (getattr(self, key) is None) != plan:
                allowed = "none, as areas have their own grid" if plan else "that of the grid"
                refuse([((key,), getattr(self, key), allowed)])
        if plan != (self.heights is not None and self.heights[0] < self.heights[1]):
            allowed = "a lower and an upper height" if plan else "none, only with areas"
            refuse([(("heights",), self.heights, allowed)])
        if self.file is None:
            try:
                self.field()
            except ValueError as error:
                refuse([((kinds[0],), getattr(self, kinds[0]), f"other {kinds[0]}: {error}")])

    def field(self) -> WeightField:
        """Return the weight field.

        Raises:
            ValueError: if the rows form no grid of weights.
        """
        if self.areas is not None and self.heights is not None:
            shares, low, sides = area_shares(self.areas, _PLAN_CELL, MOST_CELLS)
            (bottom, top), outside = self.heights, self.outside
            corner, cell = (*low, bottom), (*sides, top - bottom)
            return WeightField.of(shares[..., None], corner, cell, outside)
        if self.rows is None or self.origin is None or self.cell is None:
            refuse([(("file",), self.file, "rows, where no file is read")])
            raise ValueError(self.file)
        weights = weights_of(self.rows or (), self.layers)
        return WeightField.of(weights, self.origin, self.cell, self.outside)

    @classmethod
    def of(cls, field: WeightField) -> "WeightTable":
        """Return the table of a weight field."""
        x, _, z = field.level.shape
        flat = field.weights.transpose(2, 1, 0).reshape(-1, x)  # (Z Y, X)
        rows = tuple(" ".join(f"{weight:.6g}" for weight in row) for row in flat)
        outside = float(f"{field.outside_weight:.6g}")
        return cls(field.origin, field.cell, outside, None, z, rows)


def weights_of(rows: Sequence[str], layers: int) -> Float[np.ndarray, "X Y Z"]:
    """Return the weights (X, Y, Z) of rows along x, which follow each other along y, then z.

    Raises:
        ValueError: if they form no grid of numbers.
    """
    if not rows:
        raise ValueError("no rows")
    numbers = []
    for i, row in enumerate(rows):
        words = row.replace(",", " ").replace(";", " ").split()
        try:
            numbers.append([float(word) for word in words])
        except ValueError as error:
            raise ValueError(f"row {i} holds a word that is no number") from error
        if not words or len(words) != len(numbers[0]):
            raise ValueError(f"row {i} has {len(words)} weights, the first {len(numbers[0])}")
        if not all(math.isfinite(weight) and weight >= 0 for weight in numbers[-1]):
            raise ValueError(f"row {i} holds a weight that is not a finite number of 0 or more")
    if len(rows) % layers:
        raise ValueError(f"{len(rows)} rows do not divide into {layers} layers")
    return np.array(numbers).reshape(layers, -1, len(numbers[0])).transpose(2, 1, 0)
