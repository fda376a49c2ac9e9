"""Readings of the zones of a ring's sensors, as a frame holds them.

Zones are numbered row by row. Row 0 is at the upper end of the sensor, column 0 at its left, as in
a picture that the sensor takes: seen along its axis, with its up on top.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from jaxtyping import Bool, Float, Integer

from ...formats.ring_frame import Grid
from ...formats.ring_status import DISTANT, Status, known_status, millimetres
from ...objectives.motion_limits import Motion

_MOST_SIGMA, _MOST_SIGNAL = 0xFF, 0xFFFF


@dataclass(frozen=True)
class Zones:
    """Readings of the zones of n sensors, r rows of c zones with t targets each, nearest first."""

    mm: Integer[np.ndarray, "n r c t"]
    """Distance from the sensor along the zone's own direction, mm; 0 where there is none."""
    status: Integer[np.ndarray, "n r c t"]
    """Values of ``Status``."""
    sigma_mm: Integer[np.ndarray, "n r c t"] | None = None
    """Standard deviation, mm; None if the chip states none."""
    signal: Integer[np.ndarray, "n r c t"] | None = None
    """Signal, kcps per SPAD; None if the chip states none."""

    @classmethod
    def of(
        cls, distance: Float[np.ndarray, "n r c t"], status: Integer[np.ndarray, "n r c t"]
    ) -> Self:
        """Return the zones with these distances, m.

        Raises:
            ValueError: if a number does not fit its field.
        """
        return cls(millimetres(distance, status).astype(np.uint16), status.astype(np.uint8))

    @property
    def grid(self) -> Grid:
        """Numbers of rows, columns and targets."""
        rows, columns, targets = self.mm.shape[1:]
        return Grid(rows, columns, targets, self.sigma_mm is not None)

    @property
    def distance(self) -> Float[np.ndarray, "n r c t"]:
        """Distances, m; nan where there is none."""
        some = np.isin(self.status, DISTANT)
        return np.where(some, self.mm / np.float32(1000), np.float32(np.nan)).astype(np.float32)

    def first(self) -> tuple[Float[np.ndarray, "n z"], Integer[np.ndarray, "n z"]]:
        """Return the distance, m, and the status of the first target of each zone, row by row."""
        n = len(self.mm)
        return self.distance[..., 0].reshape(n, -1), self.status[..., 0].reshape(n, -1)

    def failed(self, share: float = Motion.failed_share) -> Bool[np.ndarray, " n"]:
        """Return whether more than ``share`` of each sensor's zones failed."""
        failed: np.ndarray = (self.status[..., 0] == Status.FAILED).mean(axis=(1, 2)) > share
        return failed

    def nearest(self) -> tuple[Float[np.ndarray, " n"], Integer[np.ndarray, " n"]]:
        """Return the distance, m, and the status of the nearest target of each sensor: its first
        return. A sensor without any target failed if too many of its zones did to say that there is
        none.
        """
        distance = self.distance.reshape(len(self.mm), -1)
        far = np.where(np.isnan(distance), np.inf, distance)
        which = far.argmin(axis=1)[:, None]
        least = np.take_along_axis(far, which, axis=1)[:, 0].astype(float)
        of = np.take_along_axis(self.status.reshape(len(far), -1), which, axis=1)[:, 0]
        none = np.where(self.failed(), Status.FAILED, Status.NO_TARGET).astype(np.uint8)
        some = np.isfinite(least)
        return np.where(some, least, np.nan), np.where(some, of, none)

    def pack(self) -> bytes:
        """Return the targets as a frame holds them."""
        records = np.zeros(self.mm.shape, self.grid.record)
        records["mm"], records["status"] = self.mm, self.status
        if self.sigma_mm is not None and self.signal is not None:
            records["sigma"] = np.minimum(self.sigma_mm, _MOST_SIGMA)
            records["signal"] = np.minimum(self.signal, _MOST_SIGNAL)
        return records.tobytes()

    @classmethod
    def read(cls, data: bytes, count: int, grid: Grid) -> Self:
        """Return the zones of ``count`` sensors in the targets of a frame."""
        shape = (count, grid.rows, grid.columns, grid.targets)
        records = np.frombuffer(data, grid.record).reshape(shape)
        mm, status = records["mm"].copy(), known_status(records["status"])
        if not grid.measured:
            return cls(mm, status)
        return cls(mm, status, records["sigma"].copy(), records["signal"].copy())
