"""State of the zones of sensors that stand still: which never answer, which are blocked."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from ...coverage.rings.ring import Setup
from ...objectives.scene import CoreScene
from .readings import BLOCKED, Readings, zones_at_stops
from .zone_grid import zone_grid
from .zone_targets import expected_zones

_FREE = 0.1  # m; a sensor that should see something nearer has no blocked zones


@dataclass(frozen=True)
class ZoneState:
    """State of the zones of a ring's n sensors, as wired."""

    ring: int
    """Number of the ring or single sensor."""
    silent: Bool[np.ndarray, "n r c"]
    """Zones that never answer, of sensors that do."""
    blocked: Bool[np.ndarray, "n r c"]
    """Zones that read something right before the sensor, where nothing is expected."""

    def named(self, which: Bool[np.ndarray, "n r c"], name: str = "") -> list[str]:
        """Name zones by ring, sensor, row and column, all counted from 0, sensor by sensor."""
        names = list[str]()
        for sensor in np.flatnonzero(which.any(axis=(1, 2))):
            places = ", ".join(f"({r}, {c})" for r, c in np.argwhere(which[sensor]))
            names.append(f"{name or self.ring}:{sensor} {places}")
        return names


def zone_state(
    scene: CoreScene,
    setup: Setup,
    ring: int,
    readings: Readings,
    q: Float[np.ndarray, "1 J"],
) -> ZoneState | None:
    """Return the state of the zones of one ring from readings at ``q`` (1, J) rad; None without
    readings of its zones.
    """
    stops = zones_at_stops(readings, setup, ring, q)
    if not stops.total.any():
        return None
    shape = (setup.groups[ring].count, *zone_grid(setup.groups[ring].sensor))
    dead = (stops.failed[0] == stops.total[0]).reshape(shape)
    silent = dead & ~dead.all(axis=(1, 2), keepdims=True)
    free = expected_zones(scene, setup, ring, q)[0].min(axis=(1, 2, 3)) > _FREE
    with np.errstate(invalid="ignore"):
        near = (stops.distance[0] < BLOCKED).reshape(shape)
    return ZoneState(ring, silent, near & free[:, None, None])
