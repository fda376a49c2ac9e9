"""Rings of sensors, and setups of rings."""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import accumulate
from numbers import Integral, Real

import numpy as np
from jaxtyping import Float, Int

from ..angles import radians_hint
from ..arrays import Array
from ..sensors.sensor import PAPER_SENSOR, Sensor
from .mounted_sensor import MountedSensor

RING_RADIUS = 0.08  # m, in the paper's setups
SERIAL = "[0-9A-F]{16}"  # of a board


@dataclass(frozen=True)
class Ring:
    """Sensors evenly spaced around a link."""

    link: str
    """Name of the robot's mount."""
    position: float
    """Position along the mount axis, 0 proximal to 1 distal; a measured ring may lie beyond."""
    count: int
    """Number of sensors."""
    tilt: float = 0.0
    """Angle of each sensor's axis out of the ring's plane, positive towards distal, rad."""
    phase: float = 0.0
    """Angle of the first sensor about the mount axis, right-handed from proximal to distal, rad."""
    radius: float = RING_RADIUS
    """Radius of the circle of sensors, m."""
    sensor: Sensor = field(default=PAPER_SENSOR)
    """The sensor model."""
    serial: str | None = field(default=None, compare=False)
    """Serial number of the ring's board, 16 hexadecimal digits; None if unknown."""
    zone_turn_deg: int = field(default=0, compare=False)
    """Angle by which its sensors are turned about their axes on their boards, counter-clockwise as
    seen along the axis: 0, 90, 180 or 270; of sensors with zones."""
    zone_mirrored: bool = field(default=False, compare=False)
    """Whether the columns of its sensors' zones are sent in the opposite order."""

    def __post_init__(self) -> None:
        """Reject values outside their range with a ``ValueError``."""
        if not isinstance(self.link, str):
            raise ValueError(f"Ring: link: found {self.link!r}, allowed: the name of a link")
        if not isinstance(self.sensor, Sensor):
            raise ValueError(
                f"Ring: sensor: found {self.sensor!r}, allowed: a Sensor, as a catalogue has them"
            )
        if self.serial is not None and not (
            isinstance(self.serial, str) and re.fullmatch(SERIAL, self.serial)
        ):
            raise ValueError(
                f"Ring: serial: found {self.serial!r}, allowed: 16 hexadecimal digits, 0 to 9 and"
                " A to F"
            )
        if not isinstance(self.zone_turn_deg, Real) or self.zone_turn_deg not in (0, 90, 180, 270):
            raise ValueError(
                f"Ring: zone_turn_deg: found {self.zone_turn_deg!r}, allowed: 0, 90, 180 or 270"
            )
        if not isinstance(self.count, Integral):
            raise ValueError(f"Ring: count: found {self.count!r}, allowed: an integer")
        for name in ("position", "tilt", "phase", "radius"):
            if not isinstance(value := getattr(self, name), Real):
                raise ValueError(f"Ring: {name}: found {value!r}, allowed: a number")
        # measured rings may lie beyond an end of a short link and have any tilt
        for name, value, allowed, holds in (
            ("position", self.position, "a finite number", math.isfinite(self.position)),
            ("count", self.count, "a number of sensors", self.count >= 0),
            ("tilt", self.tilt, "rad, between -pi and pi", abs(self.tilt) <= math.pi),
            ("phase", self.phase, "rad, a finite number", math.isfinite(self.phase)),
            ("radius", self.radius, "m, at least 0", 0 <= self.radius < math.inf),
        ):
            if not holds:
                hint = radians_hint(value) if name == "tilt" else ""
                raise ValueError(f"Ring: {name}: found {value}, allowed: {allowed}{hint}")

    def __repr__(self) -> str:
        angles = f"tilt={float(self.tilt):.4g}, phase={float(self.phase):.4g}"
        beam = "" if self.sensor == PAPER_SENSOR else f", sensor={self.sensor!r}"
        return (
            f"Ring({self.link!r}, {float(self.position):.4g}, {self.count}, {angles},"
            f" radius={self.radius:g}{beam})"
        )


Group = Ring | MountedSensor
"""A ring, or a single sensor: what one number stands for in lists of a setup's sensors."""


@dataclass(frozen=True)
class Setup:
    """All rings and single sensors on one robot.

    Raises:
        ValueError: if an item is not of its kind.
    """

    rings: tuple[Ring, ...] = ()
    """The rings, numbered from 0 in this order; a list becomes a tuple."""
    singles: tuple[MountedSensor, ...] = ()
    """The single sensors, whose numbers follow those of the rings; a list becomes a tuple."""

    def __post_init__(self) -> None:
        for key, kind in (("rings", Ring), ("singles", MountedSensor)):
            if not isinstance(some := getattr(self, key), Iterable):
                raise ValueError(f"Setup: {key}: found {some!r}, allowed: {kind.__name__}s")
            each = tuple(some)
            for one in each:
                if not isinstance(one, kind):
                    raise ValueError(
                        f"Setup: {key}: found a {type(one).__name__}, allowed: {kind.__name__}"
                    )
            object.__setattr__(self, key, each)

    def __repr__(self) -> str:
        each = "".join(f"\n    {ring!r}," for ring in self.rings)
        if not self.singles:
            return f"Setup(({each}\n))  # {self.sensors} sensors" if each else "Setup(())"
        more = "".join(f"\n    {one!r}," for one in self.singles)
        rings = f"({each}\n)" if each else "()"
        return f"Setup({rings}, singles=({more}\n))  # {self.sensors} sensors"

    def __str__(self) -> str:
        """Return the rings, and once the sensor that all of them have."""
        kinds = {ring.sensor for ring in self.rings}
        if len(kinds) != 1 or kinds == {PAPER_SENSOR}:
            return repr(self)
        bare = tuple(replace(ring, sensor=PAPER_SENSOR) for ring in self.rings)
        return f"{Setup(bare, self.singles)!r}, on each ring {kinds.pop()!r}"

    @property
    def groups(self) -> tuple[Group, ...]:
        """The rings, then the single sensors, each a group of one; in the order of their
        numbers."""
        return (*self.rings, *self.singles)

    @staticmethod
    def named(name: str, sensor: Sensor = PAPER_SENSOR, radius: float = RING_RADIUS) -> "Setup":
        """Return the paper's setup of a name such as ``n2_16_25``; see ``named_setup``."""
        return named_setup(name, sensor, radius)

    @property
    def values(self) -> Float[np.ndarray, "3 R"]:
        """Positions (row 0), tilts and phases (rows 1 and 2, rad) of the rings."""
        v = ring_values(self.rings)
        return np.stack([v.position, v.tilt, v.phase])

    def with_values(self, values: Float[np.ndarray, "3 R"]) -> "Setup":
        """Return the setup with the same rings at other positions, tilts and phases.

        Args:
            values: positions (row 0), tilts and phases (rows 1 and 2, rad), as in ``values``.

        Raises:
            ValueError: if the shape or a value is not valid.
        """
        values = np.asarray(values, float)
        if values.shape != (3, len(self.rings)):
            raise ValueError(f"values: found shape {values.shape}, allowed: (3, {len(self.rings)})")
        rings = tuple(
            replace(ring, position=float(p), tilt=float(t), phase=float(f))
            for ring, (p, t, f) in zip(self.rings, values.T, strict=True)
        )
        return replace(self, rings=rings)

    @property
    def sensors(self) -> int:
        """Total number of sensors."""
        return sum(group.count for group in self.groups)

    @property
    def ring_of_sensor(self) -> Int[np.ndarray, " K"]:
        """Number of each sensor's ring or, for a single sensor, its own."""
        return np.repeat(np.arange(len(self.groups)), [group.count for group in self.groups])

    @property
    def slices(self) -> list[slice]:
        """Which of all sensors are those of each ring or single sensor."""
        ends = accumulate(group.count for group in self.groups)
        return [slice(end - g.count, end) for g, end in zip(self.groups, ends, strict=True)]

    def group_name(self, number: int) -> str:
        """Name a ring or single sensor in messages: ``ring 0 (forearm)``, ``sensor pad (tool)`` or,
        without a name of its own, ``sensor 2 (tool)``.
        """
        group = self.groups[number]
        if isinstance(group, MountedSensor):
            return f"sensor {group.name or number} ({group.link})"
        return f"ring {number} ({group.link})"

    @property
    def labels(self) -> list[tuple[int, int]]:
        """The number of each sensor's group and its own number there, in the order of sensors."""
        return [(i, k) for i, group in enumerate(self.groups) for k in range(group.count)]


def setup_of_group(group: Group) -> Setup:
    """Return the setup of one ring or single sensor."""
    return Setup((), (group,)) if isinstance(group, MountedSensor) else Setup((group,))


_NAME = re.compile(r"n([123])_([1-9]\d{0,3})_(-?\d{1,2}(?:\.\d+)?)")


def named_setup(name: str, sensor: Sensor = PAPER_SENSOR, radius: float = RING_RADIUS) -> Setup:
    """Return the paper's setup n{i}_{j}_{theta}.

    It has i rings on upper arm and forearm each, with j sensors a ring and a tilt of theta degrees,
    and one ring of j sensors at tilt 0 on the tool.

    i = 1: at the middle, tilted by +theta. i = 2: at both ends, tilted towards each other by theta.
    i = 3: the two ends tilted by theta and the middle at 0.

    Args:
        name: the name, such as ``n2_16_25``.
        sensor: sensor model, by default the paper's.
        radius: ring radius, m, by default the paper's.

    Raises:
        ValueError: if the name does not have this form.
    """
    match = _NAME.fullmatch(name)
    if match is None:
        raise ValueError(
            f"unknown setup {name!r}; a name like n2_16_25 states the rings on each link (1 to 3),"
            " the sensors on each ring, and the tilt in degrees"
        )
    rings_per_link, count, tilt = int(match[1]), int(match[2]), math.radians(float(match[3]))
    places = {
        1: [(0.5, tilt)],
        2: [(0.0, tilt), (1.0, -tilt)],
        3: [(0.0, tilt), (0.5, 0.0), (1.0, -tilt)],
    }[rings_per_link]
    rings = [
        Ring(link, position, count, t, 0.0, radius, sensor)
        for link in ("upper_arm", "forearm")
        for position, t in places
    ]
    return Setup((*rings, Ring("tool", 0.0, count, 0.0, 0.0, radius, sensor)))


@dataclass(frozen=True)
class RingValues:
    """The design variables of a setup."""

    position: Float[Array, " R"]
    """Position of each ring along its mount axis, 0 to 1."""
    tilt: Float[Array, " R"]
    """Tilt of each ring, rad."""
    phase: Float[Array, " R"]
    """Phase of each ring, rad."""


def ring_values(rings: Iterable[Group]) -> RingValues:
    """Return the design variables of rings, as 64-bit NumPy arrays; those of a single sensor are
    0."""
    each = [
        (0.0, 0.0, 0.0) if isinstance(r, MountedSensor) else (r.position, r.tilt, r.phase)
        for r in rings
    ]
    return RingValues(*np.array(each, float).reshape(-1, 3).T.copy())


def sensor_optics(setup: Setup) -> tuple[Float[np.ndarray, " K"], Float[np.ndarray, " K"]]:
    """Return half angle (K,) rad and range (K,) m of all sensors, group by group.

    The half angle of a pyramid is that of its inscribed cone.
    """
    each = [
        (group.sensor.inscribed_half_angle, group.sensor.range_m)
        for group in setup.groups
        for _ in range(group.count)
    ]
    half, range_m = np.array(each, float).reshape(-1, 2).T.copy()
    return half, range_m
