"""How far beside a sensor's outer cone points may lie that it detects or meets."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..sensors.sensor import Sensor
from .detections import SensorDetections

WIDEST = 1.57  # rad, half angle of an outer cone with a tangent
_BESIDE = np.float32(1e-3)  # m, by which the reach of a ball exceeds the farthest point


class Reaching(NamedTuple):
    """How far beside a sensor's outer cone points may lie."""

    beyond: Float[np.ndarray, " N"] | np.float32
    """Distance by which the cone is wider at every depth, and begins behind the apex, m."""
    reach: Float[np.ndarray, " N"] | np.float32
    """Largest distance from the sensor, m."""

    @staticmethod
    def of_piece(detections: SensorDetections) -> "Reaching":
        """Return it for the places of a test piece."""
        beyond = np.float32(detections.question.beyond)
        return Reaching(beyond, np.float32(detections.reach))

    @staticmethod
    def of_balls(sensor: Sensor, ball: Float[np.ndarray, " N"], outer: float) -> "Reaching":
        """Return it for balls of these radii, m, that meet beams in cones of the angle ``outer``:
        beside a cone the ball reaches further across the axis than its radius."""
        farthest = np.float32(sensor.form.farthest(sensor.sizes))
        return Reaching(ball / np.float32(math.cos(min(outer, WIDEST))), ball + farthest + _BESIDE)

    def some(self, n: Int[np.ndarray, " T"]) -> "Reaching":
        """Return it for the points with these indices."""
        return Reaching(*(a if np.ndim(a) == 0 else a.take(n) for a in self))
