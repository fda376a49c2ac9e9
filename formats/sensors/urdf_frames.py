"""Fit of rings to the sensor frames of a URDF, which a name pattern selects."""

import math
import re
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...coverage.choices import SENSOR_FRAMES, Along
from ...coverage.definitions.errors import UserError, shown, unusable
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.rings.ring import Setup
from ...coverage.robots.robot import BASE, Mount
from ...objectives.scene import Scene
from ..robots.urdf_matching import find_robot
from ..robots.urdf_model import Urdf
from .ring_fit import TOLERANCE_DEG, TOLERANCE_MM, setup_of_frames
from .sensor_frames import SensorFrame, looking_along_z
from .single_fit import single_at

_LONGEST = 200  # most characters of a pattern


@dataclass(frozen=True)
class FramePattern:
    """Selection of the sensor frames in a URDF."""

    pattern: str = SENSOR_FRAMES
    """Regular expression for the whole name of a frame."""
    beam: Along = "x"
    """Axis of the frame along which the sensor looks."""
    rings: bool = True
    """Whether frames that are evenly spaced around a link form rings; else all are single."""


@dataclass(frozen=True)
class Seat:
    """Position of a sensor on a mount."""

    name: str
    """Name of the frame."""
    mount: Mount
    """The mount."""
    T: Float[np.ndarray, "4 4"]
    """Pose in the mount's frame, T_frame_sensor."""
    along: float
    """Position along the mount's axis, m."""
    radius: float
    """Distance from the axis, m."""
    azimuth: float
    """Azimuth around the axis, rad."""
    tilt: float
    """Tilt, rad."""
    aside: float
    """Angle between the beam and the plane through the axis, rad."""

    def beside(self, other: "Seat") -> bool:
        """Return whether both may belong to the same ring."""
        mm = 1000 * max(abs(self.along - other.along), abs(self.radius - other.radius))
        deg = math.degrees(abs(self.tilt - other.tilt))
        return self.mount is other.mount and mm <= 2 * TOLERANCE_MM and deg <= 2 * TOLERANCE_DEG


def setup_of_urdf(urdf: Urdf, frames: FramePattern, scene: Scene) -> Setup:
    """Return the setup whose sensors are the frames of ``urdf`` with matching names; the scene's
    sensor determines their beams.

    Frames of one link at the same position, distance and tilt form a ring, if they are evenly
    spaced; the first of them in the file is its first sensor. The others are single sensors.

    Raises:
        UserError: if no frame matches, or the URDF lacks the scene's robot.
    """
    try:
        if len(frames.pattern) > _LONGEST:
            raise re.error(f"longer than {_LONGEST} characters")
        pattern = re.compile(frames.pattern)
    except (re.error, OverflowError, RecursionError) as error:
        raise unusable("--frames", frames.pattern, f"a regular expression ({error})") from error
    name = str(urdf.path)
    picked = find_robot(urdf, scene.robot)
    carried = {c.link.name: c for c in picked.carried}
    wanted = [link for link in urdf.links if pattern.fullmatch(link)]
    if not wanted:
        raise UserError(
            f"{name}: no frame matches {shown(frames.pattern)}; set --frames to a pattern of the"
            " sensor frames"
        )
    for link in wanted:
        if link not in carried:
            raise UserError(
                f"{name}: frame {shown(link)}: found off the chain of {scene.robot.name}; set"
                " --frames to a pattern of frames on the chain"
            )
    rings, singles = list[list[Seat]](), list[MountedSensor]()
    for link in wanted:
        c = carried[link]
        T = looking_along_z(c.T_frame_link, frames.beam)
        seat = _seat(link, c.frame, T, scene) if frames.rings else None
        if seat is None:
            singles.append(single_at(scene.robot, c.frame, T, scene.sensor, link))
            continue
        ring = next((r for r in rings if r[0].beside(seat)), None)
        if ring is None:
            rings.append(ring := [])
        ring.append(seat)
    sensors = []
    for i, ring in enumerate(rings):
        first = ring[0].azimuth
        turns = [(seat.azimuth - first) % (2 * math.pi) for seat in ring]
        for k, j in enumerate(sorted(range(len(ring)), key=turns.__getitem__)):
            mount, T, label = ring[j].mount, ring[j].T, ring[j].name
            unit = scene.sensor_of(mount.link)
            sensors.append(SensorFrame(i, k, mount.frame, T, unit, label))
    fitted = setup_of_frames(name, sensors, scene)
    return replace(fitted, singles=(*fitted.singles, *singles))


def _seat(name: str, frame: int, T: Float[np.ndarray, "4 4"], scene: Scene) -> Seat | None:
    """Return the seat of a sensor at T_frame_sensor: on the mount, among those that move with the
    frame, from whose axis it points away most directly; None on a part without a mount."""
    robot = scene.robot
    last, T_last_tcp, seats = len(robot.chain) - 1, robot.chain.origin[-1], []
    for mount in robot.mounts:
        if frame == BASE or min(mount.frame, last) != frame:
            continue
        here = np.linalg.inv(T_last_tcp) @ T if mount.frame > last else T
        basis = np.stack([mount.zero, mount.side, mount.axis])
        at, look = basis @ (here[:3, 3] - mount.start), basis @ here[:3, 2]
        azimuth = math.atan2(at[1], at[0])
        out = look[0] * math.cos(azimuth) + look[1] * math.sin(azimuth)
        around = look[1] * math.cos(azimuth) - look[0] * math.sin(azimuth)
        aside, tilt = math.asin(min(abs(around), 1.0)), math.atan2(look[2], out)
        seats.append(
            Seat(name, mount, here, float(at[2]), math.hypot(at[0], at[1]), azimuth, tilt, aside)
        )
    if not seats:
        return None
    return min(
        seats, key=lambda s: (round(s.aside, 3), abs(s.radius - scene.radius_of(s.mount.link)))
    )
