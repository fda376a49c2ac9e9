"""Reading of proposals, scenes, robots and sensors, and writing of the first three."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ._errors import InputError, input_errors
from ._placement import Placement
from ._proposal import Proposal
from .coverage.robots.robot import Robot
from .coverage.sensors.effective_range import Use
from .coverage.sensors.sensor import Sensor, effective
from .formats.loader import read_proposal, read_robot, read_scene
from .formats.model_reader import file_and_table, read_sensor
from .formats.robots.descriptions import is_robot_source
from .formats.schema.versions import RobotFile, SceneFile, in_files
from .formats.toml_text import toml_keys
from .formats.writing import to_toml, write_text
from .objectives.scene import Scene


def load(
    path: str | Path,
    *,
    base: str | None = None,
    tip: str | None = None,
    hold: Mapping[str, float] | None = None,
    packages: Sequence[str | Path] = (),
    package: Mapping[str, str | Path] | None = None,
    skip_missing_meshes: bool = False,
    xacro_args: Mapping[str, str] | None = None,
) -> Proposal | Scene | Robot | Sensor:
    """Read a proposal, a scene, a robot or a sensor (TOML), or a robot's URDF, xacro or MJCF.

    A file with ``[[rings]]`` is a proposal, one with ``[[joints]]`` a robot, one with
    ``[[ranges]]`` a sensor, any other file a scene. A name such as ``ur5e_description`` is a
    robot of robot_descriptions, from its copy on this machine. For a URDF, xacro or MJCF, capsules
    and mounts are fitted to the links, which takes some seconds. The chain ends at the tip of the
    longest arm, before its gripper. Joints outside the chain stand still; ``Robot.held`` lists
    their values.

    Args:
        path: path of the file; ``FILE.toml:NAME`` is one proposal of a file that holds several.
        base: link of a URDF at which the chain begins; by default the root.
        tip: link of a URDF at which the chain ends.
        hold: values of a URDF's joints that do not move, by name; rad, or m for prismatic joints.
        packages: folders that are packages of a URDF's meshes, or hold packages.
        package: folders of packages by the packages' names, where the folders have others.
        skip_missing_meshes: whether to leave out meshes of a URDF whose file does not exist; the
            robot's body is then incomplete.
        xacro_args: values of a xacro file's arguments by name.

    Returns:
        A ``Proposal``, a ``Scene``, a ``Robot`` or a ``Sensor``. The coverage of a proposal is
        counted again. A sensor has its range for the best case; ``sensors.under`` limits it.

    Raises:
        InputError: if the file cannot be read; the message names the file, the key, the value and
            the allowed values.

    Example:
        >>> import place_rings as pr, pathlib, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pr.save(pr.Scene(robot="ur5e"), pathlib.Path(folder) / "scene.toml")
        ...     print(pr.load(path))
        <Scene: ur5e, 1 pose, V_S(0.5), occlusion shadow>
    """
    file = Path(path)
    with input_errors():
        if is_robot_source(str(path)):
            from .formats.robots.urdf_options import UrdfOptions  # meshes take a while to load

            reading = UrdfOptions(base, tip, hold or {}, False, packages, package or {})
            reading = replace(reading, xacro_args=xacro_args or {})
            return replace(reading, skip_missing_meshes=skip_missing_meshes).fit(path).robot
        given: dict[str, Any] = {"base": base, "tip": tip, "hold": hold}
        given |= {"packages": packages, "package": package}
        given |= {"skip_missing_meshes": skip_missing_meshes, "xacro_args": xacro_args}
        for name, value in given.items():
            if value:
                raise InputError(f"allowed only for a URDF, xacro or MJCF, found {file.name}", name)
        match _kind(file):
            case "rings":
                setup, scene, model = read_proposal(file)
                return Proposal(setup, scene, str(path), model.found)
            case "joints":
                return read_robot(file)
            case "ranges":
                return effective(Use(read_sensor(file))).sensor
            case _:
                return read_scene(file)


def save(what: Placement | Scene | Robot, path: str | Path) -> Path:
    """Write a proposal, a scene or a robot as TOML. The write is atomic: an interruption leaves the
    old file or the new one.

    Args:
        what: a ``Proposal``, a ``Scene`` or a ``Robot``; any other result is saved as a proposal.
        path: path of the file; its folder must exist.

    Returns:
        The path of the file.

    Raises:
        InputError: if the file cannot be written.

    Example:
        >>> import place_rings as pr, pathlib, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pr.save(pr.robots["ur3e"], pathlib.Path(folder) / "robot.toml")
        ...     print(pr.load(path).name)
        ur3e
    """
    if isinstance(what, Proposal):
        return what.save(path)
    if isinstance(what, Placement):
        return Proposal(what.setup, what.scene).save(path)
    if isinstance(what, Scene):
        heading = "A scene, for place-rings: --scene of its commands."
        text = to_toml(in_files(what), heading, SceneFile)
    elif isinstance(what, Robot):
        text = to_toml(what, "A robot, for place-rings: a scene names it by robot.", RobotFile)
    else:
        raise InputError(
            f"found a {type(what).__name__}, allowed: a result, a Scene or a Robot", "what"
        )
    with input_errors():
        write_text(Path(path), text)
    return Path(path)


def _kind(file: Path) -> str:
    """Return the key that identifies a file: ``rings``, ``joints``, ``ranges``, or empty for a
    scene.

    A file that cannot be read counts as a scene; reading it then reports the error.
    """
    if file_and_table(file)[1] is not None:
        return "rings"
    try:
        keys = toml_keys(file.read_text("utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return ""
    if any(isinstance(value, dict) and "rings" in value for value in keys.values()):
        return "rings"  # several proposals
    return next((key for key in ("rings", "joints", "ranges") if key in keys), "")
