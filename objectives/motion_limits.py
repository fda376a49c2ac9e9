"""How a real robot may move during a check."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Motion:
    """How a real robot may move during a check, and what stops it."""

    speed: float = math.radians(15)
    """Speed of the leading joint, rad/s."""
    acceleration: float = math.radians(30)
    """Acceleration of the leading joint, rad/s²."""
    near: float = 0.15
    """Reading below which the robot stops, m."""
    own: float = 0.04
    """Minimum clearance between the robot's own bodies, m."""
    cell: float = 0.1
    """Minimum clearance between the robot's bodies and obstacles, m."""
    near_share: float = 0.5
    """Minimum share of the sensors, along the route, that must keep the whole of ``near``."""
    failed_share: float = 0.25
    """Maximum share of a ring's sensors that may report failure."""
    frozen_frames: int = 6
    """Consecutive frames for which a ring's distances may stay constant while the robot moves."""
    cell_complete: bool = False
    """Whether the scene contains everything that the robot can reach."""
    rings_as_proposed: bool = False
    """Whether every ring is known to be wired and mounted the right way round."""
