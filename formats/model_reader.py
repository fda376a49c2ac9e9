"""A TOML file as its model, with the files that it names in place of their names."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from pydantic import ValidationError

from ..coverage.definitions.definition import adapter
from ..coverage.definitions.errors import UserError, explain, shown
from ..coverage.robots.attached import Attached, named
from ..coverage.robots.calibration_table import CalibrationTable
from ..coverage.robots.joint_values import misnamed, ordered
from ..coverage.robots.robot import Robot
from ..coverage.robots.robot_table import robot_key
from ..coverage.sensors.sensor_model import Model
from ..objectives.obstacle import Obstacle
from ..objectives.scene import Scene
from ..objectives.trajectory import TrajectoryFile
from .recorded_motion import NamedMotion
from .scene_meshes import parts_of_meshes
from .schema.proposal_models import ProposalFile
from .schema.target_models import TargetFile
from .schema.versions import FROM_FILE, RobotFile, SceneFile, SensorFile, refuse_newer
from .stop_times import read_stop_times
from .target_files import with_contents
from .toml_text import toml_keys
from .user_files import beside, read_bytes, read_text

_Model = TypeVar("_Model")
_CALIBRATION = 256 * 2**10  # bytes, largest calibration of an arm; real ones have about 1,000
_TABLE = re.compile(r"(.+?\.toml):(.*)", re.IGNORECASE | re.DOTALL)
_RINGS = {"rings", "sensors"}  # a proposal has a list of at least one of them


def file_and_table(path: Path) -> tuple[Path, str | None]:
    """Return the file and the name in ``FILE.toml:NAME``; the name is None for the path of a file.

    The name is that of one proposal, in a file that holds several.
    """
    parts = _TABLE.fullmatch(str(path))
    if parts is None or os.path.exists(path):  # False also for a name that no file can have
        return path, None
    return Path(parts[1]), parts[2]


def read_model(path: Path, model: type[_Model], robot: Robot | None = None) -> _Model:
    """Return the TOML file at ``path`` as ``model``.

    Args:
        path: the file; ``FILE.toml:NAME`` is the proposal NAME of a file that holds several.
        model: its model.
        robot: takes the place of a scene's own robot, if given.

    Raises:
        UserError: if it cannot be read or is not valid.
    """
    name, proposal = str(path), model is ProposalFile
    path, table = file_and_table(path) if proposal else (path, None)
    text = read_text(path, "TOML")
    try:
        raw = toml_keys(text)
        if proposal:
            raw = _one_proposal(path, raw, table)
        refuse_newer(raw)
        raw = _with_sensors(path, raw, model)
        if model is TargetFile:
            raw = with_contents(raw, str(path), beside_of(path))
        elif model is SceneFile:
            raw = _with_files(path, raw, "", robot)
        elif model is ProposalFile and isinstance(raw.get("scene"), dict):
            raw = {**raw, "scene": _with_files(path, raw["scene"], "scene.")}
        kind: Any = model
        return cast(_Model, adapter(kind).validate_python(raw, context=FROM_FILE))
    except ValidationError as error:
        raise explain(name, error, model) from error
    except (ValueError, RecursionError) as error:
        # from the parser, or from int() for thousands of digits
        raise UserError(f"{name}: not TOML: {error}") from error


def _one_proposal(path: Path, raw: dict[str, Any], table: str | None) -> dict[str, Any]:
    """Return the keys of a proposal, in a file of its own or in the table of a file of several."""
    alone = any(isinstance(raw.get(key), list) for key in _RINGS)
    several = [] if alone else [k for k, v in raw.items() if isinstance(v, dict) and _RINGS & {*v}]
    if table in several:
        keys: dict[str, Any] = raw[table]
        return keys
    names = ", ".join(map(shown, several))
    if table is not None:
        allowed = names or f"{path.name} without a name, because it does not hold several proposals"
        raise UserError(f"{path}: found no proposal {shown(table)}, allowed: {allowed}")
    if several:
        raise UserError(
            f"{path}: found {len(several)} proposals; name one as {path.name}:NAME, allowed:"
            f" {names}"
        )
    return raw


def _with_files(
    path: Path, scene: dict[str, Any], key: str, robot: Robot | None = None
) -> dict[str, Any]:
    """Return the keys of a scene with the contents of the files that it names: a robot, a
    calibration, measured stops, a recorded motion, meshes, and weights of targets.

    Args:
        path: the scene's file.
        scene: the keys.
        key: what precedes their names in messages.
        robot: takes the place of the scene's own, if given.
    """
    scene = dict(scene)
    if isinstance(name := scene.get("robot"), str) and name.lower().endswith((".toml", ".urdf")):
        scene["robot"] = _robot_in(path, f"{key}robot", name)
    if robot is not None:
        scene = _on_robot(scene, robot)
    if isinstance(name := scene.get("calibration"), str):
        file = beside(path, f"{key}calibration", name)
        scene["calibration"] = CalibrationTable.of(read_calibration(file, _robot_of(scene)))
    safety = scene.get("safety")
    if isinstance(safety, dict) and isinstance(name := safety.get("stop_times"), str):
        file = beside(path, f"{key}safety.stop_times", name)
        scene["safety"] = {**safety, "stop_times": read_stop_times(file, _robot_of(scene))}
    if isinstance(targets := scene.get("targets"), list):
        read, where = beside_of(path), f"{path}: {key}targets"
        scene["targets"] = [
            with_contents(table, f"{where}[{i}]", read) for i, table in enumerate(targets)
        ]
    if (motion := scene.get("trajectory")) is not None:
        scene["trajectory"] = _motion_in(path, f"{key}trajectory.file", motion)
    for name, kind in (("obstacles", Obstacle), ("attached", Attached)):
        if isinstance(solids := scene.get(name), list):
            scene[name] = _with_parts(solids, kind, f"{path}: {key}{name}", beside_of(path))
    return scene


def _motion_in(path: Path, key: str, motion: Any) -> Any:
    """Return the recorded motion that a scene names; what is no valid table as it is."""
    try:
        table = adapter(TrajectoryFile).validate_python(
            {"file": motion} if isinstance(motion, str) else motion
        )
    except ValidationError:
        return motion
    return NamedMotion(beside(path, key, table.file), table)


def _with_parts(tables: list[Any], kind: Any, where: str, read: Any) -> list[Any]:
    """Return the solids of a scene, with the convex parts of meshes after all others; tables that
    are not valid as they are."""
    if not any(isinstance(table, dict) and "file" in table for table in tables):
        return tables
    try:
        solids = [adapter(kind).validate_python(table) for table in tables]
    except ValidationError:
        return tables
    noun = "obstacle" if kind is Obstacle else "attached"
    here = (solid for solid in named(solids, noun) if solid.file is None)
    return [*here, *parts_of_meshes(solids, where, read)]


def _robot_of(scene: dict[str, Any]) -> Robot:
    """Return the robot of a scene with these keys."""
    read: Scene = adapter(Scene).validate_python({k: scene[k] for k in ("robot",) if k in scene})
    return read.robot


def _robot_in(path: Path, key: str, name: str) -> Robot:
    """Return the robot in a file that a scene names."""
    if name.lower().endswith(".urdf"):
        raise UserError(
            f"{path}: {key}: found {shown(name)}, allowed: a robot file (.toml); convert a URDF"
            " with place-rings robot"
        )
    robot: Robot = read_model(beside(path, key, name), RobotFile)
    return robot


def read_calibration(path: Path, robot: Robot) -> Robot:
    """Return a robot with the calibration in a file (``calibrated_from``).

    Raises:
        UserError: if it cannot be read or is not valid.
    """
    from .robots.calibration_files import calibrated_from

    text = read_text(path, "a calibration", _CALIBRATION)
    return calibrated_from(robot, str(path), text)


def _with_sensors(path: Path, raw: dict[str, Any], model: type, at: str = "") -> dict[str, Any]:
    """Return the keys of a file; sensor files that a scene or proposal names are replaced by their
    sensors.

    Args:
        path: the file.
        raw: keys of the table ``at`` of the file.
        model: model of the file.
        at: key of the table.
    """
    if model not in (SceneFile, ProposalFile):
        return raw

    def inlined(name: str, value: Any) -> Any:
        key = f"{at}.{name}".lstrip(".")
        match value:
            case {"model": str() as file} if name == "sensor" and file.lower().endswith(".toml"):
                return {**value, "model": read_sensor(beside(path, f"{key}.model", file))}
            case dict():
                return _with_sensors(path, value, model, key)
            case list():
                return [
                    _with_sensors(path, v, model, f"{key}[{i}]") if isinstance(v, dict) else v
                    for i, v in enumerate(value)
                ]
        return value

    return {name: inlined(name, value) for name, value in raw.items()}


def read_sensor(path: Path) -> Model:
    """Return the model of the sensor in a TOML file.

    Raises:
        UserError: if it cannot be read or is not valid.
    """
    return read_model(path, SensorFile)


def beside_of(path: Path) -> Callable[[str, str], tuple[Path, bytes]]:
    """Return a function that reads a file beside ``path``, from the key and the name."""

    def read(where: str, name: str) -> tuple[Path, bytes]:
        at = beside(path, where.removeprefix(f"{path}: "), name)
        return at, read_bytes(at, "mesh or NumPy")

    return read


def _on_robot(raw: dict[str, Any], robot: Robot) -> dict[str, Any]:
    """Return the keys of a scene with ``robot`` in place of its own.

    A single pose that is the rest pose of the scene's own robot becomes that of ``robot``. The
    calibration of the scene's own robot does not apply.
    """
    moved = {**raw, "robot": robot_key(robot)}
    moved.pop("calibration", None)
    own = _robot_of(raw)
    chain, rest = own.chain, own.rest
    match raw.get("poses"):
        case [{"q_deg": [*q_deg]}] if all(isinstance(a, int | float) for a in q_deg):
            stated = np.radians(q_deg)
        case [{"q": dict(values)}] if all(isinstance(v, int | float) for v in values.values()):
            stated = ordered(chain, values) if misnamed(chain, values) is None else np.zeros(0)
        case _:
            return moved
    if len(rest) == len(stated) and np.allclose(stated, rest, rtol=0, atol=1e-9):
        del moved["poses"]
    return moved
