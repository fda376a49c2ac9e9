"""The calibration of one arm of Universal Robots, from a file: ``calibration.conf`` of its
controller, or ``kinematics.yaml`` of its ROS description.

``calibration.conf`` holds what to add to the Denavit-Hartenberg parameters of the model, in rad and
m. ``kinematics.yaml`` holds the pose of each link's joint in the link before it.
"""

import math
from collections.abc import Mapping
from configparser import ConfigParser, Error
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import UserError, shown
from ...coverage.robots.built_in import calibrated_chain
from ...coverage.robots.calibration import DhTable, dh_table
from ...coverage.robots.kinematics import transform
from ...coverage.robots.robot import Robot
from ..yaml_text import plain_yaml

_DELTAS = ("delta_theta", "delta_a", "delta_d", "delta_alpha")
_LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
_PLACE = ("x", "y", "z", "roll", "pitch", "yaw")
_FARTHEST = 1e5  # m or rad; real ones have differed by some hundred metres
_SECTION = "mounting"


def calibrated_from(robot: Robot, name: str, text: str) -> Robot:
    """Return a robot with the calibration in a file, in place of any that it has.

    Args:
        robot: the robot.
        name: path of the file; its ending decides the format: ``.yaml`` or ``.yml`` for a
            description's kinematics, anything else for a controller's ``calibration.conf``.
        text: its content.

    Raises:
        UserError: if the file is not valid, or belongs to another robot.
    """
    model = robot.nominal
    try:
        table = dh_table(model.chain)
    except ValueError as error:
        raise UserError(f"{name}: found for {robot.name}, allowed: {error}") from error
    if Path(name).suffix.lower() in (".yaml", ".yml"):
        measured = _kinematics(name, text)
    else:
        measured = (table + _deltas(name, text)).origin
    return calibrated_by(robot, measured, name, Path(name).name)


def calibrated_by(
    robot: Robot, measured: Float[np.ndarray, "7 4 4"], source: str, name: str = ""
) -> Robot:
    """Return a robot with measured kinematics.

    Args:
        robot: the robot.
        measured: as in ``with_kinematics``.
        source: what states them, for messages.
        name: a shorter name of it, for files.

    Raises:
        UserError: if they belong to another robot.
    """
    try:
        chain = calibrated_chain(robot.nominal.chain, measured)
    except ValueError as error:
        raise UserError(f"{source}: for {robot.name}: {error}") from error
    return robot.calibrated(chain, name or source)


def _deltas(name: str, text: str) -> DhTable:
    """Return the deltas of a ``calibration.conf``."""
    parser = ConfigParser(
        interpolation=None, inline_comment_prefixes=("#", ";"), comment_prefixes=("#", ";")
    )
    headed = any(line.lstrip().startswith("[") for line in text.splitlines())
    try:
        parser.read_string(text if headed else f"[{_SECTION}]\n{text}", name)
    except Error as error:
        reason = " ".join(str(error).split())
        raise UserError(f"{name}: no calibration.conf: {reason}") from error
    sections = [s for s in parser.sections() if any(parser.has_option(s, key) for key in _DELTAS)]
    if len(sections) != 1:
        wanted = f"one section with {', '.join(_DELTAS)}"
        raise UserError(f"{name}: found {len(sections)} sections with deltas, wanted: {wanted}")
    return DhTable(*(_six(name, key, parser[sections[0]].get(key)) for key in _DELTAS))


def _six(name: str, key: str, text: str | None) -> Float[np.ndarray, " 6"]:
    wanted = "six numbers, like [ 0, 0, 0, 0, 0, 0 ]"
    if text is None:
        raise UserError(f"{name}: {key}: missing, wanted: {wanted}")
    words = text.strip().removeprefix("[").removesuffix("]").split(",")
    if len(words) != 6:
        raise UserError(f"{name}: {key}: found {len(words)}, wanted: {wanted}")
    return np.array([_number(name, f"{key}[{i}]", word.strip()) for i, word in enumerate(words)])


def _number(name: str, key: str, value: object) -> float:
    try:
        number = float(str(value))  # YAML 1.1 takes 1e-05 for text
    except ValueError:
        number = math.nan
    if isinstance(value, bool) or not abs(number) <= _FARTHEST:
        raise UserError(
            f"{name}: {key}: found {shown(value)}, wanted: a number from -{_FARTHEST:g} to"
            f" {_FARTHEST:g}"
        )
    return number


def _kinematics(name: str, text: str) -> Float[np.ndarray, "7 4 4"]:
    """Return the frames of a ``kinematics.yaml``, the flange's in that of the last joint."""
    content: Any = plain_yaml(name, text)
    links = _table(name, "kinematics", _table(name, "", content).get("kinematics"))
    frames = []
    for link in _LINKS:
        where = f"kinematics.{link}"
        place = _table(name, where, links.get(link))
        if missing := [key for key in _PLACE if key not in place]:
            raise UserError(f"{name}: {where}.{missing[0]}: missing, wanted: a number")
        values = [_number(name, f"{where}.{key}", place[key]) for key in _PLACE]
        frames.append(transform(values[:3], values[3:]))
    return np.stack([*frames, np.eye(4)])


def _table(name: str, key: str, value: object) -> Mapping[Any, Any]:
    if not isinstance(value, Mapping):
        where = f"{key}: " if key else ""
        raise UserError(f"{name}: {where}found {shown(value)}, wanted: a table")
    return value
