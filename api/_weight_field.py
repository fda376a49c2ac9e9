"""Weight fields: how much each place of a target matters."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ._arguments import three
from ._errors import InputError, input_errors
from .coverage.definitions.errors import UserError
from .coverage.weight_field import WeightField


def weight_field(
    weights: Any,
    *,
    cell: Sequence[float],
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    outside: float = 0.0,
) -> WeightField:
    """Return a weight field: how much each place of a target matters, such as where people walk.

    ζ is then the covered share of the weight. Only ratios of weights count. They are constant on
    each cell of the grid and rounded to 1/65535 of the largest.

    Args:
        weights: weights of 0 or more on a grid along the axes of the base frame: an array (X, Y) or
            (X, Y, Z), or the path of a file: a CSV file, whose rows run along x and follow each
            other along y, or a NumPy array (.npy, .npz).
        cell: sides (x, y, z) of a cell, m.
        origin: lower corner (x, y, z) of the grid in the base frame (``base`` of ``Scene``), m.
        outside: weight outside the grid.

    Returns:
        The field, for the argument ``importance`` of a target.

    Raises:
        InputError: for a file or weights that cannot be used.

    Example:
        >>> import numpy as np
        >>> import place_rings as pr
        >>> busy = pr.weight_field(np.array([[1.0, 0.2]]), cell=(1, 1, 2), origin=(0, -1, 0))
        >>> pr.Scene(targets=pr.Shell(0.5, importance=busy))
        <Scene: ur10, 1 pose, V_S(0.5) weighted, occlusion shadow>
    """
    corner, sides = three("origin", origin), three("cell", cell)
    if isinstance(weights, str | Path):
        from .coverage.weight_field import weights_of
        from .formats.weight_grids import weight_rows

        try:
            rows, layers = weight_rows("weights", Path(weights), Path(weights).read_bytes())
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", "weights", weights) from error
        except UserError as error:
            raise InputError(str(error)) from error
        with input_errors("weights"):
            weights = weights_of(rows, layers or 1)
    try:
        grid = np.asarray(weights, float)
    except (TypeError, ValueError) as error:
        raise InputError("found no numbers, allowed: (X, Y) or (X, Y, Z)", "weights") from error
    grid = grid[..., None] if grid.ndim == 2 else grid
    with input_errors("weights"):
        if grid.ndim != 3:
            raise ValueError(f"found shape {grid.shape}, allowed: (X, Y) or (X, Y, Z)")
        return WeightField.of(grid, corner, sides, outside)
