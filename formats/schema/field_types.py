"""Kinds of values that the keys of files hold, with their units and limits."""

from typing import Annotated, Any

from pydantic import AfterValidator, Field

from .base_model import fault

MOST_DEG_S = 3600  # of a joint
FARTHEST = 100.0  # m, that anything lies from the base
LONGEST_NAME = 100  # characters, of an obstacle

Weight = Annotated[float, Field(gt=0, le=1e6, description="relative weight")]
Metres = Annotated[float, Field(gt=0, le=100, description="metres")]
Percent = Annotated[float, Field(ge=0, le=100, description="percent")]
Tilt = Annotated[float, Field(gt=-90, lt=90, description="degrees, positive towards distal")]
Position = Annotated[float, Field(ge=0, le=1, description="0 proximal to 1 distal")]


def ascending(pair: list[Any]) -> list[Any]:
    """A pair as it is; a fault where its first value is the higher."""
    if pair[0] > pair[1]:
        raise fault(f"{pair}", "the lower value first")
    return pair


Interval = Annotated[list[Position], Field(min_length=2, max_length=2), AfterValidator(ascending)]
