"""Readers of the files and names that a user passes."""

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError

from ..coverage.definitions.errors import UserError, explain, key_path, shown, unusable
from ..coverage.rings.ring import Setup
from ..coverage.rings.rounding import setup_faults, within_files
from ..coverage.robots.built_in import UR10
from ..coverage.robots.robot import Robot
from ..coverage.sensors.sensor import Sensor
from ..coverage.targets.target import Target
from ..objectives.named_layouts import layout_in
from ..objectives.scene import Scene
from ..placement.search.result import SearchResult
from .model_reader import file_and_table, read_model
from .schema.proposal_models import ProposalFile
from .schema.target_models import TargetFile
from .schema.versions import RobotFile, SceneFile
from .user_files import read_text

if TYPE_CHECKING:
    from .sensors.urdf_frames import FramePattern

_SENSOR_LISTS = (".csv", ".json", ".urdf")
_LOOKS_LIKE_A_NAME = re.compile(r"n\d+_[^/\\.]*(\.\d+)?")


def read_robot(path: Path) -> Robot:
    """Return the robot in a TOML file.

    Raises:
        UserError: if it cannot be read or is not valid.
    """
    robot: Robot = read_model(path, RobotFile)
    return robot


def read_scene(path: Path, robot: Robot | None = None) -> Scene:
    """Return the scene in a TOML file.

    Args:
        path: the file.
        robot: the robot that the whole scene is read for, in place of its own, if given.

    Raises:
        UserError: if it, or a file that it names, cannot be read or is not valid.
    """
    scene: Scene = read_model(path, SceneFile, robot)
    return scene


def read_target(path: Path, robot: Robot = UR10) -> Target:
    """Return the target in a TOML file, with its weight and minimum coverage, in a robot's base.

    Raises:
        UserError: if it, or a file that it names, cannot be read or is not valid.
    """
    file = read_model(path, TargetFile)
    try:
        return file.on(robot)
    except ValueError as error:
        raise UserError(f"{path}: base: found {file.base}, allowed: {error}") from error


def with_sensor(scene: Scene, sensor: Sensor | None) -> Scene:
    """Return ``scene`` with ``sensor``, if given; fixed rings and single sensors that had the
    scene's sensor receive it too."""
    if sensor is None:
        return scene
    fixed = Setup(scene.rules.fixed, scene.rules.fixed_sensors)
    fixed = fixed.with_sensors(lambda own: sensor if own == scene.sensor else own)
    rules = replace(scene.rules, fixed=fixed.rings, fixed_sensors=fixed.singles)
    return replace(scene, sensor=sensor, rules=rules)


def read_proposal(path: Path, sensor: Sensor | None = None) -> tuple[Setup, Scene, ProposalFile]:
    """Return setup, scene and whole file of a proposal.

    Args:
        path: the file.
        sensor: replaces the scene's sensor, if given.

    Raises:
        UserError: if the file cannot be read or is not valid.
    """
    file = read_model(path, ProposalFile)
    scene = with_sensor(file.scene, sensor)
    try:
        return file.setup(scene), scene, file
    except ValueError as error:
        raise UserError(f"{path}: sensors: {error}") from error


def resolve(
    name_or_path: str,
    scene: Scene | None,
    sensor: Sensor | None = None,
    frames: "FramePattern | None" = None,
) -> tuple[Setup, Scene]:
    """Return a setup and its scene.

    A name of the paper's layouts is resolved in ``scene``. A file with sensors is fitted there: a
    CSV list at the scene's poses, a JSON file with poses on links, or a URDF with sensor
    ``frames``. Any other file, or ``FILE.toml:NAME``, is read as a proposal. A proposal brings its
    own scene unless ``scene`` is given; without one, the others use the reference scene.

    Args:
        name_or_path: name of a layout, or a file.
        scene: the scene, if given.
        sensor: replaces the scene's sensor on all rings that state none, if given.
        frames: the sensor frames in a URDF.

    Raises:
        UserError: if the name or file is not valid, or the scene's robot lacks a link of the setup.
    """
    path = Path(name_or_path)
    scene = with_sensor(scene, sensor) if scene else None
    if _LOOKS_LIKE_A_NAME.fullmatch(name_or_path):
        scene = scene or with_sensor(Scene(), sensor)
        try:
            setup = layout_in(scene, name_or_path)
            within_files(setup)  # the limits of files hold for names, too
        except ValidationError as error:
            raise explain(name_or_path, error, Setup) from error
        except ValueError as error:
            raise UserError(f"setup: {error}") from error
    elif (kind := _suffix(name_or_path)) in _SENSOR_LISTS:
        scene = scene or with_sensor(Scene(), sensor)
        setup = _mounted(path, scene, frames)
    else:
        if not kind and not path.exists():
            raise UserError(
                f"{name_or_path}: cannot be read: no such file; give a proposal (.toml), a list of"
                " sensors (.csv, .json), a URDF (.urdf), or a name like n2_16_25"
            )
        setup, own, _ = read_proposal(path, sensor)
        scene = scene or own
    if frames is not None and _suffix(name_or_path) != ".urdf":
        raise UserError(
            f"--frames, --beam: allowed only with a URDF (.urdf), found {shown(name_or_path)}"
        )
    for where, value, allowed in setup_faults(setup, scene.robot, scene.sensor):
        raise unusable(f"{name_or_path}: {key_path(where)}", value, allowed)
    return setup, scene


def _mounted(path: Path, scene: Scene, frames: "FramePattern | None") -> Setup:
    """Return the setup in a file with sensors. Its reader is imported here: few commands read such
    a file, and a URDF's loads SciPy."""
    match path.suffix.lower():
        case ".csv":
            from .sensors.sensor_lists import mounted_setup

            return mounted_setup(str(path), read_text(path, "CSV"), scene)
        case ".json":
            from .sensors.sensor_poses import setup_of_poses

            return setup_of_poses(str(path), read_text(path, "JSON"), scene)
        case _:
            from .robots.urdf import read_urdf
            from .sensors.urdf_frames import FramePattern, setup_of_urdf

            return setup_of_urdf(read_urdf(path), frames or FramePattern(), scene)


def is_proposal(name_or_path: str) -> bool:
    """Return whether ``resolve`` reads this as a proposal, which brings its own scene."""
    if _LOOKS_LIKE_A_NAME.fullmatch(name_or_path):
        return False
    return _suffix(name_or_path) not in _SENSOR_LISTS


def how_found(name_or_path: str) -> SearchResult | None:
    """Return the record of the search in a proposal that ``resolve`` read; None for other
    setups."""
    if _LOOKS_LIKE_A_NAME.fullmatch(name_or_path) or _suffix(name_or_path) != ".toml":
        return None
    return read_model(Path(name_or_path), ProposalFile).found


def _suffix(name: str) -> str:
    """Return the suffix of a file's name in lower case, without the NAME of ``FILE.toml:NAME``."""
    return file_and_table(Path(name))[0].suffix.lower()
