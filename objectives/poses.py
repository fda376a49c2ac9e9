"""Weighted poses of the robot, and the recorded motion from which they come."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ..coverage.definitions.definition import Fault, definition, refuse
from ..coverage.definitions.equality import equal_fields
from ..coverage.definitions.field_types import FARTHEST, Items
from ..coverage.definitions.units import Degrees, degrees
from ..coverage.robots.joint_values import (
    contradicted,
    in_file_units,
    joint_keys,
    joint_keys_of,
    misnamed,
    named,
    ordered,
)
from ..coverage.robots.kinematics import Chain
from ..coverage.robots.robot import Robot

MOST_DEG_S = 3600  # degrees per second, largest joint speed
_Turns = Annotated[
    float, Field(ge=-36_000, le=36_000, description="joint angle, degrees")
]  # a continuous joint turns many times; ``PoseTable.faults`` checks the others
_Rate = Annotated[float, Field(ge=-MOST_DEG_S, le=MOST_DEG_S, description="degrees/s")]
_SIZE = Field(min_length=1, max_length=20)


@dataclass(frozen=True)
class Pose:
    """A pose of the robot."""

    q: Float[np.ndarray, " J"]
    """Joint values: angles, rad, and of prismatic joints distances, m."""
    weight: float = 1.0
    """Weight of the pose in the mean."""
    time_s: float | None = None
    """Time in the recorded motion, s; None if the pose is not from a record."""
    rate: Float[np.ndarray, " J"] | None = None
    """Joint speeds, rad/s or m/s; None if unknown."""

    __eq__ = equal_fields

    @staticmethod
    def of(robot: Robot, joints: Mapping[str, float], weight: float = 1.0) -> "Pose":
        """Return a pose from joint values by name and unit.

        Args:
            robot: the robot.
            joints: one value for each joint, in degrees or metres, by the joint's name with the
                unit: ``{"rail_m": 0.3, "shoulder_deg": 20.0}``.
            weight: weight of the pose in the mean.

        Raises:
            ValueError: for a key that is unknown or missing.
        """
        return Pose(ordered(robot.chain, joints), weight)


@definition
class PoseTable:
    """A pose of the robot, with its weight and joint speeds.

    Joint values stand in the order of the joints, or by name; a robot with prismatic joints needs
    the names.
    """

    q_deg: Annotated[Items[_Turns], _SIZE] | None = None
    """Joint angles, degrees."""
    q: Annotated[dict[str, _Turns], _SIZE] | None = None
    """Joint values by name and unit, such as shoulder_deg (degrees) of a revolute joint and rail_m
    (metres) of a prismatic one, in place of q_deg."""
    weight: Annotated[float, Field(gt=0, le=1e6)] = 1.0
    """Relative weight."""
    time_s: float | None = None
    """Time in the recorded motion, s."""
    rate_deg_s: Items[_Rate] | None = None
    """Joint speeds for V_P, degrees/s."""
    rate: dict[str, _Rate] | None = None
    """Joint speeds for V_P by name and unit, such as shoulder_deg_s and rail_m_s, in place of
    rate_deg_s."""

    def __post_init__(self) -> None:
        faults: list[Fault] = []
        if self.q_deg is None and self.q is None:
            faults.append((("q_deg",), None, "joint angles in degrees, or q with joint names"))
        for listed, by_name in (("q_deg", "q"), ("rate_deg_s", "rate")):
            if getattr(self, listed) is not None and getattr(self, by_name) is not None:
                faults.append(((by_name,), "both", f"either {listed} or {by_name}"))
        refuse(faults)

    def faults(self, robot: Robot) -> Iterator[Fault]:
        """Yield joint values that do not belong to ``robot``, or exceed its limits."""
        chain, wrong = robot.chain, False
        for speed, noun, listed, values in (
            (False, "angles", "q_deg", self.q_deg),
            (True, "speeds", "rate_deg_s", self.rate_deg_s),
        ):
            by_name = "rate" if speed else "q"
            table = getattr(self, by_name)
            if values is not None and chain.prismatic:
                keys = ", ".join(joint_keys(chain, speed))
                slides = chain.joints[chain.prismatic[0]]
                allowed = f"{by_name} with {keys}, because {slides} is prismatic"
                yield (listed,), len(values), allowed
            elif values is not None and len(values) != len(chain):
                allowed = f"{len(chain)} {noun}, one for each joint of {robot.name}"
                yield (listed,), len(values), allowed
            elif table is not None and (fault := misnamed(chain, table, speed)) is not None:
                yield (by_name, fault[0]), table.get(fault[0]), f"{fault[1]} of {robot.name}"
            else:
                continue
            wrong |= not speed
        if not wrong:
            yield from self._limit_faults(robot)

    def _limit_faults(self, robot: Robot) -> Iterator[Fault]:
        chain, q = robot.chain, self.joint_values(robot.chain)
        if (j := contradicted(chain, q)) is not None:
            led = next(chain.joints[m.leader] for m in chain.mimics if m.joint == j)
            key, settled = joint_keys(chain)[j], chain.settled(q)
            stated, wanted = (in_file_units(chain, v)[j] for v in (q, settled))
            where = ("q", key) if self.q_deg is None else ("q_deg", j)
            yield where, stated, f"{wanted:.6g}, as {chain.joints[j]} follows {led}"
            return
        far = np.flatnonzero(chain.slides & (np.abs(q) > FARTHEST))
        beyond = int(far[0]) if len(far) else robot.beyond(q)
        if beyond is None:
            return
        key = joint_keys(chain)[beyond]
        if len(far):
            yield ("q", key), float(q[beyond]), f"{-FARTHEST:g} to {FARTHEST:g}"
            return
        low, high = (in_file_units(chain, end)[beyond] for end in np.asarray(robot.limits).T)
        allowed = f"{low:.6g} to {high:.6g}, the limits of {chain.joints[beyond]} of {robot.name}"
        if self.q_deg is None:
            yield ("q", key), (self.q or {})[key], allowed
        else:
            yield ("q_deg", beyond), self.q_deg[beyond], allowed

    def joint_values(self, chain: Chain) -> Float[np.ndarray, " J"]:
        """Return the joint values (J,), rad or m."""
        if self.q is not None:
            return ordered(chain, self.q)
        return np.array([math.radians(v) for v in self.q_deg or ()])

    def pose(self, chain: Chain) -> Pose:
        """Return the pose of a robot with this chain."""
        rate = None
        if self.rate is not None:
            rate = ordered(chain, self.rate, speed=True)
        elif self.rate_deg_s is not None:
            rate = np.array([math.radians(v) for v in self.rate_deg_s])
        return Pose(self.joint_values(chain), self.weight, self.time_s, rate)

    @classmethod
    def of(cls, pose: Pose, chain: Chain) -> "PoseTable":
        """Return the table of a pose; a chain with prismatic joints names all."""
        keys = joint_keys_of(chain, pose.q)
        if pose.rate is not None and chain.prismatic:
            keys["rate"] = named(chain, pose.rate, speed=True)
        elif pose.rate is not None:
            keys["rate_deg_s"] = [degrees(v) for v in pose.rate]
        return cls(**keys, weight=pose.weight, time_s=pose.time_s)


@definition
class Recorded:
    """Origin of the poses in a recorded motion."""

    file: Annotated[str, Field(max_length=1000)]
    """Name of the CSV file."""
    rows: Annotated[int, Field(ge=0)]
    """Number of rows."""
    seconds: Annotated[float, Field(ge=0)]
    """Duration, s."""
    within: Annotated[float, Degrees("within_deg", ge=0)]
    """Largest distance of a sample from its pose in any joint, rad. Metres of a prismatic joint
    count as ``radians_of`` weighs them."""
    speed_weight: Annotated[float, Field(ge=0)]
    """Influence of the TCP's speed on the weights."""
