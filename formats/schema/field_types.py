"""Types of values in files, with their units and limits."""

from typing import Annotated, Any

from pydantic import AfterValidator, Field

from ...coverage.definitions.definition import fault
from ...coverage.definitions.field_types import Coordinate

RingRadius = Annotated[float, Field(gt=0, le=1, description="radius of a ring, m")]
Percent = Annotated[float, Field(ge=0, le=100, description="percentage")]
Tilt = Annotated[
    float, Field(gt=-90, lt=90, description="tilt in degrees, positive towards the distal end")
]
Position = Annotated[
    float, Field(ge=0, le=1, description="position along the link, from 0 proximal to 1 distal")
]


def ascending(pair: list[Any]) -> list[Any]:
    """Return the pair unchanged; raise a fault if its first value is the higher."""
    if pair[0] > pair[1]:
        raise fault(f"{pair}", "the lower value first")
    return pair


Name = Annotated[str, Field(min_length=1, max_length=100)]
Angle = Annotated[float, Field(ge=-360, le=360, description="angle, degrees")]
JointAngle = Annotated[float, Field(ge=-720, le=720, description="joint angle, degrees")]
THREE = Field(min_length=3, max_length=3)
Point = Annotated[list[Coordinate], THREE]
Angles = Annotated[list[Angle], THREE]
Interval = Annotated[list[Position], Field(min_length=2, max_length=2), AfterValidator(ascending)]
