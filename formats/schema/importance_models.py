"""Model of a weight field: how much each place of a target matters."""

import math
from typing import Annotated, Self

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from ...coverage.weight_field import MOST_CELLS, WeightField
from ..errors import UserError
from .base_model import StrictModel, fault, refuse
from .field_types import THREE, Metres, Point

_LONGEST_ROW = 4_000_000  # characters


class ImportanceModel(StrictModel):
    """A weight field on a grid along the axes of the base frame.

    The weights stand in a ``file``, or in ``rows``: each row holds the weights along x, the rows
    follow each other along y, and then layer by layer along z. Only their ratios count; they are
    rounded to 1/65535 of the largest.
    """

    origin: Point = Field(description="lower corner of the grid in the base frame, m")
    cell: Annotated[list[Metres], THREE] = Field(description="sides of a cell along x, y, z, m")
    outside: float = Field(default=0.0, ge=0, le=1e9, description="weight outside the grid")
    file: str | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="CSV or NumPy file (.csv, .npy, .npz) with the weights, in the file's folder",
    )
    layers: int = Field(
        default=1, ge=1, le=MOST_CELLS, description="number of layers along z in the rows"
    )
    rows: list[Annotated[str, Field(max_length=_LONGEST_ROW)]] | None = Field(
        default=None, min_length=1, max_length=MOST_CELLS, description="weights, row by row"
    )

    @model_validator(mode="after")
    def _of_one_kind(self) -> Self:
        if (self.file is None) == (self.rows is None):
            raise fault(None if self.file is None else ["file", "rows"], "either a file or rows")
        if self.rows is not None:
            try:
                self.field_of(self.rows, self.layers)
            except ValueError as error:
                refuse([(("rows",), self.rows, f"other rows: {error}")])
        return self

    def field_of(self, rows: list[str], layers: int) -> WeightField:
        """Return the weight field with these rows.

        Raises:
            ValueError: if they form no grid of weights.
        """
        return WeightField.of(weights_of(rows, layers), self.origin, self.cell, self.outside)

    def field(self) -> WeightField:
        """Return the weight field.

        Raises:
            UserError: if a file still holds the weights.
        """
        if self.rows is None:
            raise UserError(f"{self.file}: the weights of this file are not read yet")
        return self.field_of(self.rows, self.layers)

    @classmethod
    def of_field(cls, field: WeightField) -> Self:
        """Return the table of a weight field."""
        x, _, z = field.level.shape
        flat = field.weights.transpose(2, 1, 0).reshape(-1, x)  # (Z Y, X)
        return cls(
            origin=list(field.origin),
            cell=list(field.cell),
            outside=float(f"{field.outside_weight:.6g}"),
            layers=z,
            rows=[" ".join(f"{weight:.6g}" for weight in row) for row in flat],
        )


def weights_of(rows: list[str], layers: int) -> Float[np.ndarray, "X Y Z"]:
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
