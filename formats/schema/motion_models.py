"""Models of poses, of the recorded motions that they come from, and of the limits of robot
motion."""

from typing import Annotated, Literal

from pydantic import Field

from ...coverage.rings.rounding import degrees
from ...coverage.robots.separation_distance import Safety
from ...objectives.scene import Motion, Pose, Recorded
from ...objectives.trajectory import Thinning
from .field_types import MOST_DEG_S, Weight
from .mapping import DEGREES, MappedModel, Of


class PoseModel(MappedModel[Pose]):
    """A pose of the robot, with its weight and joint speeds."""

    q_deg: Annotated[
        list[Annotated[float, Field(ge=-720, le=720, description="joint angle, degrees")]],
        Of("q", DEGREES, array=True),
    ] = Field(min_length=1, max_length=20, description="joint angles, degrees")
    weight: Weight = 1.0
    time_s: float | None = Field(default=None, description="time in the recorded motion, s")
    rate_deg_s: Annotated[
        list[Annotated[float, Field(ge=-MOST_DEG_S, le=MOST_DEG_S, description="degrees/s")]]
        | None,
        Of("rate", DEGREES, array=True),
    ] = Field(default=None, description="joint speeds for V_P, degrees/s")


class SafetyModel(MappedModel[Safety]):
    """Terms of the separation distance of V_P, S = v_h (T_r + T_s) + v_r T_r + v_r T_s / 2 + C +
    Z_d + Z_r.

    v_r follows from a pose's joint speeds. No value here confers a safety rating.
    """

    human_speed: Annotated[float, Of("human")] = Field(
        default=Safety.human,
        gt=0,
        le=20,
        description="v_h, speed of a person, m/s; 1.6 by ISO 13855",
    )
    reaction_s: Annotated[float, Of("reaction")] = Field(
        default=Safety.reaction, ge=0, le=10, description="T_r, reaction time, s"
    )
    stopping_s: Annotated[float | None, Of("stopping")] = Field(
        default=None,
        ge=0,
        le=10,
        description="T_s, stopping time, s; default: from the robot's table",
    )
    intrusion_m: Annotated[float, Of("intrusion")] = Field(
        default=Safety.intrusion, ge=0, le=10, description="C, intrusion distance, m"
    )
    sensor_uncertainty_m: Annotated[float, Of("sensor")] = Field(
        default=Safety.sensor,
        ge=0,
        le=10,
        description="Z_d, uncertainty of the person's position, m",
    )
    robot_uncertainty_m: Annotated[float, Of("robot")] = Field(
        default=Safety.robot, ge=0, le=10, description="Z_r, uncertainty of the robot's position, m"
    )
    robot_speed: Annotated[float, Of("speed")] = Field(
        default=0.0, ge=0, le=20, description="v_r of all parts at poses without rate_deg_s, m/s"
    )


class MotionModel(MappedModel[Motion]):
    """Limits of motion for `check --move` on a real robot. They are no safety function."""

    speed_deg_s: Annotated[float, Of("speed", DEGREES)] = Field(
        default=degrees(Motion.speed),
        ge=1,
        le=60,
        description="speed of the leading joint, degrees/s",
    )
    acceleration_deg_s2: Annotated[float, Of("acceleration", DEGREES)] = Field(
        default=degrees(Motion.acceleration),
        gt=0,
        le=120,
        description="acceleration of the leading joint, degrees/s²",
    )
    near_m: Annotated[float, Of("near")] = Field(
        default=Motion.near,
        ge=0.05,
        le=4,
        description="distance below which a reading stops the robot, m",
    )
    self_m: Annotated[float, Of("own")] = Field(
        default=Motion.own,
        ge=0.01,
        le=1,
        description="least distance between bodies of the robot, m",
    )
    cell_m: Annotated[float, Of("cell")] = Field(
        default=Motion.cell,
        ge=0.02,
        le=1,
        description="least distance between the robot and obstacles, m",
    )
    near_share: float = Field(
        default=Motion.near_share,
        ge=0,
        le=1,
        description="least share of the sensors that must keep the full near_m",
    )
    failed_share: float = Field(
        default=Motion.failed_share,
        ge=0,
        le=0.5,
        description="largest share of a ring's sensors that may fail or freeze",
    )
    frozen_frames: int = Field(
        default=Motion.frozen_frames,
        ge=2,
        le=100,
        description=(
            "number of frames for which a ring's distances may stay unchanged during a motion"
        ),
    )
    cell_complete: bool = Field(
        default=False, description="whether the scene contains everything that the robot can reach"
    )
    rings_as_proposed: bool = Field(
        default=False,
        description=(
            "whether every ring is known to be wired correctly and mounted the right way round"
        ),
    )


class TrajectoryModel(MappedModel[Thinning]):
    """A recorded motion from which the poses are taken; the file name alone is enough."""

    file: str = Field(
        min_length=1, max_length=1000, description="CSV file in the scene's folder or below"
    )
    unit: Literal["rad", "deg"] = Field(
        default="rad", description="unit of the angles in the CSV file"
    )
    poses: int = Field(default=Thinning.poses, ge=1, le=2000, description="largest number of poses")
    within_deg: Annotated[float, Of("within", DEGREES)] = Field(
        default=degrees(Thinning.within),
        ge=0,
        le=90,
        description="distance below which no further pose is added, degrees",
    )
    speed_weight: float = Field(
        default=Thinning.speed_weight,
        ge=0,
        le=100,
        description="influence of speed on the weights; 0: dwell time alone",
    )


class RecordedModel(MappedModel[Recorded]):
    """Origin of the poses in a recorded motion."""

    file: Annotated[str, Field(max_length=1000)] = Field(description="name of the CSV file")
    rows: int = Field(ge=0, description="number of rows")
    seconds: float = Field(ge=0, description="duration, s")
    within_deg: Annotated[float, Of("within", DEGREES)] = Field(
        ge=0, description="largest distance of a sample from its pose in any joint, degrees"
    )
    speed_weight: float = Field(ge=0, description="influence of speed on the weights")
