"""Soft beams of any shape: which class evaluates them."""

from functools import singledispatch
from typing import Any

from ..solids.sensor_beams import MixedBeams
from .cones import SoftBeams
from .pyramids import SquareBeams


@singledispatch
def soft_beams(seen: Any) -> SoftBeams:
    """Return the soft estimator's beams for cones or mixed beams.

    Types with occlusion register their own implementation.
    """
    return SquareBeams(seen) if isinstance(seen, MixedBeams) else SoftBeams(seen)
