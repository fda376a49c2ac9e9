"""Readings of rings with times and joint angles, and their medians over the robot's stops."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import ndimage

from ...coverage.rings.ring import Setup
from ...coverage.robots.joint_values import angles_apart, turned_near
from ...formats.ring_status import ABSENT as ABSENT
from ...formats.ring_status import Status
from ...simulation.twin.zone_grid import zone_grid

VALID, NO_TARGET, WEAK, FAILED = Status
BLOCKED = 0.05  # m; a zone that always reads less is blocked: by dirt, a cable, its own ring
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
    zone_distance: np.ndarray | None = None  # (n, Z) m of each zone; None: all of one zone
    zone_status: np.ndarray | None = None  # (n, Z) the same; ``ABSENT`` beyond a sensor's zones

    def __len__(self) -> int:
        return len(self.time)

    def only(self, some: np.ndarray) -> "Readings":
        """Select readings by a mask or by indices."""
        each: Any = [getattr(self, key) for key in _KEYS]
        chosen: Any = [None if value is None else value[some] for value in each]
        return Readings(*chosen)

    def by_zone(
        self, zones: int | None = None
    ) -> tuple[Float[np.ndarray, "n Z"], Int[np.ndarray, "n Z"]]:
        """Return distance, m, and status of the zones of each reading. A sensor of one zone has
        its own as the first and only one.

        Args:
            zones: return only as many, and as absent what is not a reading of so many; default:
                all.
        """
        most = 1 if self.zone_status is None else self.zone_status.shape[1]
        distance = np.full((len(self), max(zones or most, 1)), np.nan)
        status = np.full(distance.shape, ABSENT, int)
        plain = np.ones(len(self), bool)
        if self.zone_status is not None and self.zone_distance is not None:
            there = (self.zone_status != ABSENT).sum(axis=1)
            plain = there == 0
            some = there > 0 if zones is None else there == zones
            width = min(most, distance.shape[1])
            distance[some, :width] = self.zone_distance[some, :width]
            status[some, :width] = self.zone_status[some, :width]
        if zones in (None, 1):
            distance[plain, 0], status[plain, 0] = self.distance[plain], self.status[plain]
        return distance, status

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
    """Concatenate readings of one rig."""
    each = ([getattr(p, key) for p in parts] for key in _KEYS)
    some: Any = [None if values[0] is None else np.concatenate(values) for values in each]
    return Readings(*some)


@dataclass(frozen=True)
class Stops:
    """Readings while the robot stood at each of P stops: of K sensors, as wired, or of the Z zones
    of each of n sensors of a ring, (P, n, Z)."""

    joints: Float[np.ndarray, "P J"]
    """Mean of the reported joint angles, rad."""
    distance: Float[np.ndarray, "*wires"]
    """Median of the valid readings, m; nan if fewer than half were valid."""
    valid: Int[np.ndarray, "*wires"]
    """Number of valid readings."""
    total: Int[np.ndarray, "*wires"]
    """Number of readings."""
    failed: Int[np.ndarray, "*wires"]
    """Number of failures."""
    spread: Float[np.ndarray, "*wires"]
    """1.4826 times the median absolute deviation, m; nan for fewer than two valid readings."""

    def of(self, wires: slice) -> "Stops":
        """Return the readings of some of the sensors."""
        arrays = (self.distance, self.valid, self.total, self.failed, self.spread)
        return Stops(self.joints, *(array[:, wires] for array in arrays))

    @property
    def mute(self) -> Bool[np.ndarray, " K"]:
        """Which sensors never answered."""
        return np.asarray((self.failed == self.total).all(axis=0))


def at_stops(readings: Readings, setup: Setup, joints: Float[np.ndarray, "P J"]) -> Stops:
    """Group readings by stop; readings taken between stops are omitted.

    The distance of a sensor with zones is the least of its zones' medians, because the least of
    noisy distances would be too small. Zones that are blocked at all of several stops do not count.

    Args:
        readings: of the rings of ``setup``.
        setup: the rings.
        joints: (P, J) rad, planned stops.

    Raises:
        ValueError: if a reading is of a sensor that the setup does not have, or the robot has
            another number of joints.
    """
    stops = _at_stops(readings, readings.wire(setup), setup.sensors, joints)
    if readings.zone_status is None:
        return stops
    distance = stops.distance.copy()
    for ring, group in enumerate(setup.groups):
        rows, columns = zone_grid(group.sensor)
        if rows * columns > 1:
            mine = setup.slices[ring]
            zones = zones_at_stops(readings, setup, ring, joints).distance
            least = np.where(np.isnan(zones) | _blocked(zones), np.inf, zones).min(axis=2)
            known = np.isfinite(least) & np.isfinite(distance[:, mine])
            distance[:, mine] = np.where(known, least, distance[:, mine])
    return replace(stops, distance=distance)


def _blocked(distance: Float[np.ndarray, "P n Z"]) -> Bool[np.ndarray, "1 n Z"]:
    """Return which zones are blocked at all of several stops, of sensors with others."""
    with np.errstate(invalid="ignore"):
        near = np.asarray(distance < BLOCKED).all(axis=0, keepdims=True)
    some = len(distance) > 1 and ~np.asarray(near).all(axis=2, keepdims=True)
    return np.asarray(near & some)


def zones_at_stops(
    readings: Readings,
    setup: Setup,
    ring: int,
    joints: Float[np.ndarray, "P J"],
) -> Stops:
    """Group the readings of the zones of one ring by stop. Readings with another number of zones
    than the ring's sensor has are omitted.
    """
    group, mine = setup.groups[ring], readings.only(readings.ring == ring)
    rows, columns = zone_grid(group.sensor)
    zones = rows * columns
    distance, status = mine.by_zone(zones)
    there = status != ABSENT
    reading, zone = np.nonzero(there)
    each = Readings(
        mine.time[reading],
        mine.joints[reading],
        mine.ring[reading],
        mine.sensor[reading],
        distance[there],
        status[there],
    )
    number = each.sensor * zones + zone
    stops = _at_stops(each, number, group.count * zones, joints)
    shape = (len(joints), group.count, zones)
    joints, *arrays = vars(stops).values()
    return Stops(joints, *(a.reshape(shape) for a in arrays))


def stop_of(readings: Readings, joints: Float[np.ndarray, "P J"]) -> Int[np.ndarray, " n"]:
    """Return the number of the stop at which each reading was taken; -1 between stops.

    Raises:
        ValueError: if the robot has another number of joints than the stops.
    """
    if readings.joints.shape[1] != joints.shape[1]:
        raise ValueError(
            f"the readings have {readings.joints.shape[1]} joints, the stops {joints.shape[1]}"
        )
    off = np.stack([angles_apart(readings.joints, q).max(axis=1) for q in joints])
    stop: np.ndarray = np.where(off.min(axis=0) <= WITHIN, off.argmin(axis=0), -1)
    return stop


def _at_stops(
    readings: Readings,
    wire: Int[np.ndarray, " n"],
    wires: int,
    joints: Float[np.ndarray, "P J"],
) -> Stops:
    """Group readings, each of one of ``wires`` wires, by stop."""
    shape, stop = (len(joints), wires), stop_of(readings, joints)
    here = stop >= 0
    group = stop * wires + wire
    count = np.bincount(stop[here], minlength=len(joints))
    there = turned_near(readings.joints[here], joints[stop[here]])
    mean = np.stack([np.bincount(stop[here], q, len(joints)) for q in there.T], axis=1)
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
    found, some = np.full(groups, np.nan), np.unique(group)
    if len(some):
        found[some] = ndimage.median(value, group, some)
    return found
