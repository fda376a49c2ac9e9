"""Light that returns into the zones of a sensor: the mean over a zone's rays of (R / distance)²
where they meet a body first, and 0 elsewhere."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.sensors.sensor import Sensor
from .light_rays import LightRays
from .world import TwinWorld


@dataclass(frozen=True)
class Eye:
    """A sensor in the world."""

    apex: Float[np.ndarray, " 3"]
    """Apex, m."""
    frame: Float[np.ndarray, "3 3"]
    """Axes in columns: across, up, and the axis of the beam."""
    rays: LightRays
    """Its rays."""
    direction: Float[np.ndarray, "R 3"]
    """Directions of the rays in the world."""
    blocked: Float[np.ndarray, " R"]
    """Distance beyond which each ray sees nothing, m."""

    def light(
        self, world: TwinWorld, groups: Sequence[int], reach: float, least: float
    ) -> Float[np.ndarray, " Z"]:
        """Return the light that returns from bodies into each zone, over that of a target at the
        range R that fills the zone; none into a sensor that is inside a body.

        Args:
            world: the world.
            groups: groups of the bodies.
            reach: the range R, m.
            least: distance below which the sensor reports nothing that helps, m.
        """
        axis = self.frame[:, 2]
        ahead, behind = world.cast(self.apex, np.stack([axis, -axis]), groups).geom
        if ahead >= 0 and ahead == behind:
            return np.zeros(self.rays.zones)
        distance = world.cast(self.apex, self.direction, groups).distance
        seen = (distance < self.blocked) & (distance >= least)
        light = np.where(seen, (reach / np.maximum(distance, 1e-9)) ** 2, 0.0)
        count = len(light) // self.rays.zones
        return np.bincount(self.rays.zone, light, self.rays.zones) / count


def eye_of(
    world: TwinWorld, k: int, unit: Sensor, rays: LightRays, groups: Sequence[int], blind: bool
) -> Eye:
    """Return a sensor of a world where it stands.

    Args:
        world: the world.
        k: number of the sensor.
        unit: the sensor.
        rays: its rays.
        groups: groups of the geoms that block rays.
        blind: whether the nearest of these in the beam blocks all rays of a sensor of one zone.
    """
    apex, frame = world.apex[k], world.frame[k]
    direction = rays.direction @ frame.T
    blocked = world.cast(apex, direction, groups).distance
    if blind and rays.zones == 1 and blocked.min() < unit.range_m:
        blocked = np.full_like(blocked, blocked.min())
    return Eye(apex, frame, rays, direction, blocked)
