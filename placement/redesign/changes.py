"""Changes to a mounted setup, ring by ring, and their effort.

One change touches one ring. It adjusts the ring on its link (place, tilt, phase, sensors, or any of
them together), moves it to another link, adds it, or removes it. Effort is reported, not optimised:
rings touched, sensors to buy, millimetres along links, degrees of tilt and rotation, rings moved to
another link.
"""

import math
from dataclasses import dataclass
from enum import Enum

from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.rings.ring import Ring, Setup
from ...coverage.robots.robot import Robot

Rings = tuple[Ring | None, ...]  # the ring at each place, None: no ring


class ChangeKind(Enum):
    """Kind of a change; the value is the text in files."""

    SET = "set anew"
    CARRIED = "carried over"
    ADDED = "added"
    TAKEN = "taken away"


@dataclass(frozen=True)
class Change:
    """One ring touched."""

    place: int
    """Number of the ring in the mounted setup; numbers beyond it are new rings."""
    before: Ring | None
    """The ring before; None if it is new."""
    after: Ring | None
    """The ring after; None if it is removed."""
    moved: float
    """Displacement along its link, m; 0 if it moves to another link."""
    tilted: float
    """Change of tilt, rad; 0 for a new or removed ring."""
    turned: float
    """Least rotation that brings the sensors to their new places, rad; 0 for a new or
    removed ring."""

    @property
    def kind(self) -> ChangeKind:
        """Kind of the change."""
        if self.before is None:
            return ChangeKind.ADDED
        if self.after is None:
            return ChangeKind.TAKEN
        return ChangeKind.SET if self.before.link == self.after.link else ChangeKind.CARRIED

    @property
    def sensors(self) -> int:
        """Number of sensors added to this ring; negative if it loses some."""
        return (self.after.count if self.after else 0) - (self.before.count if self.before else 0)


@dataclass(frozen=True)
class Work:
    """Total effort of several changes."""

    rings: int
    """Rings touched."""
    carried: int
    """Rings moved to another link."""
    sensors: int
    """Sensors added."""
    moved: float
    """Displacement along links, m."""
    tilted: float
    """Change of tilt, rad."""
    turned: float
    """Rotation about the links, rad."""


@dataclass(frozen=True)
class Touched:
    """A setup in which some rings are touched."""

    rings: Rings
    """The ring at each place: the places of mounted rings first, then those of added ones."""
    free: tuple[int, ...] = ()
    """The places that may differ from the mounted setup."""
    singles: tuple[MountedSensor, ...] = ()
    """The mounted single sensors, which stay."""

    @property
    def setup(self) -> Setup:
        """The setup with its changes; unchanged rings keep their order."""
        return Setup(tuple(ring for ring in self.rings if ring is not None), self.singles)

    @property
    def sensors(self) -> int:
        """Number of sensors together."""
        return self.setup.sensors


def turn(before: Ring, after: Ring) -> float:
    """Return the least signed rotation, rad, that brings the first sensor of ``before`` to a sensor
    place of ``after``."""
    return math.remainder(after.phase - before.phase, 2 * math.pi / after.count)


def changes(robot: Robot, before: Rings, after: Rings) -> list[Change]:
    """Return the differences between two tuples of places."""
    differences = []
    for place, (a, b) in enumerate(zip(before, after, strict=True)):
        if a is not None and b is not None and a != b:
            moved = (
                abs(b.position - a.position) * robot.mount(a.link).length
                if a.link == b.link
                else 0.0
            )
            differences.append(Change(place, a, b, moved, abs(b.tilt - a.tilt), abs(turn(a, b))))
        elif a != b:
            differences.append(Change(place, a, b, 0.0, 0.0, 0.0))
    return differences


def work(some: list[Change]) -> Work:
    """Return the total effort of changes."""
    return Work(
        len(some),
        sum(c.kind is ChangeKind.CARRIED for c in some),
        sum(c.sensors for c in some),
        math.fsum(c.moved for c in some),
        math.fsum(c.tilted for c in some),
        math.fsum(c.turned for c in some),
    )
