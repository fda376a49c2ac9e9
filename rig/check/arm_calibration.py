"""The calibration of the arm that a check talks to: read from its controller, or compared with the
file that the user gave.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...coverage.definitions.errors import UserError
from ...coverage.robots.calibration import dh_table
from ...coverage.robots.kinematics import forward
from ...coverage.robots.robot import Robot
from ...formats.robots.calibration_files import calibrated_by
from ...objectives.scene import Scene
from ..robot.controller_line import UnreadError
from ..robot.dashboard import read_model
from ..robot.primary_interface import PORT as KINEMATICS_PORT
from ..robot.primary_interface import read_kinematics

_SECONDS = 3.0  # s to connect and to receive the first state
_EQUAL = 1e-4  # m at the TCP, by which a file may differ from its controller


@dataclass(frozen=True)
class ArmKinematics:
    """The scene of a check with the kinematics of its arm."""

    scene: Scene
    """The scene."""
    warnings: tuple[str, ...] = ()
    """Why the kinematics may not be those of the arm."""


def arm_kinematics(scene: Scene, host: str, move: bool = False) -> ArmKinematics:
    """Return a scene with the calibration that the controller at ``host`` states.

    A calibration that the scene has already stays, and a warning says if the controller states
    another one.

    Args:
        scene: the scene of the check.
        host: the controller.
        move: whether the check moves the arm, which must then be known to be the scene's.

    Raises:
        UserError: if the controller's arm is another robot than the scene's, or if the arm shall
            move and its controller states neither its kinematics nor its model.
    """
    robot, given = scene.robot, scene.robot.calibration
    try:
        dh_table(robot.nominal.chain)
        table = read_kinematics(host, _SECONDS)
    except ValueError as error:
        why = str(error)
        reason = f"the controller's calibration is not used: {error}"
    except UnreadError as error:
        why = str(error)
        reason = (
            f"the controller's calibration was not read ({error}), so the kinematics are those of"
            " the model, which may be off by some millimetres; give --calibration FILE"
        )
    else:
        return _compared(scene, calibrated_by(robot, table.origin, f"controller {host}"))
    if move:
        _require_model(robot, host, why)
    return ArmKinematics(scene, () if given else (reason,))


def _require_model(robot: Robot, host: str, why: str) -> None:
    """Raise UserError unless the dashboard states the model of ``robot``; ``why`` says why its
    kinematics do not tell."""
    wanted = robot.name.removesuffix("_dh")  # other bodies of the same arm
    try:
        model = read_model(host, _SECONDS)
    except UnreadError as error:
        raise UserError(
            f"--move: controller {host} does not state which arm it moves ({why}; {error}), wanted:"
            f" {robot.name}, as in the scene; open port {KINEMATICS_PORT} of the controller"
        ) from error
    if model != wanted:
        raise UserError(
            f"--move: controller {host} moves a {model}, wanted: {robot.name}, as in the scene"
        )


def _compared(scene: Scene, own: Robot) -> ArmKinematics:
    """Return a scene with the kinematics of its controller, ``own``, unless it has a file's."""
    given = scene.robot.calibration
    if given is None:
        return ArmKinematics(replace(scene, robot=own))
    if (apart := _apart(scene, own)) <= _EQUAL:
        return ArmKinematics(scene)
    reason = (
        f"{given.source} differs from the calibration in the controller by up to"
        f" {1000 * apart:.1f} mm at the TCP; {given.source} is used"
    )
    return ArmKinematics(scene, (reason,))


def _apart(scene: Scene, other: Robot) -> float:
    """Return the largest distance of the TCPs of two robots at the scene's poses, m."""
    q = np.array([pose.q for pose in scene.poses], float)
    one, two = (forward(r.chain, q)[:, -1, :3, 3] for r in (scene.robot, other))
    return float(np.linalg.norm(one - two, axis=-1).max())
