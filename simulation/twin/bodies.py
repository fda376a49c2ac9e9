"""Solids as bodies of a twin."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ...coverage.robots.kinematics import transform
from ...coverage.targets.own import Box, Capsule, Cylinder, Sphere
from .world import TwinBody

TwinSolid = Box | Capsule | Cylinder | Sphere
"""Solids that can be bodies."""


class PlacedBody(NamedTuple):
    """A body at a place."""

    body: TwinBody
    """The body."""
    centre: Float[np.ndarray, " 3"]
    """Its centre, m."""
    frame: Float[np.ndarray, "3 3"]
    """Its axes in columns."""


def placed_body(solid: TwinSolid) -> PlacedBody:
    """Return a solid as a body at its place."""
    if isinstance(solid, Capsule):
        start, end = np.array(solid.start), np.array(solid.end)
        half = float(np.linalg.norm(end - start)) / 2
        body = TwinBody("capsule", (solid.radius, half)) if half else _ball(solid.radius)
        return PlacedBody(body, (start + end) / 2, axes_along(end - start) if half else np.eye(3))
    centre = np.array(solid.centre)
    if isinstance(solid, Sphere):
        return PlacedBody(_ball(solid.radius), centre, np.eye(3))
    frame = transform(solid.centre, np.radians(solid.rpy_deg))[:3, :3]
    if isinstance(solid, Box):
        x, y, z = solid.size
        return PlacedBody(TwinBody("box", (x / 2, y / 2, z / 2)), centre, frame)
    return PlacedBody(TwinBody("cylinder", (solid.radius, solid.height / 2)), centre, frame)


def _ball(radius: float) -> TwinBody:
    return TwinBody("sphere", (radius,))


def axes_along(way: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "3 3"]:
    """Return axes of which the third points along ``way``."""
    z = way / np.linalg.norm(way)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)
