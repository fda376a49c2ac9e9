"""Solids as bodies of a twin."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ...coverage.robots.kinematics import transform
from ...coverage.solids.capsules import Capsules
from ...coverage.targets.own import Box, Capsule, Cylinder, Sphere
from ...formats.export.markup import capsule_shape
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
        ends = Capsules(np.array(solid.start), np.array(solid.end), np.array(solid.radius))
        T, length, radius = capsule_shape(ends)
        body = TwinBody("capsule", (radius, length / 2)) if length else _ball(radius)
        return PlacedBody(body, T[:3, 3], T[:3, :3])
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
