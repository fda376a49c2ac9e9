"""Changes to a mounted setup, ring by ring, and their effort.

One change touches one ring. It adjusts the ring on its link (place, tilt, phase, sensors, or any of
them together), moves it to another link, adds it, or removes it. Effort is reported, not optimised:
rings touched, sensors to buy, millimetres along links, degrees of tilt and rotation, rings moved to
another link.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Literal, Self

from ...coverage.definitions.definition import definition
from ...coverage.definitions.field_types import InPython, Items
from ...coverage.definitions.units import Covered, Degrees, Key, Millimetres, Points
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.rings.ring import DIGITS_DEG, Ring, Setup
from ...coverage.rings.rounding import of_scene
from ...coverage.robots.robot import Robot
from ...coverage.sensors.sensor import Sensor
from ...objectives.verified import Verified

Rings = tuple[Ring | None, ...]  # the ring at each place, None: no ring


def _degrees(angle: float) -> float:
    return round(math.degrees(angle), DIGITS_DEG) + 0.0


_Moved = Annotated[float, Millimetres("moved_mm", 3, ge=0)]
_Tilted = Annotated[float, Degrees("tilted_deg", write=_degrees, ge=0)]
_Turned = Annotated[float, Degrees("turned_deg", write=_degrees, ge=0)]


@definition(kw_only=True)
class Change:
    """A change to one ring."""

    ring: int | None = None
    """Number of the mounted ring, counted from 0; none for a new ring."""
    done: Literal["set anew", "carried over", "added", "taken away"]
    """Kind of the change."""
    before: Ring | None = None
    """Ring before the change; none for a new ring."""
    after: Ring | None = None
    """Ring after the change; none for a removed ring."""
    sensors: int
    """Number of sensors added."""
    moved: _Moved = 0.0
    """Displacement along the link, m; 0 if it moves to another link."""
    tilted: _Tilted = 0.0
    """Change of tilt, rad; 0 for a new or removed ring."""
    turned: _Turned = 0.0
    """Least rotation about the link that brings the sensors to their new places, rad; 0 for a new
    or removed ring."""

    def in_file(self, sensor: Sensor) -> Self:
        """Return the change as a file of a scene with ``sensor`` states it."""
        return replace(
            self,
            before=self.before and of_scene(Setup((self.before,)), sensor).rings[0],
            after=self.after and of_scene(Setup((self.after,)), sensor).rings[0],
        )

    def instruction(self, robot: Robot) -> str:
        """Return what to do to the ring, as one line of text; lengths are those of ``robot``."""
        before, after = self.before, self.after
        name = "new ring" if self.ring is None else f"ring {self.ring}"
        if after is None:
            place = f" ({before.link}, {before.count} sensors)" if before else ""
            return f"{name}{place}: remove"
        length, place = robot.mount(after.link).length, ""
        if length > 0:
            place = f", {1000 * after.position * length:.0f} mm from its proximal end"
        if before is None:
            angles = f"tilt {_signed(after.tilt)}, phase {math.degrees(after.phase):.1f}°"
            return f"{name}: {after.count} sensors on {after.link}{place}, {angles}"
        steps = []
        if self.done == "carried over":
            steps.append(f"carry to {after.link}{place}")
        elif self.moved:
            way = "distal" if after.position > before.position else "proximal"
            to = place.removeprefix(",")
            steps.append(f"move {1000 * self.moved:.0f} mm towards the {way} end, to{to}")
        if self.tilted:
            steps.append(f"tilt {_signed(before.tilt)} → {_signed(after.tilt)}")
        if self.turned:
            steps.append(f"turn by {_signed(turn(before, after))}")
        if self.sensors:
            steps.append(f"{before.count} → {after.count} sensors")
        return f"{name} ({before.link}): {', '.join(steps)}"


def _signed(angle: float) -> str:
    return f"{math.degrees(angle):+.1f}°"


@definition
class Work:
    """Total effort of the changes. A ring that moves to another link adds no millimetres."""

    rings: Annotated[int, Key("rings_touched")]
    """Number of rings touched."""
    carried: Annotated[int, Key("rings_carried")]
    """Number of rings moved to another link."""
    sensors: Annotated[int, Key("sensors_added")]
    """Number of sensors added."""
    moved: _Moved
    """Displacement along links, m."""
    tilted: _Tilted
    """Change of tilt, rad."""
    turned: _Turned
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


@definition(kw_only=True)
class Answer:
    """The best setup for a number of changes."""

    touched: InPython[Touched] = None  # type: ignore[assignment]
    """The changed setup; None from a file."""
    soft: InPython[float] = 0.0
    """Soft ζ; of the mounted setup, and of what is counted after the time limit, the exact one."""
    exact: Annotated[float, Covered("exact_percent")]
    """Exact coverage, weighted mean over the targets."""
    gain: Annotated[float, Points("gain_percent", 16)] = 0.0
    """Gain over the mounted setup."""
    short: Annotated[float, Points("short_percent", 16)]
    """Sum by which floors are missed."""
    work: Work
    """Effort of the changes."""
    changes: Items[Change]
    """Changes."""
    rings: Items[Ring] = ()
    """All rings after the changes."""
    zeta: Items[Verified] = ()
    """Verified coverage of each target."""

    def in_file(self, mounted: "Answer", sensor: Sensor, zeta: Iterable[Verified]) -> Self:
        """Return the answer as a file of a scene with ``sensor`` states it, beside that of the
        mounted setup and with the coverage of each target."""
        return replace(
            self,
            gain=self.exact - mounted.exact,
            changes=tuple(change.in_file(sensor) for change in self.changes),
            rings=of_scene(self.setup, sensor).rings,
            zeta=tuple(zeta),
        )

    @property
    def setup(self) -> Setup:
        """All rings after the changes; unchanged rings come first, in their order."""
        return self.touched.setup

    @property
    def key(self) -> tuple[float, float]:
        """Sort key, smaller is better: missed floors first, then ζ."""
        return self.short, -self.exact


def turn(before: Ring, after: Ring) -> float:
    """Return the least signed rotation, rad, that brings the first sensor of ``before`` to a sensor
    place of ``after``."""
    return math.remainder(after.phase - before.phase, 2 * math.pi / after.count)


def changes(robot: Robot, before: Rings, after: Rings) -> list[Change]:
    """Return the differences between two tuples of places."""
    differences = []
    for place, (a, b) in enumerate(zip(before, after, strict=True)):
        if a == b:
            continue
        ring = None if a is None else place
        sensors = (b.count if b else 0) - (a.count if a else 0)
        change = partial(Change, ring=ring, before=a, after=b, sensors=sensors)
        if a is None or b is None:
            differences.append(change(done="added" if a is None else "taken away"))
            continue
        carried, length = a.link != b.link, robot.mount(a.link).length
        differences.append(
            change(
                done="carried over" if carried else "set anew",
                moved=0.0 if carried else abs(b.position - a.position) * length,
                tilted=abs(b.tilt - a.tilt),
                turned=abs(turn(a, b)),
            )
        )
    return differences


def work(each: Sequence[Change]) -> Work:
    """Return the total effort of changes."""
    return Work(
        len(each),
        sum(c.done == "carried over" for c in each),
        sum(c.sensors for c in each),
        math.fsum(c.moved for c in each),
        math.fsum(c.tilted for c in each),
        math.fsum(c.turned for c in each),
    )
