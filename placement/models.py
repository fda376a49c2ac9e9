"""The models of every file and of ``--json``. Degrees in files, radians in code.

A file is judged here and nowhere else: each key's limits and description also make the JSON Schema and the words of an
error. What a model stands for in code is made in ``convert``.
"""

import math
from collections.abc import Iterable
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from ..coverage.catalogue import MODELS
from ..coverage.effective import effective
from ..coverage.rings import RING_RADIUS
from ..coverage.robots import ROBOTS
from ..coverage.sensors import Use
from ..coverage.separation import WALKING
from ..coverage.targets import NAMES, ROBOT_RADIUS, TCP_RANGE
from ..objectives.scene import REFERENCE_POSE_DEG
from .errors import shown

Weight = Annotated[float, Field(gt=0, le=1e6, description="relative weight")]
Metres = Annotated[float, Field(gt=0, le=100, description="metres")]
Percent = Annotated[float, Field(ge=0, le=100, description="percent")]
Tilt = Annotated[float, Field(gt=-90, lt=90, description="degrees, positive towards distal")]
Position = Annotated[float, Field(ge=0, le=1, description="0 proximal to 1 distal")]
_USES = ("ambient", "reflectance", "target_size")
_SAME = 1e-6  # degrees and metres, by which a stated beam may be off that of the catalogue


class StrictModel(BaseModel):
    """No key unknown, no value bent into shape, nothing changed once read."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def _fault(found: Any, allowed: str) -> PydanticCustomError:
    return PydanticCustomError("rule", "found {found}, allowed: {allowed}", {"found": shown(found), "allowed": allowed})


def refuse(faults: Iterable[tuple[tuple[int | str, ...], Any, str]]) -> None:
    """Raise one error with all faults (key, what was found there, what is allowed), if there are any."""
    details = [InitErrorDetails(type=_fault(found, allowed), loc=loc, input=None) for loc, found, allowed in faults]
    if details:
        raise ValidationError.from_exception_data("file", details)


class PoseModel(StrictModel):
    q_deg: list[Annotated[float, Field(ge=-720, le=720, description="degrees")]] = Field(min_length=1, max_length=20)
    weight: Weight = 1.0
    time_s: float | None = Field(default=None, description="seconds, when a record was there")
    rate_deg_s: list[Annotated[float, Field(ge=-3600, le=3600, description="degrees a second")]] | None = Field(
        default=None, description="speeds of the joints, for V_P"
    )


class SafetyModel(StrictModel):
    """What the distances of V_P are made of, S = v_h (T_r + T_s) + v_r T_r + v_r T_s / 2 + C + Z_d + Z_r; v_r follows from
    the joints' speeds of a pose. No value here confers a safety rating."""

    human_speed: float = Field(default=WALKING, gt=0, le=20, description="m/s, v_h: 1.6 by ISO 13855")
    reaction_s: float = Field(default=0.1, ge=0, le=10, description="seconds, T_r")
    stopping_s: float | None = Field(default=None, ge=0, le=10, description="seconds, T_s; by the robot's table")
    intrusion_m: float = Field(default=0.2, ge=0, le=10, description="metres, C")
    sensor_uncertainty_m: float = Field(default=0.1, ge=0, le=10, description="metres, Z_d")
    robot_uncertainty_m: float = Field(default=0.05, ge=0, le=10, description="metres, Z_r")
    robot_speed: float = Field(default=0.0, ge=0, le=20, description="m/s, of all parts at poses without rate_deg_s")


class TrajectoryModel(StrictModel):
    """A recorded motion from which the poses are taken; the file's name alone will do."""

    file: str = Field(min_length=1, max_length=1000, description="CSV, beside the scene or below its folder")
    unit: Literal["rad", "deg"] = "rad"
    poses: int = Field(default=200, ge=1, le=2000, description="poses, at most")
    within_deg: float = Field(default=2.0, ge=0, le=90, description="degrees, nearer than which no pose is added")
    speed_weight: float = Field(default=1.0, ge=0, le=100, description="0: dwell time alone")


class RecordedModel(StrictModel):
    """Where the poses come from: a record's file, rows and seconds; the largest distance in any joint of a recorded sample
    from its pose; and by how much speed added to the weights."""

    file: Annotated[str, Field(max_length=1000)]
    rows: int = Field(ge=0)
    seconds: float = Field(ge=0)
    within_deg: float = Field(ge=0, description="degrees")
    speed_weight: float = Field(ge=0)


class TargetModel(StrictModel):
    name: Literal["V_O", "V_T", "V_OT", "V_S", "V_P"]
    radius: Metres | None = Field(default=None, validate_default=True, description="metres, of V_S only")
    weight: float = Field(default=1.0, ge=0, le=1e6, description="relative weight, 0: only its floor counts")
    at_least: float = Field(default=0.0, ge=0, le=100, description="percent that it shall have at least")

    @field_validator("radius")
    @classmethod
    def _where_it_belongs(cls, radius: float | None, info: ValidationInfo) -> float | None:
        name = info.data.get("name")
        if name == "V_S" and radius is None:
            raise _fault(None, "a radius in metres, as the target is V_S")
        if name in NAMES and name != "V_S" and radius is not None:
            raise _fault(radius, f"no radius, as the target is {name}")
        return radius


class SensorModel(StrictModel):
    """A beam; or a model of the catalogue and what it is used for, from which the beam follows. A file may state both, as
    those that are written do, if they agree."""

    fov_deg: float = Field(default=25.0, gt=0, lt=180, description="degrees, the full angle")
    range_m: Metres = 1.5
    fov_up_deg: float | None = Field(
        default=None, gt=0, lt=180, description="degrees, of a square beam along its ring's axis; none: a round beam"
    )
    model: Annotated[str, Field(max_length=100)] | None = Field(default=None, description="of the catalogue")
    ambient: Annotated[str, Field(max_length=100)] | None = Field(default=None, description="light, like 50kcps or 5klx")
    reflectance: float | None = Field(default=None, gt=0, le=1, description="of the target, a share")
    target_size: Annotated[list[Metres], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="width and height of the target, metres"
    )

    @property
    def use(self) -> Use | None:
        """What the model is used for; None without one."""
        if self.model is None:
            return None
        size = None if self.target_size is None else (self.target_size[0], self.target_size[1])
        return Use(self.model, self.ambient, self.reflectance, size)

    @model_validator(mode="after")
    def _of_the_catalogue(self) -> Self:
        use, given = self.use, self.model_fields_set
        if use is None:
            refuse(((key,), getattr(self, key), "only beside a model") for key in _USES if getattr(self, key) is not None)
            return self
        if use.model not in MODELS:
            refuse([(("model",), use.model, ", ".join(MODELS))])
        try:
            found = effective(use).sensor
        except ValueError as error:
            raise PydanticCustomError("rule", "{error}", {"error": str(error)}) from error
        up = None if found.fov_up is None else math.degrees(found.fov_up)
        beam = {"fov_deg": math.degrees(found.fov), "range_m": found.range_m, "fov_up_deg": up}
        refuse(
            ((key,), getattr(self, key), f"{value:.9g}, as {use.model} has it here, or no such key")
            for key, value in beam.items()
            if key in given and value is not None and abs((getattr(self, key) or 0.0) - value) > _SAME
        )
        refuse(
            ((key,), getattr(self, key), f"no such key, as the beam of {use.model} is round")
            for key, value in beam.items()
            if value is None and getattr(self, key) is not None
        )
        return self


class CurveModel(StrictModel):
    blend: float = Field(default=0.5, gt=0, le=1, description="share of a segment that its two bends take")
    points_per_bend: int = Field(default=20, ge=2, le=1000, description="interpolation points")
    robot_radius: Metres = ROBOT_RADIUS
    tcp_range: Metres = TCP_RANGE


def _ascending(pair: list[Any]) -> list[Any]:
    if pair[0] > pair[1]:
        raise _fault(f"{pair}", "the lower value first")
    return pair


Interval = Annotated[list[Position], Field(min_length=2, max_length=2), AfterValidator(_ascending)]


class MountModel(StrictModel):
    position: Interval = [0.0, 1.0]
    tilt_deg: Annotated[list[Tilt], Field(min_length=2, max_length=2), AfterValidator(_ascending)] = [-70.0, 70.0]
    keep_out: list[Interval] = Field(default=[], max_length=100, description="intervals without rings")
    sensor: SensorModel | None = Field(default=None, description="the scene's, if none is given")


class RulesModel(StrictModel):
    """What makes a setup buildable."""

    spacing: float = Field(default=0.03, ge=0, le=10, description="metres, between two rings on a link")
    from_joints: float = Field(default=0.0, ge=0, le=10, description="metres, from a link's ends")
    sensors_per_ring: Annotated[
        list[Annotated[int, Field(ge=1, le=1000)]], Field(min_length=2, max_length=2), AfterValidator(_ascending)
    ] = [3, 24]
    rings_per_link: int = Field(default=8, ge=1, le=200, description="rings, at most")
    shared_tilt: bool = Field(default=False, description="all rings have one tilt, up to its sign")


class RingModel(StrictModel):
    link: Annotated[str, Field(max_length=100)]
    position: Position = 0.0
    count: int = Field(ge=1, le=1000, description="sensors")
    tilt_deg: Tilt = 0.0
    phase_deg: float = Field(default=0.0, ge=-360, le=360, description="degrees")
    radius: Metres | None = Field(default=None, description="metres; the scene's, if none is given")
    sensor: SensorModel | None = Field(default=None, description="the scene's, if none is given")


_Index = Annotated[int, Field(ge=0, le=999, description="counted from 0")]
_Place = Annotated[float, Field(ge=-100, le=100, description="metres, base frame")]
_Part = Annotated[float, Field(ge=-1.001, le=1.001, description="part of a unit vector, base frame")]


class ConeRow(StrictModel):
    """A row of ``place-rings cones``: a sensor at a pose, base frame."""

    pose: int = Field(ge=0, lt=10_000, description="counted from 0")
    ring: _Index
    sensor: _Index
    apex_x: _Place
    apex_y: _Place
    apex_z: _Place
    axis_x: _Part
    axis_y: _Part
    axis_z: _Part
    fov_deg: float = Field(gt=0, lt=180, description="degrees, the full angle")
    range_m: Metres


class SceneFile(StrictModel):
    """A scene (TOML). Every key has a default: the empty file is the reference scene."""

    robot: str = "ur10"
    occlusion: Literal["ignore"] = "ignore"
    ring_radius: Metres = RING_RADIUS
    sensor: SensorModel = SensorModel()
    curve: CurveModel = CurveModel()
    mounts: dict[str, MountModel] = {}
    poses: list[PoseModel] = Field(default=[PoseModel(q_deg=list(REFERENCE_POSE_DEG))], min_length=1, max_length=10_000)
    trajectory: TrajectoryModel | None = Field(default=None, description="in place of poses")
    recorded: RecordedModel | None = None
    over_poses: Literal["mean", "worst"] = "mean"
    targets: list[TargetModel] = Field(default=[TargetModel(name="V_S", radius=0.5)], min_length=1, max_length=100)
    safety: SafetyModel = SafetyModel()
    rules: RulesModel = RulesModel()
    fixed: list[RingModel] = Field(default=[], max_length=1000, description="rings that are there and stay")

    @field_validator("robot")
    @classmethod
    def _known(cls, name: str) -> str:
        if name not in ROBOTS:
            raise _fault(name, ", ".join(ROBOTS))
        return name

    @field_validator("trajectory", mode="before")
    @classmethod
    def _only_a_name(cls, found: Any) -> Any:
        return {"file": found} if isinstance(found, str) else found

    @model_validator(mode="after")
    def _agreeing(self) -> Self:
        robot = ROBOTS[self.robot]
        joints, links, inner = len(robot.chain), robot.links, self.curve.robot_radius
        faults: list[tuple[tuple[int | str, ...], Any, str]] = []
        for i, pose in enumerate(self.poses):
            if len(pose.q_deg) != joints:
                faults.append(
                    (("poses", i, "q_deg"), len(pose.q_deg), f"{joints} angles, one for each joint of {self.robot}")
                )
            if pose.rate_deg_s is not None and len(pose.rate_deg_s) != joints:
                faults.append(
                    (
                        ("poses", i, "rate_deg_s"),
                        len(pose.rate_deg_s),
                        f"{joints} speeds, one for each joint of {self.robot}",
                    )
                )
        for i, target in enumerate(self.targets):
            if target.radius is not None and target.radius <= inner:
                faults.append(
                    (("targets", i, "radius"), target.radius, f"above {inner:g}, the radius of the robot's own V_R")
                )
        faults += [
            (("fixed", i, "link"), ring.link, f"a link of {self.robot}: {', '.join(links)}")
            for i, ring in enumerate(self.fixed)
            if ring.link not in links
        ]
        if self.trajectory is not None and "poses" in self.model_fields_set:
            faults.append((("trajectory",), self.trajectory.file, "poses or a trajectory, not both"))
        if not any(target.weight > 0 for target in self.targets):
            faults.append((("targets", 0, "weight"), self.targets[0].weight, "above 0 for one target at least"))
        faults += [
            (("mounts", link), link, f"a link of {self.robot}: {', '.join(links)}")
            for link in self.mounts
            if link not in links
        ]
        refuse(faults)
        return self
