"""The first look at a rig that stands still: does every sensor answer, how often, how noisily, and
which see the robot?
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from ..sensing.expected import ROBOT, expected
from ..sensing.noise import Noise
from ..sensing.readings import Readings, at_stops

_BODY = 0.05  # m, by which a robot's body may lie off the capsules that stand for it
_SURE = 5.0  # deviations
_NOISY = 3.0  # times the noise that was thought
_LOST = 0.2  # share of readings without a target where there should be one
_GAP = 1.5  # periods


@dataclass(frozen=True)
class RingHealth:
    """Of a ring: frames read, frames a second, and how often the time between two was more than one
    and a half of the usual period."""

    frames: int
    rate: float
    gaps: int


@dataclass(frozen=True)
class SelfCheck:
    """What K sensors, as wired and ring by ring, read at one pose.

    answers (K,): share of readings that were answers at all. valid (K,): share with a target.
    distance, spread (K,) m: median, and deviation by the median. expected (K,) m: what was to be
    read, infinite where nothing; what (K,): of what, as in ``Expected``.
    """

    setup: Setup
    rings: tuple[RingHealth, ...]
    answers: Float[np.ndarray, " K"]
    valid: Float[np.ndarray, " K"]
    distance: Float[np.ndarray, " K"]
    spread: Float[np.ndarray, " K"]
    expected: Float[np.ndarray, " K"]
    what: Int[np.ndarray, " K"]
    noise: Noise

    @property
    def silent(self) -> Int[np.ndarray, " s"]:
        """Sensors that never answer."""
        return np.flatnonzero(self.answers == 0)

    @property
    def on_robot(self) -> Int[np.ndarray, " s"]:
        """Sensors that should return the robot itself here, and return something about there."""
        here = self.what == ROBOT
        with np.errstate(invalid="ignore"):
            return np.flatnonzero(
                here & (np.abs(self.distance - self.expected) <= self._tolerance())
            )

    @property
    def noisy(self) -> Int[np.ndarray, " s"]:
        """Sensors that scatter more than thought."""
        with np.errstate(invalid="ignore"):
            return np.flatnonzero(
                self.spread > _NOISY * self.noise.at(np.nan_to_num(self.distance))
            )

    @property
    def lossy(self) -> Int[np.ndarray, " s"]:
        """Sensors that answer, see something, and often miss it."""
        return np.flatnonzero((self.answers > 0) & (self.valid > 0) & (self.valid < 1 - _LOST))

    @property
    def surprising(self) -> Int[np.ndarray, " s"]:
        """Sensors that read something other than expected: a ring that is mounted otherwise, or a
        thing that is not in the scene."""
        with np.errstate(invalid="ignore"):
            off = np.abs(self.distance - self.expected) > self._tolerance()
        return np.flatnonzero(
            (self.answers > 0) & (off | (np.isfinite(self.distance) != np.isfinite(self.expected)))
        )

    def _tolerance(self) -> Float[np.ndarray, " K"]:
        return _BODY + _SURE * self.noise.at(np.nan_to_num(self.distance))

    def text(self) -> list[str]:
        """Ring by ring, then what is not as it should be, in lines."""
        first, lines = np.cumsum([0, *(r.count for r in self.setup.rings)]), []
        for i, (ring, health) in enumerate(zip(self.setup.rings, self.rings, strict=True)):
            k = slice(int(first[i]), int(first[i + 1]))
            told = np.isfinite(self.spread[k])
            scatter = (
                f", scatter {1000 * np.median(self.spread[k][told]):.1f} mm" if told.any() else ""
            )
            lines.append(
                f"ring {i} ({ring.link}): {health.frames} frames, {health.rate:.1f} a second,"
                f" {health.gaps} gaps, {np.count_nonzero(self.answers[k] > 0)} of {ring.count}"
                f" sensors answer{scatter}"
            )
        for words, which in (
            ("never answer", self.silent),
            ("scatter more than thought", self.noisy),
            ("often miss what they see", self.lossy),
            ("return the robot itself", self.on_robot),
            ("read other than expected", self.surprising),
        ):
            if len(which):
                lines.append(f"{words}: {', '.join(self.named(which))}")
        return lines

    def named(self, which: Int[np.ndarray, " s"]) -> list[str]:
        """Sensors as ring:sensor, both counted from 0."""
        ring, first = (
            self.setup.ring_of_sensor,
            np.cumsum([0, *(r.count for r in self.setup.rings)]),
        )
        return [f"{ring[k]}:{k - first[ring[k]]}" for k in which]


def self_check(
    scene: Scene, setup: Setup, readings: Readings, noise: Noise | None = None
) -> SelfCheck:
    """Judge readings that were taken while the robot stood still.

    Raises:
        ValueError: if there is none, or one is of no sensor of the setup.
    """
    if not len(readings):
        raise ValueError("found no reading, allowed: some seconds of every ring")
    q = np.median(readings.joints, axis=0)[None]
    stops, wanted = at_stops(readings, setup, q), expected(scene, setup, q)
    total = np.maximum(stops.total[0], 1)
    rings = tuple(_health(readings.time[readings.ring == i]) for i in range(len(setup.rings)))
    return SelfCheck(
        setup,
        rings,
        (stops.total[0] - stops.failed[0]) / total,
        stops.valid[0] / total,
        stops.distance[0],
        stops.spread[0],
        wanted.distance[0],
        wanted.what[0],
        noise or Noise(),
    )


def _health(time: Float[np.ndarray, " n"]) -> RingHealth:
    frames = np.unique(time)
    if len(frames) < 2:
        return RingHealth(len(frames), 0.0, 0)
    period = np.diff(frames)
    return RingHealth(
        len(frames), float(1 / period.mean()), int((period > _GAP * np.median(period)).sum())
    )
