"""Speed and separation monitoring: how far a person must be kept from a part of the robot that
moves.

S_p = S_h + S_r + S_s + C + Z_d + Z_r (ISO/TS 15066, now in ISO 10218-2:2025; read in secondary
sources), where the person walks S_h = v_h (T_r + T_s) while the system reacts and the robot stops,
the robot goes on by S_r = v_r T_r until it brakes, and stops within S_s = v_r T_s / 2 by constant
deceleration. An engineering aid: it confers no safety rating.
"""

import bisect
from dataclasses import dataclass
from typing import Any

from ..arrays import Numbers

WALKING = 1.6  # m/s, ISO 13855: approach of the whole body
# Largest stopping time, s, by the limit set on the TCP's speed, m/s: UR10 CB3 manual, section
# 1.6.2.
UR10_STOPPING = ((1.0, 0.45), (1.5, 0.50), (2.0, 0.55), (3.0, 0.65))
STOPPING = {"ur10": UR10_STOPPING, "ur10_dh": UR10_STOPPING}


@dataclass(frozen=True)
class Safety:
    """What a protective distance is made of. The values of reaction, C, Z_d and Z_r are those of
    the worked example in the literature: a cell's own come from its risk assessment.

    human: v_h, m/s. reaction: T_r, s, from what a sensor could see to the command to stop.
    stopping: T_s, s; None: by the robot's table, at the next limit of speed above the fastest part.
    intrusion: C, m, what reaches in before it is seen. sensor: Z_d, m, uncertainty of the person's
    place. robot: Z_r, m, of the robot's. speed: m/s, of every part at a pose whose joint speeds are
    not known.
    """

    human: float = WALKING
    reaction: float = 0.10
    stopping: float | None = None
    intrusion: float = 0.20
    sensor: float = 0.10
    robot: float = 0.05
    speed: float = 0.0


@dataclass(frozen=True)
class Terms:
    """The terms of a separation distance, m; numbers or arrays of one shape. stopping: T_s that was
    used, s.
    """

    S_h: Any
    S_r: Any
    S_s: Any
    C: Any
    Z_d: Any
    Z_r: Any
    stopping: float

    @property
    def total(self) -> Any:
        """S_p, m."""
        return self.S_h + self.S_r + self.S_s + self.C + self.Z_d + self.Z_r


def stopping_time(safety: Safety, robot: str, fastest: float) -> float:
    """T_s, s, of the robot called ``robot`` whose fastest part moves at ``fastest`` m/s: as given,
    or by its table, where the next higher limit counts.

    Raises:
        ValueError: if it is not given and no table says it.
    """
    if safety.stopping is not None:
        return safety.stopping
    table = STOPPING.get(robot)
    if table is None:
        known = ", ".join(STOPPING)
        raise ValueError(
            f"robot {robot}: found no stopping time, allowed: one given (safety.stopping_s); known"
            f" for {known}"
        )
    place = bisect.bisect_left([limit for limit, _ in table], fastest)
    if place == len(table):
        raise ValueError(
            f"found a part at {fastest:.2f} m/s, allowed: up to {table[-1][0]:g}, where {robot}'s"
            " table of stopping times ends, or a stopping time given (safety.stopping_s)"
        )
    return table[place][1]


def separation(safety: Safety, speed: Numbers, stopping: float) -> Terms:
    """The separation distance from parts that move at ``speed``, m/s, a number or an array, towards
    the person, and stop within ``stopping`` s."""
    return Terms(
        S_h=safety.human * (safety.reaction + stopping),
        S_r=speed * safety.reaction,
        S_s=speed * stopping / 2,
        C=safety.intrusion,
        Z_d=safety.sensor,
        Z_r=safety.robot,
        stopping=stopping,
    )
