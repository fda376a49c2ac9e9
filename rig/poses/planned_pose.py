"""Poses of a plan, as files state them."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ...coverage.definitions.definition import definition, refuse
from ...coverage.definitions.field_types import Items
from ...coverage.definitions.units import Degrees

_Angle = Annotated[
    float, Degrees("q_deg", write=lambda q: round(float(np.degrees(q)), 6), ge=-720, le=720)
]


@definition
class PlannedPose:
    """A pose at which the robot stands."""

    q: Annotated[Items[_Angle], Field(min_length=1, max_length=20)]
    """Joint angles, rad."""


Poses = Annotated[Items[PlannedPose], Field(min_length=1, max_length=10_000)]


def planned_poses(joints: Float[np.ndarray, "P J"]) -> tuple[PlannedPose, ...]:
    """Return poses from their joint angles, rad."""
    return tuple(PlannedPose(tuple(q.tolist())) for q in joints)


def require_alike(key: str, poses: Sequence[PlannedPose]) -> None:
    """Raise ValidationError if the poses under a key have not as many angles as the first."""
    joints = len(poses[0].q)
    refuse(
        ((key, i, "q_deg"), len(pose.q), f"{joints} angles, as the first")
        for i, pose in enumerate(poses)
        if len(pose.q) != joints
    )
