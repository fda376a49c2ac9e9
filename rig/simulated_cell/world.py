"""A simulated rig: readings of mounted rings in a cell, with noise and with faults of wiring and
sensors.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from ...coverage.rings.ring import Setup
from ...coverage.solids.capsules import Capsules
from ...objectives.scene import Scene
from ...simulation.twin.noise import Noise
from ...simulation.twin.zone_grid import GridTurn, stated_turn, zoned
from ..sensing.expected import expected
from ..sensing.readings import FAILED, Readings
from ..sensing.zone_targets import expected_zones

DEAD = -1  # the seat of a sensor that never answers
TARGETS = 2  # of a zone


@dataclass(frozen=True)
class World:
    """A scene with rings as they are actually mounted."""

    scene: Scene
    """Robot and cell."""
    mounted: Setup
    """The rings as mounted."""
    seat: Int[np.ndarray, " K"] | None = None
    """Sensor of ``mounted``, counted over all rings, at each place in the frames; ``DEAD`` if none
    answers there. None: each at its own place.
    """
    offset: Float[np.ndarray, " R"] | None = None
    """What each ring's sensors read too much, m."""
    noise: Noise = field(default_factory=Noise)
    """Noise of each reading."""
    rate: float = 20.0
    """Frames per second."""
    turns_deg: Int[np.ndarray, " K"] | None = None
    """Angle by which the sensor at each place in the frames is turned about its own axis: 0, 90,
    180 or 270. None: as its ring states.
    """

    def zones(
        self, ring: int, joints: Float[np.ndarray, "T J"], rod: Capsules | None = None
    ) -> Float[np.ndarray, "T n r c t"]:
        """Return the noise-free distances of the zones at each place in the frames of a ring, m:
        infinite without a target, nan for dead sensors.
        """
        group = self.mounted.groups[ring]
        first = self.mounted.slices[ring].start
        places = np.arange(first, first + group.count)
        seat = places if self.seat is None else self.seat[places]
        found = expected_zones(self.scene, self.mounted, ring, joints, rod, TARGETS)
        found += 0.0 if self.offset is None else self.offset[ring]
        arrived = np.full(found.shape, np.nan)
        for k in np.flatnonzero(seat != DEAD):
            extra = 0 if self.turns_deg is None else int(self.turns_deg[places[k]])
            turn = stated_turn(group).after(GridTurn(extra))
            grid = np.moveaxis(found[:, seat[k] - first], -1, 1)  # (T, t, r, c)
            arrived[:, k] = np.moveaxis(turn.arrives(grid), 1, -1)
        return arrived

    def distances(
        self, joints: Float[np.ndarray, "T J"], rod: Capsules | None = None
    ) -> Float[np.ndarray, "T K"]:
        """Return the noise-free distance of each place in the frames, m: infinite without a target,
        nan for dead sensors.
        """
        ring = self.mounted.ring_of_sensor
        found = expected(self.scene, self.mounted, joints, rod).distance
        if self.offset is not None:
            found = found + self.offset[ring]
        if self.seat is not None:
            found = np.where(self.seat == DEAD, np.nan, found[:, self.seat])
        return found

    def seen(
        self, joints: Float[np.ndarray, "T J"], rod: Capsules | None = None
    ) -> list[Float[np.ndarray, "T n *grid"]]:
        """Return the noise-free distances of each ring's sensors (T, n), or of their zones
        (T, n, r, c, t), at each place in the frames, m.
        """
        zones = {ring: self.zones(ring, joints, rod) for ring in zoned(self.mounted)}
        counts = [group.count for group in self.mounted.groups]
        if len(zones) == len(counts):
            return list(zones.values())
        each = np.split(self.distances(joints, rod), np.cumsum(counts)[:-1], axis=1)
        return [zones.get(ring, plain) for ring, plain in enumerate(each)]

    def told(
        self, rng: np.random.Generator, true: Float[np.ndarray, "*n"]
    ) -> tuple[Float[np.ndarray, "*n"], Int[np.ndarray, "*n"]]:
        """Return readings (...) m with noise, and their status."""
        distance, status = self.noise.measured(rng, np.where(np.isnan(true), np.inf, true))
        return distance, np.where(np.isnan(true), FAILED, status)

    def readings(
        self,
        rng: np.random.Generator,
        joints: Float[np.ndarray, "T J"],
        frames: int,
        rod: Capsules | None = None,
        start: float = 0.0,
    ) -> Readings:
        """Return ``frames`` frames of all rings at each of T stops, one stop after another, from
        ``start`` s on; ``rod`` as in ``expected``.
        """
        ring, count = self.mounted.ring_of_sensor, len(joints) * frames
        place = np.concatenate([np.arange(r.count) for r in self.mounted.groups])
        true = np.repeat(self.distances(joints, rod), frames, axis=0)
        distance, status = self.told(rng, true)
        return Readings(
            np.repeat(start + np.arange(count) / self.rate, len(ring)),
            np.repeat(np.repeat(joints, frames, axis=0), len(ring), axis=0),
            np.tile(ring, count),
            np.tile(place, count),
            distance.ravel(),
            status.ravel(),
        )
