"""The keys of a scene's file that are no arguments of ``Scene``: those that state its robot, poses
and rules otherwise, and the poses themselves, which only the robot's joints can read."""

from dataclasses import replace
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, WrapValidator
from pydantic_core import core_schema

from ..coverage.definitions.definition import adapter, definition, refuse
from ..coverage.definitions.field_types import Items
from ..coverage.rings.mounted_sensor import MountedSensor
from ..coverage.rings.ring import Ring, Setup
from ..coverage.rings.rounding import setup_faults, table_of, with_scene
from ..coverage.robots.calibration_table import CalibrationTable
from ..coverage.robots.robot import Robot
from .poses import Pose, PoseTable
from .scene_poses import poses_of
from .trajectory import TrajectoryFile

FIXED = ("fixed", "fixed_sensors")
"""Keys of the rings and of the single sensors that are already mounted."""


def _motion(value: Any, checked: Any) -> Any:
    """Return a recorded motion: one that was read, or the keys of its table; a text is its file."""
    if hasattr(value, "on_robot"):
        return value
    return checked({"file": value} if isinstance(value, str) else value)


@definition(kw_only=True)
class SceneKeys:
    """Keys of a scene's file that state its robot, poses and rules otherwise than in Python."""

    calibration: CalibrationTable | None = None
    """This arm's own kinematics, or a file of them (calibration.conf, .yaml)."""
    trajectory: Annotated[TrajectoryFile | None, WrapValidator(_motion)] = None
    """Recorded motion, in place of poses."""
    fixed: Annotated[Items[Ring], Field(max_length=1000)] = ()
    """Rings that are already mounted and stay."""
    fixed_sensors: Annotated[Items[MountedSensor], Field(max_length=1000)] = ()
    """Single sensors that are already mounted and stay."""

    def calibrated(self, robot: Robot) -> Robot:
        """Return a scene's robot with the stated calibration, if any.

        Raises:
            ValidationError: if it is that of another robot.
        """
        if self.calibration is None:
            return robot
        refuse(self.calibration.faults(robot))
        return self.calibration.applied(robot)

    def fields(self, scene: Any, robot: Robot) -> dict[str, Any]:
        """Return the fields of a scene on a robot that follow from the keys.

        Raises:
            ValidationError: if nobody read the recorded motion, or the robot does not carry what is
                fixed.
            UserError: if the recorded motion cannot be used.
        """
        fields: dict[str, Any] = {}
        if self.fixed or self.fixed_sensors:
            fixed = Setup(self.fixed, self.fixed_sensors)
            refuse(setup_faults(fixed, robot, scene.sensor, FIXED))
            fixed = with_scene(fixed, scene.sensor, scene.default_radius)
            own = {"fixed": fixed.rings, "fixed_sensors": fixed.singles}
            fields["rules"] = replace(scene.rules, **own)
        motion: Any = self.trajectory
        if motion is not None:
            if not hasattr(motion, "on_robot"):
                allowed = "poses, or a trajectory in a scene's file"
                refuse([(("trajectory",), motion.file, allowed)])
            fields["poses"], fields["recorded"] = motion.on_robot(robot)
        return fields


class _OfRobot:
    """Annotation of a pose that a file states as a ``PoseTable``, for the scene's robot."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        def read(value: Any, checked: Any, info: ValidationInfo) -> Any:
            if isinstance(value, Pose):
                return value
            table: PoseTable = checked(value)
            robot: Robot | None = info.data.get("robot")
            if robot is None:  # its own validation reports the error
                return table
            refuse(table.faults(robot))
            return poses_of(robot, table.pose(robot.chain))[0]

        return core_schema.with_info_wrap_validator_function(
            read,
            handler.generate_schema(PoseTable),
            serialization=core_schema.plain_serializer_function_ser_schema(lambda _: None),
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> Any:
        return handler(schema["schema"])


PoseOfRobot = Annotated[Pose, _OfRobot()]
"""A pose that a file states by the joints of the scene's robot; ``table_of_scene`` writes it."""


def table_of_scene(scene: Any, table: dict[str, Any]) -> dict[str, Any]:
    """Return the table of a scene with the keys of ``SceneKeys``, in the order of files."""
    robot, kind = scene.robot, adapter(PoseTable)
    own = CalibrationTable.of(robot)
    tables = [PoseTable.of(pose, robot.chain) for pose in scene.poses]
    fixed = table_of(Setup(scene.rules.fixed, scene.rules.fixed_sensors), scene.sensor)
    after: dict[str, dict[str, Any]] = {
        "base": {"calibration": own and adapter(CalibrationTable).dump_python(own, mode="json")},
        "poses": {"trajectory": None},
        "prices": {"fixed": fixed["rings"], "fixed_sensors": fixed["sensors"]},
    }
    if "poses" in table:
        table["poses"] = [kind.dump_python(one, mode="json") for one in tables]
    ordered: dict[str, Any] = {}
    for key, value in table.items():
        ordered |= {key: value} | after.get(key, {})
    return ordered
