"""Model of a scene. Files use degrees, code uses radians.

The model alone decides whether a file is valid. The limits and descriptions of its keys also form
the JSON Schema and the text of errors.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import (
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from ...coverage.definitions.definition import Fault, fields_of, refuse
from ...coverage.definitions.errors import InputError, UserError
from ...coverage.definitions.records import FILE_VERSION
from ...coverage.electronics.electronics import Electronics
from ...coverage.occlusion.occlusion_mode import Occlusion
from ...coverage.person_reach import Person
from ...coverage.rings.mounted_sensor import CellSensor, MountedSensor
from ...coverage.rings.ring import RING_RADIUS, Ring, Setup
from ...coverage.rings.rounding import setup_faults, table_of, with_scene
from ...coverage.robots.attached import Attached, Solid, named
from ...coverage.robots.base_frame import BaseFrame, base_frame, must_turn
from ...coverage.robots.built_in import PAPER_ROBOTS, UR10
from ...coverage.robots.calibration_table import CalibrationTable
from ...coverage.robots.robot import Robot
from ...coverage.robots.robot_table import RobotKey, robot_key
from ...coverage.robots.separation_distance import Safety
from ...coverage.sensors.board_packing import Printing
from ...coverage.sensors.sensor import Sensor
from ...coverage.targets.combined import TargetInFiles
from ...coverage.targets.posed_robot import Shape
from ...objectives.link_limits import LinkLimits
from ...objectives.motion_limits import Motion
from ...objectives.mount_rules import Limits, Rules
from ...objectives.obstacle import Obstacle
from ...objectives.poses import Pose, PoseTable, Recorded
from ...objectives.prices import Prices
from ...objectives.scene import REFERENCE_POSE_DEG, Scene, attached_faults
from ...objectives.trajectory import TrajectoryFile
from ...objectives.turned_cell import states_coordinates
from .base_model import StrictModel
from .versions import VersionedFile


def _without_files(solids: list[Solid], noun: str) -> tuple[Solid, ...]:
    """Return the solids that need no other file; the loader adds meshes."""
    return tuple(solid for solid in named(solids, noun) if solid.file is None)


class SceneModel(StrictModel):
    """A scene. Every key has a default; without any key it is the reference scene."""

    robot: RobotKey = Field(
        default_factory=lambda: UR10,
        json_schema_extra={"default": "ur10"},
        description="name of a built-in robot, a robot file (.toml), or a robot in-line",
    )
    base: BaseFrame | None = Field(
        default=None,
        description=(
            "frame of all coordinates in the base frame, for an arm of Universal Robots: base_link"
            " of its ROS description, or pendant, the feature Base of its pendant, turned by 180°"
            " about z; default: base_link"
        ),
    )
    calibration: CalibrationTable | None = Field(
        default=None,
        description="this arm's own kinematics, or a file of them (calibration.conf, .yaml)",
    )
    occlusion: Occlusion = Field(
        default="shadow",
        description="effect of the robot's own body on its sensors; default without bodies: ignore",
    )
    ring_radius: Annotated[float, Field(gt=0, le=1)] | None = Field(
        default=None,
        description=(
            f"radius of the rings, m; default {RING_RADIUS:g}, or more where a real ring needs it"
        ),
    )
    sensor: Sensor = Field(default=Sensor(), description="sensor of the rings")
    curve: Shape = Field(default=Shape(), description="pose curve and the volumes about it")
    mounts: dict[str, Limits] = Field(default={}, description="limits of rings by link")
    poses: list[PoseTable] = Field(
        default=[PoseTable(REFERENCE_POSE_DEG)],
        min_length=1,
        max_length=10_000,
        description="poses of the robot",
    )
    trajectory: TrajectoryFile | None = Field(
        default=None, description="recorded motion, in place of poses"
    )
    recorded: Recorded | None = Field(
        default=None, description="origin of the poses, if they come from a recorded motion"
    )
    over_poses: Literal["mean", "worst"] = Field(
        default="mean",
        description="coverage over several poses: their weighted mean or the worst pose",
    )
    targets: list[TargetInFiles] = Field(
        default=list(Scene.targets),
        min_length=1,
        max_length=100,
        description="target volumes",
    )
    safety: Safety = Field(
        default=Safety(), description="terms of the separation distance, for V_P"
    )
    motion: Motion = Field(default=Motion(), description="limits of motion for check --move")
    link: LinkLimits = Field(default=LinkLimits(), description="limits of the links of check")
    rules: Rules = Field(default=Rules(), description="rules that make a setup buildable")
    printing: Printing = Field(default=Printing(), description="parameters of printed rings")
    electronics: Electronics = Field(default=Electronics(), description="electronics of the rings")
    prices: Prices | None = Field(
        default=None, description="what a ring and a sensor cost, for the price of a setup"
    )
    fixed: list[Ring] = Field(
        default=[], max_length=1000, description="rings that are already mounted and stay"
    )
    fixed_sensors: list[MountedSensor] = Field(
        default=[], max_length=1000, description="single sensors that are already mounted and stay"
    )
    cell_sensors: list[CellSensor] = Field(
        default=[],
        max_length=1000,
        description="sensors of the cell, in the base frame; their coverage counts with any setup",
    )
    obstacles: list[Obstacle] = Field(
        default=[],
        max_length=1000,
        description="obstacles of the cell; they occlude and belong to no target",
    )
    person: Person | None = Field(
        default=None, description="where people walk and how far they reach"
    )
    attached: list[Attached] = Field(
        default=[],
        max_length=1000,
        description="tools and payloads; they move with their links and belong to the robot's body",
    )

    @field_validator("trajectory", mode="before")
    @classmethod
    def _only_a_name(cls, found: Any) -> Any:
        return {"file": found} if isinstance(found, str) else found

    @model_validator(mode="wrap")
    @classmethod
    def _agreeing(cls, keys: Any, read: Any) -> Any:
        self = read(keys)
        robot: Robot = self.robot
        if "poses" not in self.model_fields_set and robot_key(robot) not in PAPER_ROBOTS:
            rest = PoseTable.of(Pose(robot.rest), robot.chain)
            self.__dict__["poses"] = [rest]  # the model is frozen
        if not robot.bodies:
            rules = keys.get("rules", {}) if isinstance(keys, dict) else self.rules
            self._without_bodies(isinstance(rules, Rules) or "mount" in rules)
        refuse(self._faults(robot))
        try:
            self.to_domain()
        except InputError as error:  # by the scene itself, whose names are those of the keys
            if isinstance(error.__context__, ValidationError):
                raise error.__context__ from None
            raise
        return self

    @property
    def _fixed(self) -> Setup:
        """What is already mounted."""
        return Setup(tuple(self.fixed), tuple(self.fixed_sensors))

    def _without_bodies(self, mount_stated: bool) -> None:
        """Put in place of the defaults those that a robot without bodies allows."""
        if "occlusion" not in self.model_fields_set:
            self.__dict__["occlusion"] = "ignore"
        if not mount_stated:
            self.__dict__["rules"] = replace(self.rules, mount="free")

    def _faults(self, robot: Robot) -> Iterator[Fault]:
        """Yield what the robot does not allow of what a scene has otherwise than its file."""
        for i, pose in enumerate(self.poses):
            for where, found, allowed in pose.faults(robot):
                yield ("poses", i, *where), found, allowed
        try:
            must_turn(robot, self.base)
        except ValueError as error:
            yield ("base",), self.base, str(error)
        if self.calibration is not None:
            yield from self.calibration.faults(robot)
        yield from attached_faults(robot, self.attached)
        if self.rules.mount == "real" and not robot.bodies:
            allowed = f"free, because robot {robot.name} has no bodies"
            yield ("rules", "mount"), "real", allowed
        yield from setup_faults(self._fixed, robot, self.sensor, ("fixed", "fixed_sensors"))
        if self.trajectory is not None and "poses" in self.model_fields_set:
            yield ("trajectory",), self.trajectory.file, "either poses or a trajectory, not both"

    def to_domain(self) -> Scene:
        """Return the scene without the meshes and poses that other files hold."""
        robot, fixed = self.robot, Setup(tuple(self.fixed), tuple(self.fixed_sensors))
        if self.calibration is not None:
            robot = self.calibration.applied(robot)
        fixed = with_scene(fixed, self.sensor, self.ring_radius or RING_RADIUS)
        names = set(fields_of(Scene)) & type(self).model_fields.keys()
        same = {key: getattr(self, key) for key in names}
        return Scene(
            **same
            | {
                "robot": robot,
                "attached": _without_files(self.attached, "attached") or robot.attached,
                "poses": [pose.pose(robot.chain) for pose in self.poses],
                "rules": replace(self.rules, fixed=fixed.rings, fixed_sensors=fixed.singles),
                "obstacles": _without_files(self.obstacles, "obstacle"),
            }
        )

    @classmethod
    def from_domain(cls, value: Scene) -> Self:
        """Return the table of a scene.

        Raises:
            UserError: if no file can hold a target, as a function.
        """
        if not all(part.in_files for goal in value.targets for part in goal.parts()):
            raise UserError("a target by a function of Python's cannot be written to a file")
        return cls.record_of(value)

    @classmethod
    def record_of(cls, value: Scene) -> Self:
        """Return the record of a scene, of which files may be unable to hold the targets."""
        fixed = table_of(Setup(value.rules.fixed, value.rules.fixed_sensors), value.sensor)
        names = set(fields_of(Scene)) & cls.model_fields.keys()
        same = {key: getattr(value, key) for key in names}
        own = {
            "robot": robot_key(value.robot),
            "base": _written_base(value),
            "calibration": CalibrationTable.of(value.robot),
            "poses": [PoseTable.of(pose, value.robot.chain) for pose in value.poses],
            "fixed": fixed["rings"],
            "fixed_sensors": fixed["sensors"],
        }
        listed: dict[str, Any] = {
            key: list(v) if isinstance(v, tuple) else v for key, v in (same | own).items()
        }
        return cls(**listed)


def _written_base(scene: Scene) -> BaseFrame | None:
    """Return the base of a file: the robot's own, where it was stated or coordinates depend on
    it."""
    own = base_frame(scene.robot)
    return scene.base or (own if states_coordinates(scene) else None)


class SceneFile(SceneModel, VersionedFile):
    """A scene (TOML). Every key has a default: the empty file is the reference scene."""

    is_scene: ClassVar[bool] = True
    version: int = Field(
        default=FILE_VERSION,
        ge=1,
        description="version of the meaning of the keys; today's if absent",
        json_schema_extra={"maximum": FILE_VERSION},
    )
