"""Rays of a sensor's zones, equal in tangents, in the frame of the sensor."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ...coverage.sensors.sensor import Sensor

ROUND = 900
"""Rays of a round beam."""
_ROW, _LEAST = 48, 2  # rays along a side of a square beam, at least; along a side of a zone
_GOLDEN = math.pi * (3 - math.sqrt(5))


class LightRays(NamedTuple):
    """R rays from a sensor's apex; its frame has the axis along z, and ``up`` along y."""

    direction: Float[np.ndarray, "R 3"]
    """Unit vectors."""
    zone: Int[np.ndarray, " R"]
    """Number of each ray's zone; all zones have equally many rays."""
    zones: int
    """Number of zones."""


def rays_of(sensor: Sensor, rows: int, rng: np.random.Generator) -> LightRays:
    """Return rays through all zones of a sensor whose beam is a cone or a pyramid.

    Those of a round beam lie on a spiral that is turned at random; those of a square zone one in
    each cell of a grid, at a random place.

    Args:
        sensor: the sensor.
        rows: rows of zones.
        rng: random generator.

    Raises:
        ValueError: for a beam of another shape.
    """
    if not sensor.form.ends_flat:
        raise ValueError(f"found a {sensor.shape}, allowed: a beam that is a cone or a pyramid")
    edge = math.tan(sensor.fov / 2)
    if not sensor.square:
        i = np.arange(ROUND)
        aside, turn = edge * np.sqrt((i + 0.5) / ROUND), _GOLDEN * i + rng.uniform(0, 2 * math.pi)
        return _rays(aside * np.cos(turn), aside * np.sin(turn), np.zeros(ROUND, int), 1)
    columns, up = sensor.zones, math.tan((sensor.fov_up or 0.0) / 2)
    n, m = (max(-(-_ROW // count), _LEAST) for count in (columns, rows))
    j, i = (a.ravel() for a in np.indices((rows * m, columns * n)))
    x, y = (
        (2 * (at + rng.random(len(at))) / count - 1) * half
        for at, count, half in ((i, columns * n, edge), (j, rows * m, up))
    )
    return _rays(x, y, j // m * columns + i // n, columns * rows)


def _rays(x: np.ndarray, y: np.ndarray, zone: np.ndarray, zones: int) -> LightRays:
    direction = np.stack([x, y, np.ones_like(x)], axis=1)
    return LightRays(direction / np.linalg.norm(direction, axis=1, keepdims=True), zone, zones)
