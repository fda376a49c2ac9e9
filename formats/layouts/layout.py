"""Reader of layouts: a robot, its setup and the source of it, from a CSV or TOML file."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...coverage.definitions.errors import UserError, key_path, unusable
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import setup_faults, with_scene
from ...coverage.rings.surface_lift import Lift, lift_to_surface
from ...coverage.robots.built_in import robot as built_in
from ...coverage.robots.joint_values import contradicted
from ...coverage.robots.robot import Robot
from ...objectives.named_layouts import layout_in
from ...objectives.poses import Pose
from ...objectives.scene import Scene
from ..loader import read_robot
from ..model_reader import read_model
from ..schema.layout_models import LayoutFile, LayoutModel, LayoutUrdfModel
from ..user_files import beside, read_text
from .csv_poses import read_csv
from .mat_frames import sensors_of_mat

SUFFIXES = (".csv", ".toml")
_MOST = 1000  # sensors


@dataclass(frozen=True)
class PublishedLayout:
    """A layout of sensors on a robot, as somebody published it."""

    path: Path
    """The file."""
    about: LayoutModel
    """Title, source, licence and conditions."""
    scene: Scene
    """The robot in its pose, with real mounts and self-occlusion, and with the layout's sensor."""
    setup: Setup
    """Where the sensors are, lifted if the layout says so."""
    lifts: tuple[Lift, ...] = ()
    """The sensors that lie in a body of their own link."""
    notes: tuple[str, ...] = ()
    """What the readers dropped or took in another way than written, a sentence each."""

    @property
    def name(self) -> str:
        """Name of the file, without its ending."""
        return self.path.stem

    @property
    def incomplete(self) -> bool:
        """Whether a mesh of the robot's body is missing."""
        return any("is incomplete" in note for note in self.notes)


def read_layout(path: Path) -> PublishedLayout:
    """Return the layout of a file.

    Raises:
        UserError: if the file, or one that it names, is not usable; or if its sensors do not fit
            its robot.
    """
    kind = path.suffix.lower()
    if kind not in SUFFIXES:
        raise unusable(str(path), kind, f"a layout in {', '.join(SUFFIXES)}")
    if kind == ".csv":
        about, sensors = read_csv(str(path), read_text(path, "CSV"))
        file = None
    else:
        file = read_model(path, LayoutFile)
        about, sensors = file, ()
    robot, notes = _robot(path, about, None if file is None else file.urdf)
    scene = _scene(path, about, robot)
    setup = Setup((), sensors) if file is None else _setup(path, file, scene)
    for where, value, allowed in setup_faults(setup, robot, scene.sensor):
        raise unusable(f"{path}: {key_path(where)}", value, allowed)
    _check_sensors(path, setup, scene)
    setup, lifts = (
        lift_to_surface(scene.robot, setup, about.lift_mm / 1000) if about.lift_mm else (setup, ())
    )
    return PublishedLayout(path, about, scene, setup, lifts, notes)


def _robot(
    path: Path, about: LayoutModel, urdf: LayoutUrdfModel | None
) -> tuple[Robot, tuple[str, ...]]:
    """Return the robot of a layout, and notes of its reader."""
    name = about.robot.lower()
    if name.endswith((".urdf", ".xml")):
        from ..robots.urdf_options import UrdfOptions  # reading meshes takes a while to load

        of = urdf or LayoutUrdfModel(file=about.robot, frames=".*")
        package = {
            key: beside(path, f"urdf.package.{key}", folder) for key, folder in of.package.items()
        }
        options = UrdfOptions(package=package, skip_missing_meshes=of.skip_missing_meshes)
        fit = options.fit(beside(path, "robot", about.robot))
        return fit.robot, fit.notes
    if name.endswith(".toml"):
        return read_robot(beside(path, "robot", about.robot)), ()
    try:
        return built_in(about.robot), ()
    except ValueError as error:
        raise UserError(f"{path}: robot: {error}, a robot file (.toml) or a URDF") from error


def _scene(path: Path, about: LayoutModel, robot: Robot) -> Scene:
    """Return the scene of a layout: the robot in its pose, with its sensor, else the default."""
    if not robot.bodies:
        raise UserError(
            f"{path}: robot: found {robot.name} without bodies, allowed: a robot whose bodies are"
            " known, since they block the view"
        )
    q, chain = robot.rest, robot.chain
    if about.pose_deg is not None:
        if chain.prismatic or len(about.pose_deg) != len(chain):
            turning = "no prismatic joint, and " if chain.prismatic else ""
            raise UserError(
                f"{path}: pose_deg: found {len(about.pose_deg)} angles, allowed: {turning}"
                f"{len(chain)} of robot {robot.name}"
            )
        q = np.radians(about.pose_deg)
        if (j := contradicted(chain, q)) is not None:
            raise UserError(
                f"{path}: pose_deg: found an angle of {chain.joints[j]} that contradicts the joint"
                " which it mimics"
            )
    q = chain.settled(q)
    beyond = robot.beyond(q)
    if beyond is not None:
        raise UserError(
            f"{path}: pose_deg: found an angle of {chain.joints[beyond]} beyond its limits"
        )
    return Scene(robot=robot, poses=(Pose(q),), sensor=about.sensor)


def _setup(path: Path, file: LayoutFile, scene: Scene) -> Setup:
    """Return the setup of a layout in TOML."""
    try:
        if file.paper is not None:
            return layout_in(scene, file.paper)
        if file.urdf is not None:
            return Setup((), tuple(_urdf_sensors(path, file.urdf, scene)))
        if file.mat:
            robot, sensor = scene.robot, scene.sensor
            return Setup(
                (),
                tuple(
                    one
                    for part in file.mat
                    for one in sensors_of_mat(
                        beside(path, "mat.file", part.file), part, robot, sensor
                    )
                ),
            )
        stated = Setup(tuple(file.rings), tuple(file.sensors))
        return with_scene(stated, scene.sensor, scene.default_radius)
    except ValueError as error:
        raise UserError(f"{path}: {error}") from error


def _urdf_sensors(path: Path, keys: LayoutUrdfModel, scene: Scene) -> Iterator[MountedSensor]:
    """Yield the sensors at the frames of a URDF, each a single one."""
    from ..robots.urdf import read_urdf
    from ..sensors.urdf_frames import FramePattern, setup_of_urdf

    pattern = FramePattern(keys.frames, keys.beam, rings=False)
    for one in setup_of_urdf(
        read_urdf(beside(path, "urdf.file", keys.file)), pattern, scene
    ).singles:
        yield replace(one, sensor=scene.sensor)


def _check_sensors(path: Path, setup: Setup, scene: Scene) -> None:
    """Raise ``UserError`` for no sensors, for too many, or for sensors of several kinds."""
    if not 0 < setup.sensors <= _MOST:
        raise UserError(f"{path}: found {setup.sensors} sensors, allowed: 1 to {_MOST}")
    if any(group.sensor != scene.sensor for group in setup.groups):
        raise UserError(
            f"{path}: found sensors with beams of their own, allowed: the beam of the key sensor"
            " for all, since the search beside the layout places sensors of one kind"
        )
