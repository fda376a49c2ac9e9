"""Readings: what rings measured, when, and where the robot was then; and their medians over the
stops of a robot.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...coverage.rings.ring import Setup

VALID, NO_TARGET, WEAK, FAILED = range(4)  # status of a reading
WITHIN = np.radians(0.5)  # of a stop in every joint: the robot is there


@dataclass(frozen=True)
class Readings:
    """Distances in the order measured: time of the host (s), the robot's joint vector then, who
    measured, what.
    """

    time: np.ndarray  # (n,) s
    joints: np.ndarray  # (n, j) rad
    ring: np.ndarray  # (n,) index of the ring in the setup
    sensor: np.ndarray  # (n,) index of the sensor in its ring, as wired (position in the frame)
    distance: np.ndarray  # (n,) m; nan where no target
    status: np.ndarray  # (n,) 0 valid, 1 no target, 2 weak, 3 failed / no answer

    def __len__(self) -> int:
        return len(self.time)

    def only(self, some: np.ndarray) -> "Readings":
        """The readings of a mask or of indices."""
        return Readings(*(getattr(self, key)[some] for key in _KEYS))

    def wire(self, setup: Setup) -> Int[np.ndarray, " n"]:
        """Number of each reading's sensor among all of ``setup``, ring by ring, as wired.

        Raises:
            ValueError: if a ring or a sensor is not of the setup.
        """
        count = np.array([r.count for r in setup.rings])
        if len(self) and (self.ring.min() < 0 or self.ring.max() >= len(count)):
            raise ValueError(
                f"found a reading of ring {self.ring.max()}, allowed: rings 0 to {len(count) - 1}"
            )
        wrong = np.flatnonzero((self.sensor < 0) | (self.sensor >= count[self.ring]))
        if len(wrong):
            ring, sensor = int(self.ring[wrong[0]]), int(self.sensor[wrong[0]])
            raise ValueError(
                f"ring {ring}: found a reading of sensor {sensor}, allowed: 0 to {count[ring] - 1}"
            )
        number: np.ndarray = np.cumsum([0, *count])[self.ring] + self.sensor
        return number


_KEYS = tuple(Readings.__dataclass_fields__)


def joined(parts: list[Readings]) -> Readings:
    """Readings one after another."""
    return Readings(*(np.concatenate([getattr(p, key) for p in parts]) for key in _KEYS))


@dataclass(frozen=True)
class Stops:
    """What K sensors, as wired, read while the robot stood at each of P stops.

    joints (P, J) rad: mean of what was told there. distance (P, K) m: median of the valid readings,
    nan where fewer than half were valid. valid, total (P, K): readings. failed (P, K): those
    without an answer. spread (P, K) m: 1.4826 times the median distance from the median, nan where
    fewer than two were valid.
    """

    joints: Float[np.ndarray, "P J"]
    distance: Float[np.ndarray, "P K"]
    valid: Int[np.ndarray, "P K"]
    total: Int[np.ndarray, "P K"]
    failed: Int[np.ndarray, "P K"]
    spread: Float[np.ndarray, "P K"]


def at_stops(
    readings: Readings, setup: Setup, joints: Float[np.ndarray, "P J"], within: float = WITHIN
) -> Stops:
    """The readings of each stop, put together; those taken on the way between stops are left out.

    Args:
        readings: of the rings of ``setup``.
        joints: (P, J) rad, where the robot was to stop.
        within: rad, by which every joint may be off.

    Raises:
        ValueError: if a reading is of no sensor of the setup, or the robot has another number of
            joints.
    """
    if readings.joints.shape[1] != joints.shape[1]:
        raise ValueError(
            f"found readings of {readings.joints.shape[1]} joints, allowed: {joints.shape[1]}"
        )
    wire, shape = readings.wire(setup), (len(joints), setup.sensors)
    off = np.stack([np.abs(readings.joints - q).max(axis=1) for q in joints])
    stop = np.where(off.min(axis=0) <= within, off.argmin(axis=0), -1)
    here = stop >= 0
    group = stop * setup.sensors + wire
    count = np.bincount(stop[here], minlength=len(joints))
    mean = np.stack(
        [
            np.bincount(stop[here], readings.joints[here, j], len(joints))
            for j in range(joints.shape[1])
        ],
        axis=1,
    )
    good = here & (readings.status == VALID) & np.isfinite(readings.distance)

    def number(some: np.ndarray) -> Int[np.ndarray, "P K"]:
        return np.bincount(group[some], minlength=shape[0] * shape[1]).reshape(shape)

    total, valid = number(here), number(good)
    middle = _medians(group[good], readings.distance[good], shape[0] * shape[1])
    spread = 1.4826 * _medians(
        group[good], np.abs(readings.distance[good] - middle[group[good]]), len(middle)
    )
    return Stops(
        np.where(count[:, None] > 0, mean / np.maximum(count, 1)[:, None], joints),
        np.where((2 * valid >= total) & (total > 0), middle.reshape(shape), np.nan),
        valid,
        total,
        number(here & (readings.status == FAILED)),
        np.where(valid >= 2, spread.reshape(shape), np.nan),
    )


def _medians(group: np.ndarray, value: np.ndarray, groups: int) -> Float[np.ndarray, " G"]:
    """The median of the values of each group, nan where there is none."""
    ordered = value[np.lexsort((value, group))]
    size = np.bincount(group, minlength=groups)
    first = np.cumsum(size) - size
    found = np.full(groups, np.nan)
    some = size > 0
    low, high = first[some] + (size[some] - 1) // 2, first[some] + size[some] // 2
    found[some] = (ordered[low] + ordered[high]) / 2
    return found
