"""Checks of what callers pass to a twin."""

from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import InputError

_SKEW = 1e-3  # by which products of axes may miss 0 and 1


def numbers(name: str, value: Any, shape: tuple[int, ...]) -> Float[np.ndarray, "*shape"]:
    """Return finite numbers of a shape.

    Raises:
        InputError: for anything else.
    """
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        raise InputError(f"found no numbers, allowed: {shape} numbers", name) from None
    if array.shape != shape:
        raise InputError(f"found the shape {array.shape}, allowed: {shape}", name)
    if not np.isfinite(array).all():
        raise InputError("found a number that is not finite, allowed: finite ones", name)
    return array


def axes(name: str, value: Any) -> Float[np.ndarray, "3 3"]:
    """Return right-handed unit axes in the columns of a matrix.

    Raises:
        InputError: for anything else.
    """
    frame = numbers(name, value, (3, 3))
    if np.abs(frame.T @ frame - np.eye(3)).max() > _SKEW or np.linalg.det(frame) < 0:
        raise InputError("found other columns, allowed: right-handed unit axes", name)
    return frame
