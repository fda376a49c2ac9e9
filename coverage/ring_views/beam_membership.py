"""Which points lie in the beam of one sensor, in the beam's own coordinates."""

import math

import numpy as np
from jaxtyping import Bool, Float

from ..sensors.sensor import Sensor
from ..solids.fans import FULL


def in_beam(
    sensor: Sensor,
    along: Float[np.ndarray, " T"],
    across: Float[np.ndarray, " T"],
    up: Float[np.ndarray, " T"],
) -> Bool[np.ndarray, " T"]:
    """Return which of T points lie in a sensor's beam, without occlusion.

    The coordinates of the point from the apex, m, are those of ``pyramid`` and ``fan``:

    Args:
        sensor: the sensor.
        along: along the sensor's axis.
        across: perpendicular to the axis and to ``up``.
        up: along the unit vector ``up`` of the beam.
    """
    range_m, half = np.float32(sensor.range_m), sensor.half_angle
    inside: np.ndarray
    if sensor.shape == "dome":
        square = along * along + across * across + up * up
        inside = (square <= range_m**2) & (along >= 0)
        inside &= along * along >= square * np.float32(math.cos(half) ** 2)
    elif sensor.thickness is not None:
        inside = np.abs(up) <= np.float32(sensor.thickness / 2)
        inside &= along * along + across * across <= range_m**2
        if half <= math.pi - FULL:
            wedge = np.abs(across) * np.float32(math.cos(half))
            inside &= wedge <= along * np.float32(math.sin(half))
    else:
        inside = (along >= np.float32(sensor.near_m)) & (along <= range_m)
        if sensor.square:
            inside &= np.abs(across) <= along * np.float32(math.tan(half))
            inside &= np.abs(up) <= along * np.float32(math.tan(sensor.half_angle_up))
        else:
            square = along * along + across * across + up * up
            inside &= along * along >= square * np.float32(math.cos(half) ** 2)
    return inside


def outer_angle(sensor: Sensor) -> float:
    """Return the half angle of a cone from the apex that holds the beam, rad; pi where none with a
    half angle of at most a right angle does."""
    if sensor.thickness is not None:
        return math.pi
    if sensor.shape == "dome":
        return sensor.half_angle
    return sensor.circumscribed_half_angle
