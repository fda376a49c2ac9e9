"""The arguments of a scene: from what a user passes to the fields of ``CoreScene``."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from ._catalogue import robots
from ._errors import InputError, input_errors
from ._model_errors import model_error
from .coverage.electronics.electronics import Electronics
from .coverage.occlusion.occlusion_mode import OCCLUSIONS
from .coverage.person_reach import Person
from .coverage.rings.mounted_sensor import MountedSensor
from .coverage.robots.attached import Attached
from .coverage.robots.base_frame import BASE_FRAMES, must_turn
from .coverage.robots.robot import Robot
from .coverage.robots.separation_distance import Safety
from .coverage.sensors.sensor import Sensor
from .coverage.targets.target import Target, standalone
from .formats.schema.scene_models import SceneModel
from .objectives.mount_rules import Limits, Rules
from .objectives.prices import Prices
from .objectives.scene import Obstacle
from .objectives.scene import Scene as CoreScene
from .objectives.turned_cell import turned_scene


def with_robot(core: CoreScene, changes: Mapping[str, Any]) -> CoreScene:
    """Return the scene with another robot, which carries the same tools and payloads unless they
    change as well."""
    robot = robot_named(changes["robot"])
    if core.robot.attached and "attached" not in changes:
        with input_errors("attached"):
            robot = robot.with_attached(core.robot.attached)
    return replace(core, robot=robot)


def robot_named(robot: Robot | str) -> Robot:
    """Return a robot itself or by its name; raise InputError for anything else."""
    if isinstance(robot, Robot):
        return robot
    if not isinstance(robot, str) or robot not in robots:
        raise InputError(
            f"unknown robot {robot!r}; known: {', '.join(robots)}, or a Robot, as load returns it",
            "robot",
        )
    return robots[robot]


def changed(core: CoreScene, given: Mapping[str, Any]) -> CoreScene:
    """Return the scene with these arguments, except robot and poses; None stands for a default.

    Raises:
        InputError: for an invalid value, or a model of occlusion that needs the robot's bodies.
    """
    fields = {
        name: getattr(_DEFAULT, name) if value is None else _CHECKS[name](value, name)
        for name, value in given.items()
        if name in _CHECKS
    }
    if "ring_radius" in given:
        fields["radius_stated"] = given["ring_radius"] is not None
    if given.get("occlusion") in ("shadow", "blind") and not core.robot.bodies:
        found = given["occlusion"]
        raise InputError(
            f"found {found}, allowed: ignore, because robot {core.robot.name} has no bodies",
            "occlusion",
        )
    if "attached" in given:
        tools = () if given["attached"] is None else given["attached"]
        solids = _each(Attached, "Attached")(tools, "attached")
        with input_errors("attached"):
            fields["robot"] = core.robot.with_attached(solids)
    if _turns(core.robot, given.get("base")):
        turned = turned_scene(CoreScene(**{"robot": core.robot, **fields}))
        fields = {name: getattr(turned, name) for name in fields}
    if "base" in given:
        fields["base_stated"] = given["base"] is not None
    return replace(core, **fields)


def _turns(robot: Robot, base: Any) -> bool:
    """Return whether coordinates in the frame ``base`` are turned in the robot's own base."""
    if base not in (None, *BASE_FRAMES):
        raise InputError(f"found {base!r}, allowed: {', '.join(BASE_FRAMES)}", "base")
    try:
        return must_turn(robot, base)
    except ValueError as error:
        raise InputError(f"found {base!r}, allowed: {error}", "base") from error


def _choice(*allowed: str) -> Callable[[Any, str], str]:
    """Return a check that a value is one of these."""

    def check(value: Any, name: str) -> str:
        if value not in allowed:
            raise InputError(f"found {value!r}, allowed: {', '.join(allowed)}", name)
        choice: str = value
        return choice

    return check


def _of_type(kind: type) -> Callable[[Any, str], Any]:
    """Return a check that a value is of a type."""

    def check(value: Any, name: str) -> Any:
        if not isinstance(value, kind):
            raise InputError(f"found {value!r}, allowed: {kind.__name__}", name)
        return value

    return check


def _each(kind: type, allowed: str) -> Callable[[Any, str], tuple[Any, ...]]:
    """Return a check that a value is one of a type, or several, which returns a tuple."""

    def check(values: Any, name: str) -> tuple[Any, ...]:
        if isinstance(values, kind):
            values = (values,)
        try:
            each = tuple(values)
        except TypeError as error:
            raise InputError(f"found {values!r}, allowed: {allowed}, one or more", name) from error
        for value in each:
            if not isinstance(value, kind):
                raise InputError(f"found {value!r}, allowed: {allowed}", name)
        return each

    return check


def _mounts(mounts: Any, name: str) -> dict[str, Limits]:
    """Return limits by the name of the link; raise InputError for anything else."""
    if not isinstance(mounts, Mapping):
        raise InputError(f"found {mounts!r}, allowed: Limits by the name of the link", name)
    for link, limits in mounts.items():
        if not isinstance(link, str) or not isinstance(limits, Limits):
            allowed = "Limits by the name of the link"
            raise InputError(f"found {limits!r} for {link!r}, allowed: {allowed}", name)
    return dict(mounts)


def _targets(targets: Any, name: str) -> tuple[Target, ...]:
    """Return one or more targets as a tuple; raise InputError for anything else."""
    kinds = (
        "Near, Shell, ReachSphere, ToolSphere, ReachAndToolSpheres, ProtectiveVolume, or a volume"
        " of your own such as Box"
    )
    each = _each(Target, kinds)(targets, name)
    if not each:
        raise InputError("found none, allowed: one or more", name)
    with input_errors(name):
        return tuple(map(standalone, each))


_DEFAULT = CoreScene()
_CHECKS: dict[str, Callable[[Any, str], Any]] = {
    "targets": _targets,
    "sensor": _of_type(Sensor),
    "occlusion": _choice(*OCCLUSIONS),
    "ring_radius": lambda value, name: value,
    "mounts": _mounts,
    "rules": _of_type(Rules),
    "obstacles": _each(Obstacle, "Obstacle"),
    "cell_sensors": _each(MountedSensor, "MountedSensor on the link base"),
    "over_poses": _choice("mean", "worst"),
    "safety": _of_type(Safety),
    "electronics": _of_type(Electronics),
    "prices": _of_type(Prices),
    "person": _of_type(Person),
}


def checked(core: CoreScene) -> CoreScene:
    """Return the scene if its file would be valid; raise InputError otherwise."""
    try:
        SceneModel.record_of(core)
    except ValidationError as error:
        raise model_error("scene", error, SceneModel) from error
    return core
