"""The arguments of a scene: from what a user passes to the fields of ``CoreScene``."""

from collections.abc import Callable, Iterable, Mapping
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
from .objectives.scene import CoreScene, Obstacle
from .objectives.turned_cell import turned_attached, turned_obstacle, turned_single

_KINDS: dict[str, type] = {
    "sensor": Sensor,
    "rules": Rules,
    "safety": Safety,
    "electronics": Electronics,
}


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
    """Return the scene with these arguments, except robot and poses.

    Raises:
        InputError: for an invalid value, or a model of occlusion that needs the robot's bodies.
    """
    fields, occlusion = _fields(given), given.get("occlusion")
    turn = _turns(core.robot, given.get("base"))
    if "base" in given:
        fields["base_stated"] = given["base"] is not None
    if turn:
        fields |= _turned(fields)
    if occlusion in ("shadow", "blind") and not core.robot.bodies:
        raise InputError(
            f"found {occlusion}, allowed: ignore, because robot {core.robot.name} has no bodies",
            "occlusion",
        )
    if "attached" in given:
        each = _each(given["attached"], Attached, "attached", "attached(...)")
        each = tuple(map(turned_attached, each)) if turn else each
        with input_errors("attached"):
            fields["robot"] = core.robot.with_attached(each)
    return replace(core, **fields)


def _turns(robot: Robot, base: Any) -> bool:
    """Return whether coordinates in the frame ``base`` are turned in the robot's own base."""
    if base not in (None, *BASE_FRAMES):
        raise InputError(f"found {base!r}, allowed: {', '.join(BASE_FRAMES)}", "base")
    try:
        return must_turn(robot, base)
    except ValueError as error:
        raise InputError(f"found {base!r}, allowed: {error}", "base") from error


def _turned(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return those fields that hold coordinates in the base frame, turned by 180° about z."""
    turns: dict[str, Callable[[Any], Any]] = {
        "obstacles": turned_obstacle,
        "cell_sensors": turned_single,
        "targets": Target.turned,
    }
    new: dict[str, Any] = {
        name: tuple(map(turn, fields[name])) for name, turn in turns.items() if name in fields
    }
    if "rules" in fields:
        fixed = tuple(map(turned_single, fields["rules"].fixed_sensors))
        new["rules"] = replace(fields["rules"], fixed_sensors=fixed)
    return new


def _fields(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the internal fields for all arguments except robot and poses; None becomes the
    default.

    Raises:
        InputError: for values of the wrong type.
    """
    fields: dict[str, Any] = {}
    for name, one_of in (("occlusion", OCCLUSIONS), ("over_poses", ("mean", "worst"))):
        if name in given:
            value = getattr(CoreScene, name) if given[name] is None else given[name]
            if value not in one_of:
                raise InputError(f"found {value!r}, allowed: {', '.join(one_of)}", name)
            fields[name] = value
    for name, kind in _KINDS.items():
        if name in given:
            value = kind() if given[name] is None else given[name]
            if not isinstance(value, kind):
                raise InputError(f"found {value!r}, allowed: {kind.__name__}", name)
            fields[name] = value
    for name, kind in (("prices", Prices), ("person", Person)):
        if name in given:
            if not isinstance(given[name], kind | None):
                raise InputError(f"found {given[name]!r}, allowed: {kind.__name__}", name)
            fields[name] = given[name]
    if "mounts" in given:
        fields["mounts"] = _limits(given["mounts"])
    if "obstacles" in given:
        fields["obstacles"] = _each(given["obstacles"], Obstacle, "obstacles", "obstacle(...)")
    if "cell_sensors" in given:
        allowed = "MountedSensor on the link base"
        some = given["cell_sensors"]
        fields["cell_sensors"] = _each(some, MountedSensor, "cell_sensors", allowed)
    if "targets" in given:
        default = given["targets"] is None
        fields["targets"] = CoreScene.targets if default else _goals(given["targets"])
    if "ring_radius" in given:
        radius = given["ring_radius"]
        fields["radius_stated"] = radius is not None
        fields["ring_radius"] = CoreScene.ring_radius if radius is None else radius
    return fields


def _limits(mounts: Any) -> dict[str, Limits]:
    """Return limits by the name of the link; raise InputError for anything else."""
    if not isinstance(mounts, Mapping | None):
        raise InputError(f"found {mounts!r}, allowed: Limits by the name of the link", "mounts")
    for link, limits in (mounts or {}).items():
        if not isinstance(link, str) or not isinstance(limits, Limits):
            raise InputError(
                f"found {limits!r} for {link!r}, allowed: Limits by the name of the link", "mounts"
            )
    return dict(mounts or {})


def _each(values: Any, kind: type, name: str, allowed: str) -> tuple[Any, ...]:
    """Return one value of a type, several, or None as a tuple; otherwise raise InputError."""
    if isinstance(values, kind):
        values = (values,)
    if not isinstance(values, Iterable | None):
        raise InputError(f"found {values!r}, allowed: {allowed}, one or more", name)
    each = tuple(values or ())
    for one in each:
        if not isinstance(one, kind):
            raise InputError(f"found {one!r}, allowed: {allowed}", name)
    return each


def _goals(targets: Any) -> tuple[Any, ...]:
    kinds = (
        "Near, Shell, ReachSphere, ToolSphere, ReachAndToolSpheres, ProtectiveVolume, or a volume"
        " of your own such as Box"
    )
    each = _each(targets, Target, "targets", kinds)
    if not each:
        raise InputError("found none, allowed: one or more", "targets")
    with input_errors("targets"):
        return tuple(map(standalone, each))


def checked(core: CoreScene) -> CoreScene:
    """Return the scene if its file would be valid; raise InputError otherwise."""
    try:
        SceneModel.record_of(core)
    except ValidationError as error:
        raise model_error("scene", error, SceneModel) from error
    return core
