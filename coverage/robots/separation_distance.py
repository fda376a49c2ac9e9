"""Speed and separation monitoring: the distance to keep between a person and a moving part of the
robot.

S_p = S_h + S_r + S_s + C + Z_d + Z_r (ISO/TS 15066, now in ISO 10218-2:2025; read in secondary
sources). The person walks S_h = v_h (T_r + T_s) while the system reacts and the robot stops. The
robot moves on by S_r = v_r T_r until it brakes, and stops within S_s = v_r T_s / 2 at constant
deceleration. This is an engineering aid; it confers no safety rating.
"""

import bisect
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from ..arrays import Numbers
from ..definitions.definition import definition, refuse
from ..definitions.field_types import Items
from ..definitions.units import Key
from .stop_times import StopTime, repeated

WALKING = 1.6  # m/s, ISO 13855: approach speed of the whole body
UPPER_LIMB = 2.0  # m/s, ISO 13855: approach speed of the upper limbs
PARALLEL = 1.2  # m, ISO 13855:2024: D_DS for an approach parallel to the detection zone
LEAST_DISTANCE = 0.1  # m, ISO 13855:2024: the least separation distance
# Maximum stopping time, s, by the limit set on the TCP's speed, m/s: UR10 CB3 manual, section
# 1.6.2.
UR10_STOPPING = ((1.0, 0.45), (1.5, 0.50), (2.0, 0.55), (3.0, 0.65))
STOPPING = {"ur10": UR10_STOPPING, "ur10_dh": UR10_STOPPING}


@definition
class Safety:
    """Terms of the separation distance of V_P, S = v_h (T_r + T_s) + v_r T_r + v_r T_s / 2 + C +
    Z_d + Z_r.

    v_r follows from a pose's joint speeds. The defaults of T_r, C, Z_d and Z_r are those of the
    worked example in the literature; a cell's own values come from its risk assessment. No value
    here confers a safety rating.
    """

    human: Annotated[float, Key("human_speed", gt=0, le=20)] = WALKING
    """v_h, speed of a person, m/s; 1.6 by ISO 13855."""
    reaction: Annotated[float, Key("reaction_s", ge=0, le=10)] = 0.10
    """T_r, reaction time, s: from the moment a sensor could see the person to the command to
    stop."""
    stopping: Annotated[float, Key("stopping_s", ge=0, le=10)] | None = None
    """T_s, stopping time, s; default: the largest of stop_times, or from the robot's table, at the
    next speed limit above the fastest part."""
    intrusion: Annotated[float, Key("intrusion_m", ge=0, le=10)] = 0.20
    """C, intrusion distance before detection, m."""
    sensor: Annotated[float, Key("sensor_uncertainty_m", ge=0, le=10)] = 0.10
    """Z_d, uncertainty of the person's position, m."""
    robot: Annotated[float, Key("robot_uncertainty_m", ge=0, le=10)] = 0.05
    """Z_r, uncertainty of the robot's position, m."""
    speed: Annotated[float, Key("robot_speed", ge=0, le=20)] = 0.0
    """v_r of all parts at poses without joint speeds, m/s."""
    stop_times: Annotated[Items[StopTime], Field(max_length=10_000)] = ()
    """Measured stops of the robot, in place of stopping_s; in a scene's file also the name of a CSV
    file."""

    def __post_init__(self) -> None:
        if self.stop_times and self.stopping is not None:
            refuse([(("stopping",), self.stopping, "none beside measured stop_times")])
        if (again := repeated(self.stop_times)) is not None:
            where = ("stop_times", again, "repeat")
            refuse([(where, self.stop_times[again].repeat, "once under a condition")])


@dataclass(frozen=True)
class Terms:
    """The terms of a separation distance, m; numbers or arrays of one shape."""

    S_h: Any
    """Distance that the person walks."""
    S_r: Any
    """Distance that the robot moves before it brakes."""
    S_s: Any
    """Distance within which the robot stops."""
    C: Any
    """Intrusion before detection."""
    Z_d: Any
    """Uncertainty of the person's position."""
    Z_r: Any
    """Uncertainty of the robot's position."""
    stopping: float
    """T_s that was used, s."""

    @property
    def total(self) -> Any:
        """S_p, m."""
        return self.S_h + self.S_r + self.S_s + self.C + self.Z_d + self.Z_r


def stopping_time(safety: Safety, robot: str, fastest: float) -> float:
    """Return T_s, s, of a robot whose fastest part moves at ``fastest`` m/s.

    It is the stated value, the largest of the measured ones, or, from the robot's table, that of
    the next higher speed limit.

    Raises:
        ValueError: if no value is stated and the table has none.
    """
    if safety.stopping is not None:
        return safety.stopping
    if safety.stop_times:
        return max(stop.stop_s for stop in safety.stop_times)
    table = STOPPING.get(robot)
    if table is None:
        known = ", ".join(STOPPING)
        raise ValueError(
            f"robot {robot} has no stopping time: set safety.stopping_s or safety.stop_times;"
            f" tables exist for {known}"
        )
    place = bisect.bisect_left([limit for limit, _ in table], fastest)
    if place == len(table):
        raise ValueError(
            f"a part moves at {fastest:.2f} m/s; {robot}'s table of stopping times ends at"
            f" {table[-1][0]:g} m/s: set safety.stopping_s"
        )
    return table[place][1]


def separation(safety: Safety, speed: Numbers, stopping: float) -> Terms:
    """Return the separation distance from parts that move towards the person.

    Args:
        safety: the parameters.
        speed: speed of the parts, m/s, a number or an array.
        stopping: T_s, s.
    """
    return Terms(
        S_h=safety.human * (safety.reaction + stopping),
        S_r=speed * safety.reaction,
        S_s=speed * stopping / 2,
        C=safety.intrusion,
        Z_d=safety.sensor,
        Z_r=safety.robot,
        stopping=stopping,
    )


def approach_distance(speed: float, total: float, detection: float, supplement: float) -> float:
    """Return the separation distance of ISO 13855:2024 from a hazard that stays in place, m:
    S = K T + D_DS + Z, at least 0.1 m (read in secondary sources).

    Args:
        speed: K, approach speed of the person, m/s.
        total: T, time from detection to the end of the hazard, s.
        detection: D_DS, reaching distance of the detection, m.
        supplement: Z, supplements such as the errors of measurement, m.
    """
    return max(speed * total + detection + supplement, LEAST_DISTANCE)
