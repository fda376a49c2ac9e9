"""Model of poses."""

import math
from collections.abc import Iterator
from typing import Annotated, Any, Self

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from ...coverage.definitions.definition import Fault, refuse
from ...coverage.definitions.field_types import FARTHEST
from ...coverage.definitions.units import degrees
from ...coverage.robots.joint_values import (
    contradicted,
    in_file_units,
    joint_keys,
    misnamed,
    named,
    ordered,
)
from ...coverage.robots.kinematics import Chain
from ...coverage.robots.robot import Robot
from ...objectives.poses import Pose
from .field_types import MOST_DEG_S, Weight
from .mapping import MappedModel

_Turns = Annotated[
    float, Field(ge=-36_000, le=36_000, description="joint angle, degrees")
]  # a continuous joint turns many times; ``PoseModel.faults`` checks the others
_Rate = Annotated[float, Field(ge=-MOST_DEG_S, le=MOST_DEG_S, description="degrees/s")]


class PoseModel(MappedModel[Pose]):
    """A pose of the robot, with its weight and joint speeds.

    Joint values stand in the order of the joints, or by name; a robot with prismatic joints needs
    the names.
    """

    q_deg: list[_Turns] | None = Field(
        default=None, min_length=1, max_length=20, description="joint angles, degrees"
    )
    q: dict[str, _Turns] | None = Field(
        default=None,
        min_length=1,
        max_length=20,
        description=(
            "joint values by name and unit, such as shoulder_deg (degrees) of a revolute joint and"
            " rail_m (metres) of a prismatic one, in place of q_deg"
        ),
    )
    weight: Weight = 1.0
    time_s: float | None = Field(default=None, description="time in the recorded motion, s")
    rate_deg_s: list[_Rate] | None = Field(
        default=None, description="joint speeds for V_P, degrees/s"
    )
    rate: dict[str, _Rate] | None = Field(
        default=None,
        description=(
            "joint speeds for V_P by name and unit, such as shoulder_deg_s and rail_m_s, in place"
            " of rate_deg_s"
        ),
    )

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        faults: list[Fault] = []
        if self.q_deg is None and self.q is None:
            faults.append((("q_deg",), None, "joint angles in degrees, or q with joint names"))
        for listed, by_name in (("q_deg", "q"), ("rate_deg_s", "rate")):
            if getattr(self, listed) is not None and getattr(self, by_name) is not None:
                faults.append(((by_name,), "both", f"either {listed} or {by_name}"))
        refuse(faults)
        return self

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
            found, wanted = (in_file_units(chain, v)[j] for v in (q, settled))
            where = ("q", key) if self.q_deg is None else ("q_deg", j)
            yield where, found, f"{wanted:.6g}, as {chain.joints[j]} follows {led}"
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

    def joint_values(self, chain: Chain | None) -> Float[np.ndarray, " J"]:
        """Return the joint values (J,), rad or m; named ones need the robot's ``chain``."""
        if self.q is not None and chain is not None:
            return ordered(chain, self.q)
        return np.array([math.radians(v) for v in self.q_deg or ()])

    def to_domain(self, **given: Any) -> Pose:
        """Return the pose; pass the robot's ``chain`` where joints are named."""
        chain, rate = given.pop("chain", None), None
        if self.rate is not None:
            rate = ordered(chain, self.rate, speed=True)
        elif self.rate_deg_s is not None:
            rate = np.array([math.radians(v) for v in self.rate_deg_s])
        return super().to_domain(q=self.joint_values(chain), rate=rate, **given)

    @classmethod
    def from_domain(cls, value: Pose, **given: Any) -> Self:
        """Return the table of a pose; pass the robot's ``chain`` to name prismatic joints."""
        chain: Chain | None = given.pop("chain", None)
        if chain is not None and chain.prismatic:
            given["q"] = named(chain, value.q)
            given["rate"] = None if value.rate is None else named(chain, value.rate, speed=True)
        else:
            given["q_deg"] = [degrees(v) for v in value.q]
            given["rate_deg_s"] = None if value.rate is None else [degrees(v) for v in value.rate]
        return super().from_domain(value, **{"q": None, "rate": None, **given})
