"""Single sensors anywhere on a robot and in its cell, alone and in place of a ring's sensors."""

import math
from dataclasses import replace

from hypothesis import strategies as st
from place_rings.coverage.rings.mounted_sensor import MountedSensor
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.robots.robot import Robot
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.coverage.sensors.sensor_model import Model, Range
from place_rings.formats.sensors.sensor_frames import sensor_frames

from .rings import LINKS, setups
from .units import FACINGS, directions, metres, points_mm, ups


def beam(beam_deg: tuple[int, int], range_mm: int, near_percent: int, zones: int = 4) -> Sensor:
    """A sensor with a cone or, where the second angle is above 0, a pyramid of some zones."""
    (fov, up), range_m = (math.radians(angle) for angle in beam_deg), range_mm / 1000
    near = range_m * near_percent / 100
    return Sensor(fov, range_m, None, up or None, zones if up else 1, near_m=near)


def dome(fov_deg: int, range_mm: int) -> Sensor:
    """A sensor whose field is a dome."""
    return Sensor(math.radians(fov_deg), range_mm / 1000, shape="dome")


def fan(fov_deg: int, range_mm: int, thickness_mm: int) -> Sensor:
    """A scanner."""
    fov, thick = math.radians(fov_deg), thickness_mm / 1000
    return Sensor(fov, range_mm / 1000, shape="fan", thickness=thick)


def frustum(fov_deg: int, range_mm: int, thickness_mm: int) -> Sensor:
    """A laser or an ultrasonic sensor."""
    fov, thick = math.radians(fov_deg / 10), thickness_mm / 1000
    return Sensor(fov, range_mm / 1000, shape="frustum", thickness=thick)


def reporting(fov_deg: int, range_mm: int, targets: int, separation_mm: int) -> Sensor:
    """A sensor with a cone that reports several targets."""
    own = Model(
        name="drawn",
        source="drawn",
        fov_deg=fov_deg,
        ranges=(Range(range_m=range_mm / 1000),),
        targets=targets,
        separation_m=separation_mm / 1000,
    )
    return effective(Use(own)).sensor


RANGES_MM = st.integers(200, 1600)
BEAMS = st.builds(
    beam,
    st.tuples(st.integers(3, 115), st.sampled_from([0, 20, 70])),
    RANGES_MM,
    st.sampled_from([0, 0, 5, 50]),
    st.sampled_from([4, 1]),
)
DOMES = st.builds(dome, st.integers(20, 180), RANGES_MM)
FANS = st.builds(fan, st.integers(20, 360), RANGES_MM, st.integers(20, 300))
FRUSTUMS = st.builds(frustum, st.integers(1, 900), RANGES_MM, st.integers(5, 200))
REPORTING = st.builds(
    reporting, st.integers(3, 115), RANGES_MM, st.integers(2, 4), st.integers(1, 400)
)
SENSORS = BEAMS | DOMES | FANS | FRUSTUMS
"""Sensors of any shape."""
KINDS = (
    beam((30, 0), 500, 0),
    beam((30, 20), 500, 5),
    dome(30, 500),
    fan(30, 500, 20),
    frustum(5, 500, 20),
)
"""One sensor of each shape, one of which begins at a distance."""


def single(
    link: str,
    place_mm: tuple[int, int, int],
    facing_deg: tuple[int, int],
    roll_deg: int,
    sensor: Sensor,
) -> MountedSensor:
    """A single sensor."""
    at, look = tuple(metres(place_mm).tolist()), tuple(directions(facing_deg).tolist())
    return MountedSensor(link, at, look, sensor, tuple(ups(facing_deg, roll_deg).tolist()))


def singles(links: tuple[str, ...] = (*LINKS, "tcp", "base")) -> st.SearchStrategy[MountedSensor]:
    """Single sensors on the links."""
    return st.builds(
        single,
        st.sampled_from(links),
        points_mm(400),
        FACINGS,
        st.integers(-180, 180),
        SENSORS,
    )


def mixed_setups(most_sensors: int = 8, most_rings: int = 4) -> st.SearchStrategy[Setup]:
    """Setups of one ring or more, some with up to three single sensors."""
    some = st.lists(singles(), max_size=3)
    return st.builds(mixed, setups(most_sensors, most_rings), some)


def with_sensors(setup: Setup, sensors: list[Sensor]) -> Setup:
    """The setup with other sensors on its first rings."""
    first = [replace(r, sensor=s) for r, s in zip(setup.rings, sensors, strict=False)]
    return replace(setup, rings=(*first, *setup.rings[len(first) :]))


def mixed(setup: Setup, singles: list[MountedSensor]) -> Setup:
    """The setup with single sensors."""
    return Setup(setup.rings, tuple(singles))


CELL_SENSORS = st.lists(singles(("base",)), max_size=2).map(tuple)


def in_singles(robot: Robot, setup: Setup) -> Setup:
    """The same sensors without rings: each at the pose that it has on its ring."""
    link = {frame: name for name, frame in robot.frames.items()}
    frames = sensor_frames(robot, setup)
    each = (MountedSensor.from_frame(link[f.frame], f.T_frame_sensor, f.unit) for f in frames)
    return Setup((), tuple(each))
