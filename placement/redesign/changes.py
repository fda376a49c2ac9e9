"""What was changed on a mounted setup, ring by ring, and the work that it is.

One change is one ring touched: set anew on its link (place, tilt, phase, sensors, any of them
together), carried to another link, added, or taken away. Work is told, not weighed: rings touched,
sensors that must be bought, millimetres along links, degrees of tilt and of turning, rings carried.
"""

import math
from dataclasses import dataclass
from enum import Enum

from ...coverage.rings.ring import Ring, Setup
from ...coverage.robots.robot import Robot

Rings = tuple[Ring | None, ...]  # of each place, None: no ring


class ChangeKind(Enum):
    """What was done to a ring; the text is for its user."""

    SET = "set anew"
    CARRIED = "carried over"
    ADDED = "added"
    TAKEN = "taken away"


@dataclass(frozen=True)
class Change:
    """One ring touched. place: its number on the mounted setup, or beyond, if it is new. before,
    after: None where it is new, and where it is taken away. moved: m along its link, 0 where it is
    carried. tilted, turned: rad, of a ring that is there before and after; a turn is the least that
    brings its sensors to their places."""

    place: int
    before: Ring | None
    after: Ring | None
    moved: float
    tilted: float
    turned: float

    @property
    def kind(self) -> ChangeKind:
        """What was done."""
        if self.before is None:
            return ChangeKind.ADDED
        if self.after is None:
            return ChangeKind.TAKEN
        return ChangeKind.SET if self.before.link == self.after.link else ChangeKind.CARRIED

    @property
    def sensors(self) -> int:
        """Sensors that this ring has more than before."""
        return (self.after.count if self.after else 0) - (self.before.count if self.before else 0)


@dataclass(frozen=True)
class Work:
    """The sums over changes: rings touched, rings carried to another link among them, sensors more
    than before, m along links, rad of tilt, rad of turning."""

    rings: int
    carried: int
    sensors: int
    moved: float
    tilted: float
    turned: float


@dataclass(frozen=True)
class Touched:
    """A setup some of whose rings are touched. rings: of each place what is there now; the mounted
    rings' places first, then those of added ones. free: the places that may differ from what is
    mounted."""

    rings: Rings
    free: tuple[int, ...] = ()

    @property
    def setup(self) -> Setup:
        """The setup as it is now; the rings that stay keep their order."""
        return Setup(tuple(ring for ring in self.rings if ring is not None))

    @property
    def sensors(self) -> int:
        """Number of sensors of all rings together."""
        return self.setup.sensors


def turn(before: Ring, after: Ring) -> float:
    """The least turn, rad and signed, that brings the first sensor of ``before`` to a place of one
    of ``after``.
    """
    return math.remainder(after.phase - before.phase, 2 * math.pi / after.count)


def changes(robot: Robot, before: Rings, after: Rings) -> list[Change]:
    """What differs between two tuples of places."""
    found = []
    for place, (a, b) in enumerate(zip(before, after, strict=True)):
        if a is not None and b is not None and a != b:
            moved = (
                abs(b.position - a.position) * robot.mount(a.link).length
                if a.link == b.link
                else 0.0
            )
            found.append(Change(place, a, b, moved, abs(b.tilt - a.tilt), abs(turn(a, b))))
        elif a != b:
            found.append(Change(place, a, b, 0.0, 0.0, 0.0))
    return found


def work(some: list[Change]) -> Work:
    """The work of all changes together."""
    return Work(
        len(some),
        sum(c.kind is ChangeKind.CARRIED for c in some),
        sum(c.sensors for c in some),
        math.fsum(c.moved for c in some),
        math.fsum(c.tilted for c in some),
        math.fsum(c.turned for c in some),
    )
