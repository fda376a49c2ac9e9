"""Scenes on the command line: file, robot, occlusion and recorded motion."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...coverage.definitions.errors import UserError
from ...coverage.occlusion.occlusion_mode import Occlusion
from ...coverage.robots.built_in import robot as built_in
from ...coverage.robots.robot import Robot
from ...formats.loader import is_proposal, read_robot, read_scene, resolve
from ...formats.model_reader import read_calibration
from ...formats.recorded_motion import with_record
from ...formats.robots.descriptions import XACRO, is_robot_source
from ...objectives.poses import Pose
from ...objectives.scene import Scene, as_in_paper
from .reading import AS_WRITTEN, ReadingOptions
from .targets import parse_goals, with_goals


def resolve_scene(
    scene: Path | None,
    robot: str | None,
    targets: Sequence[str] = (),
    radius: float | None = None,
    reading: ReadingOptions = AS_WRITTEN,
) -> Scene | None:
    """Return the scene that the options state, or None if the proposal's scene applies.

    Args:
        scene: its file.
        robot: name or file of its robot.
        targets: its targets.
        radius: radius of a shell without one.
        reading: how the robot's URDF is read.

    Raises:
        UserError: for an unknown robot or target, or a shell that lies within the robot's own
            volume.
    """
    arm = None if robot is None else given_robot(robot, reading)
    if scene is not None:
        stated = read_scene(scene, arm)
    elif arm is not None:
        stated = Scene(robot=arm, poses=(Pose(arm.rest),))
    else:
        return None
    return with_goals(stated, parse_goals(targets, radius, stated.robot))


def urdf_of(robot: str | None) -> str | None:
    """Return ``--robot`` if it is a URDF or xacro file, or the name of one."""
    if robot is None or not is_robot_source(robot):
        return None
    from ...formats.robots.urdf_options import UrdfOptions  # takes a while to load

    return robot if UrdfOptions().located(robot)[0].suffix.lower() in (".urdf", XACRO) else None


def described(robot: str | None) -> str | None:
    """Return ``--robot`` if it is a robot's description, which has meshes and options."""
    return robot if robot is not None and is_robot_source(robot) else None


def given_robot(text: str, reading: ReadingOptions = AS_WRITTEN) -> Robot:
    """Return the robot of ``--robot``: built in, from a robot file (.toml), or fitted to a robot's
    description.

    Raises:
        UserError: if it is none of them.
    """
    if text.lower().endswith(".toml"):
        return read_robot(Path(text))
    if described(text):
        from .urdf_robot import import_urdf  # reading meshes takes a while to load

        return import_urdf(text, reading.resolve()).robot
    try:
        return built_in(text)
    except ValueError as error:
        raise UserError(
            f"--robot: {error}, a robot file (.toml), URDF (.urdf), xacro (.xacro), MJCF (.xml), or"
            " a name of robot_descriptions, such as ur5e_description"
        ) from error


def with_calibration(scene: Scene, file: Path | None) -> Scene:
    """Return ``scene`` with the calibration of ``--calibration``, if a file is given.

    Raises:
        UserError: if the file is not valid, or belongs to another robot.
    """
    if file is None:
        return scene
    return replace(scene, robot=read_calibration(file, scene.robot))


def with_occlusion(
    scene: Scene, occlusion: Occlusion | None, paper: bool = False, rings_stay: bool = False
) -> Scene:
    """Return ``scene`` with the occlusion model of ``--occlusion``, or as ``--paper`` asks.

    Args:
        scene: the scene.
        occlusion: the model, if one is given.
        paper: whether ``--paper`` is given.
        rings_stay: whether rings stay where they are in ``scene``.

    Raises:
        UserError: if the model needs bodies that the robot does not have, or if ``--paper`` would
            move rings.
    """
    if paper:
        if occlusion is not None:
            raise UserError(f"--paper: found with --occlusion {occlusion}; use only one of them")
        return in_paper(scene, rings_stay)
    if occlusion is None:
        return scene
    if occlusion != "ignore" and not scene.robot.bodies:
        raise UserError(
            f"--occlusion: found {occlusion}, allowed: ignore, because robot {scene.robot.name} has"
            " no bodies; place-rings robot fits them to a URDF"
        )
    return replace(scene, occlusion=occlusion)


def in_paper(scene: Scene, rings_stay: bool = False) -> Scene:
    """Return a scene as ``--paper`` states it.

    Args:
        scene: the scene.
        rings_stay: whether rings stay where they are in ``scene``.

    Raises:
        UserError: if rings that stay would move.
    """
    if rings_stay and scene.real:
        raise UserError(
            "--paper: not allowed with a proposal whose rings have real mounts, because they would"
            " move; use --occlusion ignore to let beams pass through the robot"
        )
    return as_in_paper(scene)


def scene_for(
    subject: str,
    scene: Path | None,
    robot: str | None,
    paper: bool,
    reading: ReadingOptions = AS_WRITTEN,
    urdf: str | None = None,
) -> Scene | None:
    """Return the scene that ``--scene``, ``--robot`` and ``--paper`` state for a setup, or None if
    the proposal's scene applies.

    Args:
        subject: the setup.
        scene, robot, paper: the options.
        reading: how the robot's URDF is read.
        urdf: a URDF of another option, which is read in the same way.

    Raises:
        UserError: as ``resolve_scene`` does, or if ``--paper`` would move rings.
    """
    reading.refuse_without(urdf or described(robot))
    stated = resolve_scene(scene, robot, reading=reading)
    if not paper:
        return stated
    if stated is None and is_proposal(subject):
        in_paper(resolve(subject, None)[1], rings_stay=True)  # only whether it is allowed
        return None
    return in_paper(stated or Scene())


def with_motion(scene: Scene, trajectory: Path | None, degrees: bool, worst: bool = False) -> Scene:
    """Return ``scene`` with the poses of a recorded motion, if one is given.

    Args:
        scene: the scene.
        trajectory: file of the motion.
        degrees: its angles are in degrees.
        worst: maximise the worst pose; without effect for a single pose.

    Raises:
        UserError: if the file is not usable.
    """
    if degrees and trajectory is None:
        raise UserError("--degrees: allowed only with --trajectory FILE; add it")
    if trajectory is not None:
        scene = with_record(scene, trajectory, degrees=degrees)
    return replace(scene, over_poses="worst") if worst and len(scene.poses) > 1 else scene
