"""Detection of a test piece by a ring's sensors, as small integers that add up.

A search compares many places of a ring. What a sensor contributes at a point is rounded to an
integer of 8 bits, and that of several sensors is the sum. Where one sensor suffices, the integer
counts -log(1 - P), so that the sum gives the probability that any of them detects the piece. Where
several must, it counts P, and their expected number stands for the probability.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float, UInt8

from ..detection.aspect import Vertical, aspect
from ..detection.detection import Detection, detectors
from ..detection.detectors import Detectors
from ..detection.law import log_missed, per_frame, strength
from ..pytrees import mapped
from ..sensors.sensor import Sensor
from ..solids.beams import InBeam

MOST = 255  # of 8 bits
_UNIT = 50.0  # integers for 1 of -log(1 - P): steps of 2 %, and 99.4 % for all of them
_SIGNALS, _FINE = 4.0, 256  # largest signal of the table, and its entries for 1
_CERTAIN = 8.0  # -log(1 - P) beyond which nothing is left to gain


@dataclass(frozen=True)
class Detections:
    """What sensors contribute to the detection of a test piece, as integers."""

    detection: Detection
    """What is to be detected."""

    @property
    def unit(self) -> float:
        """Integers for 1 of -log(1 - P), or of P where several sensors must detect the piece."""
        return _UNIT if self.detection.at_least == 1 else MOST // self.detection.at_least

    @property
    def levels(self) -> tuple[int, ...]:
        """Least sum with which a ring counts as 1, 2, ... of the sensors, in a library of rings."""
        k = self.detection.at_least
        if k == 1:
            return (round(np.log(2) * self.unit),)
        return tuple(round((j + 0.5) * self.unit) for j in range(k))

    @property
    def beyond(self) -> float:
        """Distance from a beam within which the centre of a piece in it may lie, m."""
        return float(np.hypot(self.detection.piece.width_m, self.detection.piece.height_m)) / 2

    @cached_property
    def share(self) -> Float[np.ndarray, " S"]:
        """Probability of detection for sums from 0 on; the last for all that are larger."""
        k = self.detection.at_least
        if k == 1:
            return -np.expm1(-np.arange(int(_CERTAIN * _UNIT)) / _UNIT).astype(np.float32)
        n = np.arange(k * int(self.unit) + 1) / self.unit
        return np.clip(n - (k - 1), 0.0, 1.0).astype(np.float32)

    def integers(self, missed: Float[np.ndarray, "*shape"]) -> UInt8[np.ndarray, "*shape"]:
        """Return the integers of sensors by log(1 - P)."""
        worth = -missed if self.detection.at_least == 1 else -np.expm1(missed)
        integers: np.ndarray = np.minimum(np.rint(worth * self.unit), MOST).astype(np.uint8)
        return integers

    def by(self, sensor: Sensor) -> "SensorDetections":
        """Return what a sensor contributes."""
        return _by(self, sensor)


@dataclass(frozen=True)
class SensorDetections:
    """What one sensor contributes at places in its beam."""

    of: Detectors
    """What it needs, (1,)."""
    question: Detections
    """What is to be detected."""
    table: UInt8[np.ndarray, " S"]
    """Integers by the signal, in steps of 1 / 256."""

    @property
    def reach(self) -> float:
        """Distance beyond which it contributes nothing, m."""
        least = np.argmax(self.table > 0) / _FINE
        if not self.table.any():
            return 0.0
        return float(self.of.reach[0] / np.sqrt(least)) + self.question.beyond

    def counts(
        self, at: InBeam, up: Vertical
    ) -> tuple[UInt8[np.ndarray, "*shape"], Float[np.ndarray, "*shape"]]:
        """Return the integers at places of the piece's centre, without occlusion, by the vertical
        there; and how far above the centre the part lies that is to be in sight, m."""
        extent = self.question.detection.extent
        seen = aspect(at, up, self.of, extent)
        s = strength(seen, self.of, extent)
        index = np.minimum(s * _FINE, len(self.table) - 1).astype(np.int32)
        counts: np.ndarray = self.table[index]
        return counts, seen.step


@lru_cache(maxsize=64)
def _by(question: Detections, sensor: Sensor) -> SensorDetections:
    of: Detectors = detectors([sensor], question.detection)
    s = np.arange(int(_SIGNALS * _FINE) + 1) / _FINE
    table = question.integers(log_missed(per_frame(s, of), of))
    narrow: Detectors = mapped(lambda a: a.astype(np.float32) if a.dtype.kind == "f" else a, of)
    return SensorDetections(narrow, question, table)
