"""The models of every file and of ``--json``. Degrees in files, radians in code.

A file is judged here and nowhere else: each key's limits and description also make the JSON Schema
and the words of an error. What a model stands for in code is made in ``formats/convert``.
"""

import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import (
    Discriminator,
    Field,
    Tag,
    ValidationInfo,
    field_validator,
    model_validator,
)

from ...coverage.occlusion.model import Occlusion
from ...coverage.rings.ring import RING_RADIUS
from ...coverage.robots.built_in import PAPER_ROBOTS, ROBOTS
from ...coverage.robots.separation_distance import WALKING
from ...coverage.solids.polyhedra import hull
from ...coverage.targets import NAMES, ROBOT_RADIUS, TCP_RANGE
from ...objectives.scene import REFERENCE_POSE_DEG
from ..errors import IN_LINE, NAMED
from .base_model import StrictModel, fault, refuse
from .field_types import FARTHEST, LONGEST_NAME, MOST_DEG_S, Metres, Weight
from .mount_models import MountModel, PrintingModel, RingModel, RulesModel, SensorModel
from .robot_convert import robot_of
from .robot_models import RobotFile


class PoseModel(StrictModel):
    q_deg: list[Annotated[float, Field(ge=-720, le=720, description="degrees")]] = Field(
        min_length=1, max_length=20
    )
    weight: Weight = 1.0
    time_s: float | None = Field(default=None, description="seconds, when a record was there")
    rate_deg_s: (
        list[Annotated[float, Field(ge=-MOST_DEG_S, le=MOST_DEG_S, description="degrees a second")]]
        | None
    ) = Field(default=None, description="speeds of the joints, for V_P")


class SafetyModel(StrictModel):
    """What the distances of V_P are made of, S = v_h (T_r + T_s) + v_r T_r + v_r T_s / 2 + C + Z_d
    + Z_r; v_r follows from the joints' speeds of a pose. No value here confers a safety rating."""

    human_speed: float = Field(
        default=WALKING, gt=0, le=20, description="m/s, v_h: 1.6 by ISO 13855"
    )
    reaction_s: float = Field(default=0.1, ge=0, le=10, description="seconds, T_r")
    stopping_s: float | None = Field(
        default=None, ge=0, le=10, description="seconds, T_s; by the robot's table"
    )
    intrusion_m: float = Field(default=0.2, ge=0, le=10, description="metres, C")
    sensor_uncertainty_m: float = Field(default=0.1, ge=0, le=10, description="metres, Z_d")
    robot_uncertainty_m: float = Field(default=0.05, ge=0, le=10, description="metres, Z_r")
    robot_speed: float = Field(
        default=0.0, ge=0, le=20, description="m/s, of all parts at poses without rate_deg_s"
    )


class MotionModel(StrictModel):
    """How `check --move` may move a real robot. It is no safety function."""

    speed_deg_s: float = Field(
        default=15.0, ge=1, le=60, description="degrees a second, of the leading joint"
    )
    acceleration_deg_s2: float = Field(
        default=30.0, gt=0, le=120, description="degrees a second squared, likewise"
    )
    near_m: float = Field(
        default=0.15,
        ge=0.05,
        le=4,
        description="metres: a reading nearer than that stops the robot",
    )
    self_m: float = Field(
        default=0.04,
        ge=0.01,
        le=1,
        description="metres, that the robot's bodies keep from each other",
    )
    cell_m: float = Field(
        default=0.1, ge=0.02, le=1, description="metres, that they keep from obstacles"
    )
    near_share: float = Field(
        default=0.5,
        ge=0,
        le=1,
        description="of the sensors that must keep the whole of near_m, at least",
    )
    failed_share: float = Field(
        default=0.25, ge=0, le=0.5, description="of a ring's sensors that may fail or freeze"
    )
    frozen_frames: int = Field(
        default=6,
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


class TrajectoryModel(StrictModel):
    """A recorded motion from which the poses are taken; the file's name alone will do."""

    file: str = Field(
        min_length=1, max_length=1000, description="CSV, beside the scene or below its folder"
    )
    unit: Literal["rad", "deg"] = "rad"
    poses: int = Field(default=200, ge=1, le=2000, description="poses, at most")
    within_deg: float = Field(
        default=2.0, ge=0, le=90, description="degrees, nearer than which no pose is added"
    )
    speed_weight: float = Field(default=1.0, ge=0, le=100, description="0: dwell time alone")


class RecordedModel(StrictModel):
    """Where the poses come from: a record's file, rows and seconds; the largest distance in any
    joint of a recorded sample from its pose; and by how much speed added to the weights."""

    file: Annotated[str, Field(max_length=1000)]
    rows: int = Field(ge=0)
    seconds: float = Field(ge=0)
    within_deg: float = Field(ge=0, description="degrees")
    speed_weight: float = Field(ge=0)


class TargetModel(StrictModel):
    name: Literal["V_O", "V_T", "V_OT", "V_S", "V_P"]
    radius: Metres | None = Field(
        default=None, validate_default=True, description="metres, of V_S only"
    )
    weight: float = Field(
        default=1.0, ge=0, le=1e6, description="relative weight, 0: only its floor counts"
    )
    at_least: float = Field(
        default=0.0, ge=0, le=100, description="percent that it shall have at least"
    )

    @field_validator("radius")
    @classmethod
    def _where_it_belongs(cls, radius: float | None, info: ValidationInfo) -> float | None:
        name = info.data.get("name")
        if name == "V_S" and radius is None:
            raise fault(None, "a radius in metres, as the target is V_S")
        if name in NAMES and name != "V_S" and radius is not None:
            raise fault(radius, f"no radius, as the target is {name}")
        return radius


class CurveModel(StrictModel):
    """The pose curve, and the volumes about it."""

    blend: float = Field(
        default=0.5, gt=0, le=1, description="share of a segment that its two bends take"
    )
    points_per_bend: int = Field(default=20, ge=2, le=1000, description="interpolation points")
    robot_radius: Annotated[Metres, Field(description="metres, of V_R, the robot's own volume")] = (
        ROBOT_RADIUS
    )
    tcp_range: Annotated[Metres, Field(description="metres, radius of V_T")] = TCP_RANGE


_Coordinate = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, description="metres, base frame")]
_Three = Field(min_length=3, max_length=3)
_Angle = Annotated[float, Field(ge=-360, le=360, description="degrees")]


class ObstacleModel(StrictModel):
    """Something that stands in the cell: a box (size), a mesh (file), the hull of points, or the
    floor, all below a height. ``centre`` and ``rpy_deg`` (about x, y, z of the base frame, in this
    order) place all but the floor."""

    name: str = Field(default="", max_length=LONGEST_NAME)
    centre: Annotated[list[_Coordinate], _Three] = [0.0, 0.0, 0.0]
    rpy_deg: Annotated[list[_Angle], _Three] = [0.0, 0.0, 0.0]
    size: Annotated[list[Metres], _Three] | None = Field(
        default=None, description="metres, of a box"
    )
    file: str | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="beside the scene or below its folder",
    )
    scale: float = Field(default=1.0, gt=0, le=1000, description="metres of a unit of the mesh")
    points: list[Annotated[list[_Coordinate], _Three]] | None = Field(
        default=None, min_length=4, max_length=20_000, description="metres, of which it is the hull"
    )
    floor: float | None = Field(
        default=None, ge=-FARTHEST, le=FARTHEST, description="metres, its height"
    )

    @model_validator(mode="after")
    def _of_one_kind(self) -> Self:
        kinds = ("size", "file", "points", "floor")
        given = [kind for kind in kinds if getattr(self, kind) is not None]
        if len(given) != 1:
            raise fault(given or None, f"one of {', '.join(kinds)}")
        if self.points is not None:
            try:
                hull(np.array(self.points))
            except ValueError as error:
                raise fault(self.points, "corners of a solid, not all in one plane") from error
        return self


RobotKey = Annotated[
    Annotated[str, Tag(NAMED)] | Annotated[RobotFile, Tag(IN_LINE)],
    Discriminator(lambda found: IN_LINE if isinstance(found, dict | RobotFile) else NAMED),
]


class SceneFile(StrictModel):
    """A scene (TOML). Every key has a default: the empty file is the reference scene."""

    robot: RobotKey = Field(
        default="ur10", description="a built-in robot, a robot's file (.toml), or a robot in-line"
    )
    occlusion: Occlusion = Field(
        default="ignore", description="what the robot's own body does to its sensors"
    )
    ring_radius: Metres | None = Field(
        default=None,
        description=f"metres; {RING_RADIUS:g} if none is given, more where a real ring needs it",
    )
    sensor: SensorModel = SensorModel()
    curve: CurveModel = CurveModel()
    mounts: dict[str, MountModel] = {}
    poses: list[PoseModel] = Field(
        default=[PoseModel(q_deg=list(REFERENCE_POSE_DEG))], min_length=1, max_length=10_000
    )
    trajectory: TrajectoryModel | None = Field(default=None, description="in place of poses")
    recorded: RecordedModel | None = None
    over_poses: Literal["mean", "worst"] = Field(
        default="mean", description="what counts of several poses"
    )
    targets: list[TargetModel] = Field(
        default=[TargetModel(name="V_S", radius=0.5)], min_length=1, max_length=100
    )
    safety: SafetyModel = SafetyModel()
    motion: MotionModel = MotionModel()
    rules: RulesModel = RulesModel()
    printing: PrintingModel = PrintingModel()
    fixed: list[RingModel] = Field(
        default=[], max_length=1000, description="rings that are there and stay"
    )
    obstacles: list[ObstacleModel] = Field(
        default=[], max_length=1000, description="of the cell: no targets, and they shadow"
    )

    @field_validator("robot")
    @classmethod
    def _known(cls, robot: str | RobotFile) -> str | RobotFile:
        if isinstance(robot, str) and robot not in ROBOTS:
            raise fault(robot, f"{', '.join(ROBOTS)}, or a robot's file (.toml)")
        return robot

    @field_validator("trajectory", mode="before")
    @classmethod
    def _only_a_name(cls, found: Any) -> Any:
        return {"file": found} if isinstance(found, str) else found

    @model_validator(mode="after")
    def _agreeing(self) -> Self:
        robot = robot_of(self.robot)
        if "poses" not in self.model_fields_set and self.robot not in PAPER_ROBOTS:
            rest = PoseModel(q_deg=[round(math.degrees(a), 9) for a in robot.rest])
            self.__dict__["poses"] = [rest]  # the model is frozen once it is made
        joints, links, inner = len(robot.chain), robot.links, self.curve.robot_radius
        faults: list[tuple[tuple[int | str, ...], Any, str]] = []
        for i, pose in enumerate(self.poses):
            if len(pose.q_deg) != joints:
                faults.append(
                    (
                        ("poses", i, "q_deg"),
                        len(pose.q_deg),
                        f"{joints} angles, one for each joint of {robot.name}",
                    )
                )
            elif (
                robot.limits is not None and (j := robot.beyond(np.radians(pose.q_deg))) is not None
            ):
                low, high = np.degrees(robot.limits[j])
                allowed = (
                    f"{low:.6g} to {high:.6g}, the limits of {robot.chain.joints[j]} of"
                    f" {robot.name}"
                )
                faults.append((("poses", i, "q_deg", j), pose.q_deg[j], allowed))
            if pose.rate_deg_s is not None and len(pose.rate_deg_s) != joints:
                faults.append(
                    (
                        ("poses", i, "rate_deg_s"),
                        len(pose.rate_deg_s),
                        f"{joints} speeds, one for each joint of {robot.name}",
                    )
                )
        for i, target in enumerate(self.targets):
            if target.radius is not None and target.radius <= inner:
                faults.append(
                    (
                        ("targets", i, "radius"),
                        target.radius,
                        f"above {inner:g}, the radius of the robot's own V_R",
                    )
                )
        faults += [
            (("fixed", i, "link"), ring.link, f"a link of {robot.name}: {', '.join(links)}")
            for i, ring in enumerate(self.fixed)
            if ring.link not in links
        ]
        if self.occlusion != "ignore" and not robot.bodies:
            faults.append(
                (("occlusion",), self.occlusion, f"ignore, as robot {self.robot} has no bodies")
            )
        if self.rules.mount == "real" and not robot.bodies:
            faults.append(
                (("rules", "mount"), "real", f"free, as robot {robot.name} has no bodies")
            )
        if self.trajectory is not None and "poses" in self.model_fields_set:
            faults.append(
                (("trajectory",), self.trajectory.file, "poses or a trajectory, not both")
            )
        if not any(target.weight > 0 for target in self.targets):
            faults.append(
                (
                    ("targets", 0, "weight"),
                    self.targets[0].weight,
                    "above 0 for one target at least",
                )
            )
        faults += [
            (("mounts", link), link, f"a link of {robot.name}: {', '.join(links)}")
            for link in self.mounts
            if link not in links
        ]
        refuse(faults)
        return self
