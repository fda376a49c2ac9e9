"""Options that several commands share, in groups: the scene, the sensor, the motion, and the sensor
frames of a URDF.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ...coverage.choices import SENSOR_FRAMES, Along
from ...coverage.definitions.errors import UserError
from ...coverage.occlusion.occlusion_mode import Occlusion
from .common import (
    FRAMES,
    MOTION,
    SCENE,
    SENSOR,
    CalibrationOption,
    PaperOption,
    Radius,
    RobotOption,
    SceneFileOption,
    Targets,
)
from .offered import explained
from .reading import AS_WRITTEN, ReadingOptions

if TYPE_CHECKING:  # imported when the options are resolved
    from place_rings._validation import ResolvedSetup

    from ...coverage.rings.ring import Setup
    from ...coverage.sensors.sensor import Sensor
    from ...formats.sensors.urdf_frames import FramePattern
    from ...objectives.scene import Scene


@Parameter(name="*", group=SCENE)
@explained
@dataclass(frozen=True)
class SceneOptions:
    """The scene and the targets of a setup."""

    target: Targets = ()
    radius: Radius = None
    scene: SceneFileOption = None
    robot: RobotOption = None
    calibration: CalibrationOption = None
    occlusion: Occlusion | None = None
    """What the robot's body does to the sensors. ignore: beams pass through it. shadow: points
    behind it are not covered. returns: a one-zone sensor that reports several targets covers only
    what lies at least the maker's separation behind each body in its beam, while it has targets
    left. blind: a one-zone sensor covers nothing beyond the nearest surface in its beam.
    Default: that of the scene (reference scene: shadow)."""
    paper: PaperOption = False
    reading: ReadingOptions = AS_WRITTEN

    def given(self, urdf: str | None = None) -> "Scene | None":
        """Return the scene that the options state, or None if the proposal's scene applies.

        Args:
            urdf: a URDF of another option, which is read in the same way.
        """
        from .scenes import described, resolve_scene

        self.reading.refuse_without(urdf or described(self.robot))
        return resolve_scene(self.scene, self.robot, self.target, self.radius, self.reading)

    def applied(self, scene: "Scene", rings_stay: bool = False) -> "Scene":
        """Return ``scene`` with the targets and the occlusion model of the options.

        Args:
            scene: the scene.
            rings_stay: whether rings stay where they are in ``scene``.
        """
        from .scenes import with_calibration, with_occlusion
        from .targets import parse_goals, with_goals

        scene = with_goals(scene, parse_goals(self.target, self.radius, scene.robot))
        scene = with_calibration(scene, self.calibration)
        return with_occlusion(scene, self.occlusion, self.paper, rings_stay)


@Parameter(name="*", group=SENSOR)
@explained
@dataclass(frozen=True)
class SensorOptions:
    """A sensor, or conditions, that replace those of the scene."""

    sensor: str | None = None
    """Sensor of the catalogue (see place-rings sensors), or a sensor file (.toml). Default: the
    sensor of the scene (reference scene: a cone of 25°, 1.5 m long)."""
    ambient: str | None = None
    """Ambient light on a catalogue sensor, for example dark, 50kcps (counted by the sensor) or
    5klx. Default: the weakest light in the catalogue."""
    reflectance: float | None = None
    """Reflectance of the object that a catalogue sensor detects, above 0 up to 1; 0.17 is dark
    cloth. Default: the white target of the manufacturer (safety: 0.17)."""
    target_size: str | None = None
    """Size of the object that a catalogue sensor detects: WIDTHxHEIGHT in metres. Default: it fills
    the beam (safety: 0.45x0.7)."""

    def selected(self, own: "Sensor | None" = None) -> "Sensor | None":
        """Return the sensor of the options; conditions without ``--sensor`` apply to ``own``."""
        from .sensors import resolve_sensor

        return resolve_sensor(self.sensor, self.ambient, self.reflectance, self.target_size, own)

    def refuse_alone(self) -> None:
        """Refuse conditions where there is no sensor for them.

        Raises:
            UserError: if there is a condition.
        """
        for option in ("ambient", "reflectance"):
            if (value := getattr(self, option)) is not None:
                raise UserError(f"--{option} {value}: allowed only with --detect")

    def resolve(
        self, subject: str, scene: "Scene | None", frames: "FramePattern | None" = None
    ) -> "tuple[Setup, Scene]":
        """Return a setup and its scene, with the sensor of the options."""
        from ...formats.loader import resolve

        own = None
        if self.sensor is None and self != NO_SENSOR:
            own = resolve(subject, scene, frames=frames)[1].sensor
        return resolve(subject, scene, self.selected(own), frames)


@Parameter(name="*", group=MOTION)
@explained
@dataclass(frozen=True)
class MotionOptions:
    """A recorded motion that replaces the poses of a scene."""

    trajectory: Path | None = None
    """Recorded motion (CSV: time in seconds, joint angles in radians) that replaces the poses of
    the scene."""
    degrees: bool = False
    """Read the angles of --trajectory in degrees."""

    def applied(self, scene: "Scene", worst: bool = False) -> "Scene":
        """Return ``scene`` along the motion; ``worst`` maximises the worst pose."""
        from .scenes import with_motion

        return with_motion(scene, self.trajectory, self.degrees, worst)


@Parameter(name="*", group=FRAMES)
@explained
@dataclass(frozen=True)
class FrameOptions:
    """The sensor frames of a URDF, and sensors that lie flush in a body."""

    frames: str | None = None
    """Regular expression for the names of the sensor frames in a .urdf setup. Default: tof_.*"""
    beam: Along | None = None
    """Axis along which the sensor frames of a .urdf setup look. Default: x."""
    lift_to_surface: Annotated[
        float | None,
        Parameter(
            validator=Number(gt=0, lte=1000),
            help=(
                "Move sensors that lie in a body of their own link along their axes to its surface,"
                " by at most this many millimetres; rings of which one moves become single sensors."
                " Default: they stay, and see nothing."
            ),
        ),
    ] = None

    def resolve(self) -> "FramePattern | None":
        """Return the pattern of the options, or None if neither is given."""
        if self.frames is None and self.beam is None:
            return None
        from ...formats.sensors.urdf_frames import FramePattern

        return FramePattern(SENSOR_FRAMES if self.frames is None else self.frames, self.beam or "x")

    def lifted(self, setup: "Setup", scene: "Scene") -> "Setup":
        """Return a setup with its sensors lifted as the options state; notes go to stderr."""
        if (most := self.lift_to_surface) is None:
            return setup
        from ...coverage.rings.surface_lift import lift_to_surface
        from ...reporting.lines.occlusion import lift_lines
        from ...reporting.terminal import Terminal

        if math.isnan(most):
            raise UserError("--lift-to-surface: found nan, allowed: mm, above 0 and at most 1000")
        try:
            setup, lifts = lift_to_surface(scene.robot, setup, most / 1000)
        except ValueError as error:
            raise UserError(f"--lift-to-surface: {error}, in which a sensor could lie") from error
        Terminal(stderr=True).lines(*lift_lines(lifts, most))
        return setup


REFERENCE, NO_SENSOR, NO_MOTION, NO_FRAMES = (
    SceneOptions(),
    SensorOptions(),
    MotionOptions(),
    FrameOptions(),
)


@Parameter(name="*")
@dataclass(frozen=True)
class SubjectOptions:
    """The options that state under which conditions a setup is evaluated."""

    place: SceneOptions = REFERENCE
    sensing: SensorOptions = NO_SENSOR
    motion: MotionOptions = NO_MOTION
    mounted: FrameOptions = NO_FRAMES

    def resolve(self, subject: str, urdf: str | None = None) -> "tuple[Setup, Scene]":
        """Return the setup of a file or a name, and the scene in which to evaluate it.

        A proposal keeps its rings where they are, on the axes of its own scene. What a name or a
        list of sensors means depends on the scene with all options.

        Args:
            subject: the file or the name.
            urdf: as in ``SceneOptions.given``.
        """
        from ...formats.loader import is_proposal
        from ...objectives.scene import Scene

        scene, own = self.place.given(urdf), is_proposal(subject)
        if not own:
            scene = self.place.applied(scene or Scene())
        setup, scene = self.sensing.resolve(subject, scene, self.mounted.resolve())
        if setup.singles and not own:
            from ...reporting.terminal import Terminal

            Terminal(stderr=True).lines(
                f"{subject}: {len(setup.singles)} of {setup.sensors} sensors form no ring on"
                f" {scene.robot.name}; they count as single sensors"
            )
        if own:
            kept = self.place.scene is None and self.place.robot is None
            scene = self.place.applied(scene, rings_stay=kept)
        return self.mounted.lifted(setup, scene), self.motion.applied(scene)

    def resolved(self, subject: str, urdf: str | None = None) -> "ResolvedSetup":
        """Return the setup and its scene with the setup's name, for the API."""
        from place_rings._validation import ResolvedSetup

        return ResolvedSetup(subject, *self.resolve(subject, urdf))


AS_IT_IS = SubjectOptions()
