"""State of the zones of sensors that stand still: which never answer, which are blocked."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from ...simulation.twin.zone_grid import zone_grid
from .readings import BLOCKED, VALID, Readings, stop_of, zones_at_stops
from .zone_targets import expected_zones

_FROZEN = 3  # stops at which a zone reads the same; alive, it differs by its noise alone
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
    scene: Scene,
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


def frozen_zones(
    readings: Readings, setup: Setup, joints: Float[np.ndarray, "P J"]
) -> Float[np.ndarray, " K"]:
    """Return the share of the zones of each of K sensors, as wired, that always read the same
    distance, at several of P stops (P, J) rad; 0 for sensors of one zone.
    """
    share, wire, stop = np.zeros(setup.sensors), readings.wire(setup), stop_of(readings, joints)
    distance, status = readings.by_zone()
    known = (status == VALID) & np.isfinite(distance)
    low, high = np.where(known, distance, np.inf), np.where(known, distance, -np.inf)
    for sensor, (group, _) in enumerate(setup.labels):
        zones = math.prod(zone_grid(setup.groups[group].sensor))
        each = [np.flatnonzero((wire == sensor) & (stop == p)) for p in range(len(joints))]
        here = np.concatenate(each)
        if zones > 1 and len(here):
            stops = sum(known[some].any(axis=0).astype(int) for some in each)
            same = low[here].min(axis=0) == high[here].max(axis=0)
            share[sensor] = np.count_nonzero(same & (stops >= _FROZEN)) / zones
    return share
