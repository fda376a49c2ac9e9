"""Options that several commands share, in groups: a setup's scene, sensor, motion, and the frames
of a URDF.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ...coverage.choices import SENSOR_FRAMES, Along
from ...coverage.occlusion.occlusion_mode import Occlusion
from .common import Radius, RobotOption, SceneFileOption, Targets

if TYPE_CHECKING:  # what the options stand for is imported when they are resolved
    from ..._validation import ResolvedSetup
    from ...coverage.rings.ring import Setup
    from ...coverage.sensors.sensor import Sensor
    from ...formats.sensors.urdf_frames import FramePattern
    from ...objectives.scene import Scene


@Parameter(name="*")
@dataclass(frozen=True)
class SceneOptions:
    """Where a setup stands, and what it is to see."""

    target: Targets = ()
    radius: Radius = None
    scene: SceneFileOption = None
    robot: RobotOption = None
    occlusion: Annotated[
        Occlusion | None,
        Parameter(help="The robot's own body: ignored, throws shadows, or blinds sensors."),
    ] = None

    def given(self) -> "Scene | None":
        """The scene that the options describe; None where they leave it to a proposal."""
        from .scenes import resolve_scene

        return resolve_scene(self.scene, self.robot, self.target, self.radius)

    def applied(self, scene: "Scene") -> "Scene":
        """``scene`` with the targets and the occlusion that are asked for."""
        from .scenes import with_occlusion
        from .targets import parse_goals, with_goals

        return with_occlusion(
            with_goals(scene, parse_goals(self.target, self.radius)), self.occlusion
        )


@Parameter(name="*")
@dataclass(frozen=True)
class SensorOptions:
    """Another sensor than the scene's, or other conditions for it."""

    sensor: Annotated[
        str | None, Parameter(help="A sensor of the catalogue: see place-rings sensors.")
    ] = None
    ambient: Annotated[
        str | None,
        Parameter(help="With --sensor: light, like 50kcps or 5klx. The darkest, if none is given."),
    ] = None
    reflectance: Annotated[
        float | None, Parameter(help="With --sensor: of the target, 0.17 for 17 %.")
    ] = None
    target_size: Annotated[
        str | None,
        Parameter(help="With --sensor: WIDTHxHEIGHT of the target, m. It fills the beam, else."),
    ] = None

    def asked(self, own: "Sensor | None" = None) -> "Sensor | None":
        """The sensor asked for; ``own`` is the one that conditions alone are about."""
        from .sensors import resolve_sensor

        return resolve_sensor(self.sensor, self.ambient, self.reflectance, self.target_size, own)

    def resolve(
        self, subject: str, scene: "Scene | None", frames: "FramePattern | None" = None
    ) -> "tuple[Setup, Scene]":
        """A setup and its scene, as ``resolve`` has them, with the sensor asked for."""
        from ...formats.loader import resolve

        own = None
        if self.sensor is None and self != NO_SENSOR:
            own = resolve(subject, scene, frames=frames)[1].sensor
        return resolve(subject, scene, self.asked(own), frames)


@Parameter(name="*")
@dataclass(frozen=True)
class MotionOptions:
    """A recorded motion instead of a scene's poses."""

    trajectory: Annotated[
        Path | None,
        Parameter(help="A recorded motion (CSV: time and joint angles) in place of the poses."),
    ] = None
    degrees: Annotated[
        bool, Parameter(negative=(), help="The angles of --trajectory are in degrees, not radians.")
    ] = False

    def applied(self, scene: "Scene", worst: bool = False) -> "Scene":
        """``scene`` along the motion; ``worst``: where the worst pose is to be made large."""
        from .scenes import with_motion

        return with_motion(scene, self.trajectory, self.degrees, worst)


@Parameter(name="*")
@dataclass(frozen=True)
class FrameOptions:
    """Which frames of a URDF are sensors."""

    frames: Annotated[
        str | None,
        Parameter(help="Of a .urdf: the frames that are sensors, a regular expression: tof_.*"),
    ] = None
    beam: Annotated[
        Along | None, Parameter(help="Of a .urdf: the axis along which these frames look: x.")
    ] = None

    def resolve(self) -> "FramePattern | None":
        """What the two mean; None where nothing is asked."""
        if self == NO_FRAMES:
            return None
        from ...formats.sensors.urdf_frames import FramePattern

        return FramePattern(SENSOR_FRAMES if self.frames is None else self.frames, self.beam or "x")


REFERENCE, NO_SENSOR, NO_MOTION, NO_FRAMES = (
    SceneOptions(),
    SensorOptions(),
    MotionOptions(),
    FrameOptions(),
)


@Parameter(name="*")
@dataclass(frozen=True)
class SubjectOptions:
    """All that says how a setup is to be looked at."""

    place: SceneOptions = REFERENCE
    sensing: SensorOptions = NO_SENSOR
    motion: MotionOptions = NO_MOTION
    mounted: FrameOptions = NO_FRAMES

    def resolve(self, subject: str) -> "tuple[Setup, Scene]":
        """The setup of a file or of a name, and the scene in which the options want it looked
        at.
        """
        setup, scene = self.sensing.resolve(subject, self.place.given(), self.mounted.resolve())
        return setup, self.motion.applied(self.place.applied(scene))

    def resolved(self, subject: str) -> "ResolvedSetup":
        """The same with its name, as the API takes it."""
        from ..._validation import ResolvedSetup

        return ResolvedSetup(subject, *self.resolve(subject))


AS_IT_IS = SubjectOptions()
