"""Colours of the rendered pictures."""

from typing import Any

import numpy as np
from jaxtyping import Float

from ...formats.export.palette import UNCOVERED

UNSEEN_COLOUR = UNCOVERED
Colour = Any
"""One colour for all parts, as ``#rrggbb`` or (3,) in [0, 1], or one for each part (N, 3)."""


def rgb(colour: Colour) -> Float[np.ndarray, "*N 3"]:
    """Return colours as numbers (..., 3) in [0, 1]; a string must have the form ``#rrggbb``."""
    if isinstance(colour, str):
        return np.array([int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return np.asarray(colour, float)


def paler(colour: Colour, share: float) -> Float[np.ndarray, "*N 3"]:
    """Mix colours (..., 3) with a share of white."""
    return (1 - share) * rgb(colour) + share
