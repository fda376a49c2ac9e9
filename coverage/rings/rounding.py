"""Rounding of rings to the precision of files, so that the verified setup is the written one."""

import math
from dataclasses import replace

from ..definitions.units import degrees
from ..sensors.sensor import Sensor, effective
from .ring import Ring, Setup

DIGITS_DEG = 4  # decimals of an angle in a file
DIGITS_POSITION = 6  # decimals of a ring's position in a file


def tilt_deg(tilt: float) -> float:
    """Return a tilt in degrees as files state it.

    A tilt just below 90 degrees is not rounded up to 90. Adding 0 turns -0.0 into 0.0.
    """
    angle, most = math.degrees(tilt), 90 - 10.0**-DIGITS_DEG
    short = round(angle, DIGITS_DEG)
    return (
        round(math.copysign(most, angle), DIGITS_DEG)
        if abs(angle) < 90 <= abs(short)
        else short + 0.0
    )


def phase_deg(phase: float) -> float:
    """Return a phase in degrees as files state it; beyond a full turn it is wrapped."""
    angle = math.degrees(phase)
    return round(angle if abs(angle) <= 360 else math.remainder(angle, 360), DIGITS_DEG) + 0.0


def position(ring: Ring) -> float:
    """Return a ring's position as files state it."""
    return round(ring.position, DIGITS_POSITION) + 0.0


def rounded(setup: Setup, sensor: Sensor) -> Setup:
    """Return the setup as it reads back from a proposal file of a scene with ``sensor``."""
    rings = tuple(
        replace(
            ring,
            position=position(ring),
            tilt=math.radians(tilt_deg(ring.tilt)),
            phase=math.radians(phase_deg(ring.phase)),
            sensor=_read_back(ring.sensor, sensor),
        )
        for ring in setup.rings
    )
    singles = tuple(replace(one, sensor=_read_back(one.sensor, sensor)) for one in setup.singles)
    return Setup(rings, singles)


def _read_back(sensor: Sensor, of_scene: Sensor) -> Sensor:
    return of_scene if sensor == of_scene else _rounded(sensor)


def _rounded(sensor: Sensor) -> Sensor:
    """Return a sensor as it reads back: by its use if from the catalogue, else by its angles."""
    if sensor.use is not None:
        model = effective(sensor.use).sensor
        return replace(model, board=sensor.board or model.board)
    return sensor.with_angles(lambda angle: math.radians(degrees(angle)))
