"""Rules that make a setup buildable, and limits of rings by link."""

import math
from dataclasses import dataclass
from typing import Literal

from ..coverage.rings.mounted_sensor import MountedSensor
from ..coverage.rings.ring import Ring
from ..coverage.sensors.sensor import Sensor

Mounting = Literal["real", "free"]


@dataclass(frozen=True)
class Limits:
    """Where rings may sit on a link, how far they may tilt, and which sensors they carry."""

    position: tuple[float, float] = (0.0, 1.0)
    """Lowest and highest position on the mount axis."""
    tilt: tuple[float, float] = (math.radians(-70), math.radians(70))
    """Lowest and highest tilt, rad."""
    keep_out: tuple[tuple[float, float], ...] = ()
    """Intervals of position without rings."""
    sensor: Sensor | None = None
    """Sensor of the rings; None: the scene's."""
    radius: float | None = None
    """Radius of the rings, m; None: the scene's."""


@dataclass(frozen=True)
class Rules:
    """Rules that make a setup buildable."""

    spacing: float = 0.03
    """Minimum distance of two rings on a link, m."""
    from_joints: float = 0.0
    """Minimum distance of a ring from the link's ends, m."""
    sensors: tuple[int, int] = (3, 24)
    """Minimum and maximum number of sensors on a ring."""
    max_rings_per_link: int = 8
    """Maximum number of rings on a link."""
    shared_tilt: bool = False
    """Whether all rings have the same tilt up to its sign, except fixed ones, which keep theirs."""
    fixed: tuple[Ring, ...] = ()
    """Existing rings, which stay in place."""
    fixed_sensors: tuple[MountedSensor, ...] = ()
    """Existing single sensors on the robot, which stay in place."""
    mount: Mounting = "real"
    """``real``: a ring has an envelope, which stays within the usable part of the link and keeps
    ``clearance`` at every pose; its sensors keep ``standoff``. ``free``: it has no body."""
    standoff: float = 0.012
    """Minimum distance from the surrounded section to the sensors, m."""
    clearance: float = 0.002
    """Minimum distance of a ring's envelope from bodies, obstacles and other envelopes, m. It does
    not hold for the tube that the ring grips: only the print's ``slack`` is between these."""
