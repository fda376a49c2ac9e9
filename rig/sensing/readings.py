"""Readings of rings with times and joint angles, and their medians over the robot's stops."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...coverage.rings.ring import Setup

VALID, NO_TARGET, WEAK, FAILED = range(4)  # status of a reading
WITHIN = np.radians(0.5)  # rad in every joint; closer than this, the robot is at a stop


@dataclass(frozen=True)
class Readings:
    """Readings in the order measured, with the host's time and the robot's joint angles."""

    time: np.ndarray  # (n,) s
    joints: np.ndarray  # (n, j) rad
    ring: np.ndarray  # (n,) index of the ring in the setup
    sensor: np.ndarray  # (n,) index of the sensor in its ring, as wired (position in the frame)
    distance: np.ndarray  # (n,) m; nan where no target
    status: np.ndarray  # (n,) 0 valid, 1 no target, 2 weak, 3 failed / no answer

    def __len__(self) -> int:
        return len(self.time)

    def only(self, some: np.ndarray) -> "Readings":
        """Select readings by a mask or by indices."""
        return Readings(*(getattr(self, key)[some] for key in _KEYS))

    def wire(self, setup: Setup) -> Int[np.ndarray, " n"]:
        """Return the number of each reading's sensor among all of ``setup``, ring by ring, as
        wired.

        Raises:
            ValueError: if the setup has no such ring or sensor.
        """
        count = np.array([r.count for r in setup.groups])
        if len(self) and (self.ring.min() < 0 or self.ring.max() >= len(count)):
            raise ValueError(
                f"a reading is of ring {self.ring.max()}; the setup has rings 0 to {len(count) - 1}"
            )
        wrong = np.flatnonzero((self.sensor < 0) | (self.sensor >= count[self.ring]))
        if len(wrong):
            ring, sensor = int(self.ring[wrong[0]]), int(self.sensor[wrong[0]])
            raise ValueError(
                f"ring {ring}: a reading is of sensor {sensor}; the ring has 0 to {count[ring] - 1}"
            )
        number: np.ndarray = np.cumsum([0, *count])[self.ring] + self.sensor
        return number


_KEYS = tuple(Readings.__dataclass_fields__)


def joined(parts: list[Readings]) -> Readings:
    """Concatenate readings."""
    return Readings(*(np.concatenate([getattr(p, key) for p in parts]) for key in _KEYS))


@dataclass(frozen=True)
class Stops:
    """Readings of K sensors, as wired, while the robot stood at each of P stops."""

    joints: Float[np.ndarray, "P J"]
    """Mean of the reported joint angles, rad."""
    distance: Float[np.ndarray, "P K"]
    """Median of the valid readings, m; nan if fewer than half were valid."""
    valid: Int[np.ndarray, "P K"]
    """Number of valid readings."""
    total: Int[np.ndarray, "P K"]
    """Number of readings."""
    failed: Int[np.ndarray, "P K"]
    """Number of failures."""
    spread: Float[np.ndarray, "P K"]
    """1.4826 times the median absolute deviation, m; nan for fewer than two valid readings."""


def at_stops(
    readings: Readings, setup: Setup, joints: Float[np.ndarray, "P J"], within: float = WITHIN
) -> Stops:
    """Group readings by stop; readings taken between stops are omitted.

    Args:
        readings: of the rings of ``setup``.
        setup: the rings.
        joints: (P, J) rad, planned stops.
        within: tolerance of every joint, rad.

    Raises:
        ValueError: if a reading is of a sensor that the setup does not have, or the robot has
            another number of joints.
    """
    if readings.joints.shape[1] != joints.shape[1]:
        raise ValueError(
            f"the readings have {readings.joints.shape[1]} joints, the stops {joints.shape[1]}"
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
    """Return the median of the values of each group, nan for an empty group."""
    ordered = value[np.lexsort((value, group))]
    size = np.bincount(group, minlength=groups)
    first = np.cumsum(size) - size
    found = np.full(groups, np.nan)
    some = size > 0
    low, high = first[some] + (size[some] - 1) // 2, first[some] + size[some] // 2
    found[some] = (ordered[low] + ordered[high]) / 2
    return found
