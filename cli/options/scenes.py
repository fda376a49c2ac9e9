"""Scenes on the command line: file, robot, occlusion and recorded motion."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...coverage.occlusion.occlusion_mode import Occlusion
from ...coverage.robots.built_in import robot as built_in
from ...coverage.robots.robot import Robot
from ...formats.errors import UserError
from ...formats.loader import read_robot, read_scene
from ...formats.recorded_motion import with_record
from ...objectives.scene import Pose, Scene
from .targets import parse_goals, with_goals


def resolve_scene(
    scene: Path | None, robot: str | None, targets: Sequence[str] = (), radius: float | None = None
) -> Scene | None:
    """The scene that the options describe; None where they leave it to a proposal.

    Raises:
        UserError: for an unknown robot or target, or a shell that lies within the robot's own
            volume.
    """
    goals = parse_goals(targets, radius)
    arm = None if robot is None else given_robot(robot)
    if scene is not None:
        asked = read_scene(scene, arm)
    elif arm is not None:
        asked = Scene(robot=arm, poses=(Pose(arm.rest),))
    else:
        return None
    return with_goals(asked, goals)


def urdf_of(robot: str | None) -> Path | None:
    """The file of ``--robot``, if that is a URDF."""
    return Path(robot) if robot is not None and robot.lower().endswith(".urdf") else None


def given_robot(text: str) -> Robot:
    """The robot that ``--robot`` means: built in, of a robot's file (.toml), or of a URDF, to which
    bodies and mounts are then fitted; UserError for none of them."""
    if text.lower().endswith(".toml"):
        return read_robot(Path(text))
    if (urdf := urdf_of(text)) is not None:
        from .urdf_robot import import_urdf  # reading meshes takes a while to load

        return import_urdf(urdf).robot
    try:
        return built_in(text)
    except ValueError as error:
        raise UserError(f"--robot: {error}, or a file .toml or .urdf") from error


def with_occlusion(scene: Scene, occlusion: Occlusion | None) -> Scene:
    """``scene`` under ``--occlusion``, if that is given; UserError for a robot that has no bodies
    to shadow or blind.
    """
    if occlusion is None:
        return scene
    if occlusion != "ignore" and not scene.robot.bodies:
        raise UserError(
            f"--occlusion: found {occlusion}, allowed: ignore, as robot {scene.robot.name} has no"
            " bodies"
        )
    return replace(scene, occlusion=occlusion)


def with_motion(scene: Scene, trajectory: Path | None, degrees: bool, worst: bool = False) -> Scene:
    """``scene`` with the poses of a recorded motion in place of its own, where one is given;
    ``worst``: the worst pose is to be made large, which one pose is itself. UserError for a record
    that does not serve."""
    if degrees and trajectory is None:
        raise UserError("--degrees: found alone, allowed: only with --trajectory")
    if trajectory is not None:
        scene = with_record(scene, trajectory, degrees=degrees)
    return replace(scene, over_poses="worst") if worst and len(scene.poses) > 1 else scene
