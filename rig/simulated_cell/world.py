"""A simulated rig: readings of mounted rings in a cell, with noise and with faults of wiring and
sensors.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from ...coverage.rings.ring import Setup
from ...coverage.solids.capsules import Capsules
from ...objectives.scene import CoreScene
from ..sensing.expected import expected
from ..sensing.noise import Noise
from ..sensing.readings import FAILED, Readings

DEAD = -1  # the seat of a sensor that never answers


@dataclass(frozen=True)
class World:
    """A scene with rings as they are actually mounted."""

    scene: CoreScene
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

    def distances(
        self, joints: Float[np.ndarray, "T J"], rod: Capsules | None = None
    ) -> Float[np.ndarray, "T K"]:
        """Return the noise-free distance of each place in the frames, m: infinite without a target,
        nan for dead sensors.
        """
        ring, found = (
            self.mounted.ring_of_sensor,
            expected(self.scene, self.mounted, joints, rod).distance,
        )
        if self.offset is not None:
            found = found + self.offset[ring]
        if self.seat is not None:
            found = np.where(self.seat == DEAD, np.nan, found[:, self.seat])
        return found

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
