"""Types of values in files, with their units and limits."""

from typing import Annotated

from pydantic import Field

from ...coverage.definitions.field_types import Coordinate

RingRadius = Annotated[float, Field(gt=0, le=1, description="radius of a ring, m")]
Percent = Annotated[float, Field(ge=0, le=100, description="percentage")]
Tilt = Annotated[
    float, Field(gt=-90, lt=90, description="tilt in degrees, positive towards the distal end")
]
Position = Annotated[
    float, Field(ge=0, le=1, description="position along the link, from 0 proximal to 1 distal")
]

Name = Annotated[str, Field(min_length=1, max_length=100)]
JointAngle = Annotated[float, Field(ge=-720, le=720, description="joint angle, degrees")]
THREE = Field(min_length=3, max_length=3)
Point = Annotated[list[Coordinate], THREE]
