"""The models of poses, of the recorded motions that they come from, and of how a robot may move."""

from typing import Annotated, Literal

from pydantic import Field

from ...coverage.rings.rounding import degrees
from ...coverage.robots.separation_distance import Safety
from ...objectives.scene import Motion, Pose, Recorded
from ...objectives.trajectory import Thinning
from .field_types import MOST_DEG_S, Weight
from .mapping import DEGREES, MappedModel, Of


class PoseModel(MappedModel[Pose]):
    q_deg: Annotated[
        list[Annotated[float, Field(ge=-720, le=720, description="degrees")]],
        Of("q", DEGREES, array=True),
    ] = Field(min_length=1, max_length=20)
    weight: Weight = 1.0
    time_s: float | None = Field(default=None, description="seconds, when a record was there")
    rate_deg_s: Annotated[
        list[Annotated[float, Field(ge=-MOST_DEG_S, le=MOST_DEG_S, description="degrees a second")]]
        | None,
        Of("rate", DEGREES, array=True),
    ] = Field(default=None, description="speeds of the joints, for V_P")


class SafetyModel(MappedModel[Safety]):
    """What the distances of V_P are made of, S = v_h (T_r + T_s) + v_r T_r + v_r T_s / 2 + C + Z_d
    + Z_r; v_r follows from the joints' speeds of a pose. No value here confers a safety rating."""

    human_speed: Annotated[float, Of("human")] = Field(
        default=Safety.human, gt=0, le=20, description="m/s, v_h: 1.6 by ISO 13855"
    )
    reaction_s: Annotated[float, Of("reaction")] = Field(
        default=Safety.reaction, ge=0, le=10, description="seconds, T_r"
    )
    stopping_s: Annotated[float | None, Of("stopping")] = Field(
        default=None, ge=0, le=10, description="seconds, T_s; by the robot's table"
    )
    intrusion_m: Annotated[float, Of("intrusion")] = Field(
        default=Safety.intrusion, ge=0, le=10, description="metres, C"
    )
    sensor_uncertainty_m: Annotated[float, Of("sensor")] = Field(
        default=Safety.sensor, ge=0, le=10, description="metres, Z_d"
    )
    robot_uncertainty_m: Annotated[float, Of("robot")] = Field(
        default=Safety.robot, ge=0, le=10, description="metres, Z_r"
    )
    robot_speed: Annotated[float, Of("speed")] = Field(
        default=0.0, ge=0, le=20, description="m/s, of all parts at poses without rate_deg_s"
    )


class MotionModel(MappedModel[Motion]):
    """How `check --move` may move a real robot. It is no safety function."""

    speed_deg_s: Annotated[float, Of("speed", DEGREES)] = Field(
        default=degrees(Motion.speed),
        ge=1,
        le=60,
        description="degrees a second, of the leading joint",
    )
    acceleration_deg_s2: Annotated[float, Of("acceleration", DEGREES)] = Field(
        default=degrees(Motion.acceleration),
        gt=0,
        le=120,
        description="degrees a second squared, likewise",
    )
    near_m: Annotated[float, Of("near")] = Field(
        default=Motion.near,
        ge=0.05,
        le=4,
        description="metres: a reading nearer than that stops the robot",
    )
    self_m: Annotated[float, Of("own")] = Field(
        default=Motion.own,
        ge=0.01,
        le=1,
        description="metres, that the robot's bodies keep from each other",
    )
    cell_m: Annotated[float, Of("cell")] = Field(
        default=Motion.cell, ge=0.02, le=1, description="metres, that they keep from obstacles"
    )
    near_share: float = Field(
        default=Motion.near_share,
        ge=0,
        le=1,
        description="of the sensors that must keep the whole of near_m, at least",
    )
    failed_share: float = Field(
        default=Motion.failed_share,
        ge=0,
        le=0.5,
        description="of a ring's sensors that may fail or freeze",
    )
    frozen_frames: int = Field(
        default=Motion.frozen_frames,
        ge=2,
        le=100,
        description="frames in which a ring's distances may stay unchanged during a motion",
    )
    cell_complete: bool = Field(
        default=False, description="true: all that the robot can reach is in the scene"
    )
    rings_as_proposed: bool = Field(
        default=False,
        description="true: every ring is known to be wired and mounted the right way round",
    )


class TrajectoryModel(MappedModel[Thinning]):
    """A recorded motion from which the poses are taken; the file's name alone will do."""

    file: str = Field(
        min_length=1, max_length=1000, description="CSV, beside the scene or below its folder"
    )
    unit: Literal["rad", "deg"] = "rad"
    poses: int = Field(default=Thinning.poses, ge=1, le=2000, description="poses, at most")
    within_deg: Annotated[float, Of("within", DEGREES)] = Field(
        default=degrees(Thinning.within),
        ge=0,
        le=90,
        description="degrees, nearer than which no pose is added",
    )
    speed_weight: float = Field(
        default=Thinning.speed_weight, ge=0, le=100, description="0: dwell time alone"
    )


class RecordedModel(MappedModel[Recorded]):
    """Where the poses come from: a record's file, rows and seconds; the largest distance in any
    joint of a recorded sample from its pose; and by how much speed added to the weights."""

    file: Annotated[str, Field(max_length=1000)]
    rows: int = Field(ge=0)
    seconds: float = Field(ge=0)
    within_deg: Annotated[float, Of("within", DEGREES)] = Field(ge=0, description="degrees")
    speed_weight: float = Field(ge=0)
