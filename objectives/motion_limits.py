"""How a real robot may move during a check."""

import math
from typing import Annotated

from pydantic import Field

from ..coverage.definitions.definition import definition
from ..coverage.definitions.units import Degrees, Key

_Share = Annotated[float, Field(ge=0, le=1)]


@definition
class Motion:
    """Limits of motion for `check --move` on a real robot. They are no safety function."""

    speed: Annotated[float, Degrees("speed_deg_s", ge=1, le=60)] = math.radians(15)
    """Speed of the leading joint, rad/s."""
    acceleration: Annotated[float, Degrees("acceleration_deg_s2", gt=0, le=120)] = math.radians(30)
    """Acceleration of the leading joint, rad/s²."""
    near: Annotated[float, Key("near_m", ge=0.05, le=4)] = 0.15
    """Distance below which a reading stops the robot, m."""
    own: Annotated[float, Key("self_m", ge=0.01, le=1)] = 0.04
    """Least distance between bodies of the robot, m."""
    cell: Annotated[float, Key("cell_m", ge=0.02, le=1)] = 0.1
    """Least distance between the robot and obstacles, m."""
    near_share: _Share = 0.5
    """Least share of the sensors that must keep the full near_m; for `check --move`, values below
    the default count as the default."""
    failed_share: Annotated[float, Field(ge=0, le=0.5)] = 0.25
    """Largest share of a ring's sensors that may fail or freeze."""
    frozen_frames: Annotated[int, Field(ge=2, le=100)] = 6
    """Number of frames for which a ring's distances may stay unchanged during a motion."""
    cell_complete: bool = False
    """Whether the scene contains everything that the robot can reach."""
    rings_as_proposed: bool = False
    """Whether every ring is known to be wired correctly and mounted the right way round."""
