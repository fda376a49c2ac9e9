"""Rings of sensors, and setups of rings."""

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from itertools import accumulate
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field

from ..arrays import Array
from ..definitions.definition import definition
from ..definitions.field_types import Items, Text
from ..definitions.options import Number, Whole
from ..definitions.units import OF_SCENE, Absent, Decimals, Degrees, Within
from ..sensors.sensor import PAPER_SENSOR, Sensor
from .mounted_sensor import MountedSensor

RING_RADIUS = 0.08  # m, in the paper's setups
SERIAL = "[0-9A-F]{16}"  # of a board
DIGITS_DEG = 4  # decimals of an angle in a file
DIGITS_POSITION = 6  # decimals of a ring's position in a file


def _tilt_deg(tilt: float) -> float:
    """Return a tilt in degrees as files state it.

    A tilt just below 90 degrees is not rounded up to 90. Adding 0 turns -0.0 into 0.0.
    """
    angle, most = math.degrees(tilt), 90 - 10.0**-DIGITS_DEG
    short = round(angle, DIGITS_DEG)
    return (
        round(math.copysign(most, angle), DIGITS_DEG)
        if abs(angle) < 90 <= abs(short)
        else short + 0.0
    )


def _phase_deg(phase: float) -> float:
    """Return a phase in degrees as files state it; beyond a full turn it is wrapped."""
    angle = math.degrees(phase)
    return round(angle if abs(angle) <= 360 else math.remainder(angle, 360), DIGITS_DEG) + 0.0


# measured rings may lie beyond an end of a short link and have any tilt
_POSITION = Decimals(DIGITS_POSITION, ge=0, le=1).wider(Number("a finite number"))
_TILT = Degrees("tilt_deg", write=_tilt_deg, gt=-90, lt=90).wider(
    Number("rad, between -pi and pi", ge=-math.pi, le=math.pi)
)
_PHASE = Degrees("phase_deg", write=_phase_deg, ge=-360, le=360).wider(
    Number("rad, a finite number")
)
_RADIUS = Within(gt=0, le=1).wider(Number("m, at least 0", ge=0))


@definition
class Ring:
    """Sensors evenly spaced around a link. A measured ring may lie beyond the link's ends."""

    link: Text
    """Name of the robot's mount."""
    position: Annotated[float, _POSITION, Absent(0.0)]
    """Position along the mount axis, from 0 proximal to 1 distal."""
    count: Annotated[int, Within(ge=1, le=1000).wider(Whole(0))]
    """Number of sensors."""
    tilt: Annotated[float, _TILT] = 0.0
    """Angle of each sensor's axis out of the ring's plane, positive towards distal, rad."""
    phase: Annotated[float, _PHASE] = 0.0
    """Angle of the first sensor about the mount axis, right-handed from proximal to distal, rad."""
    radius: Annotated[float, _RADIUS, Absent(OF_SCENE)] = RING_RADIUS
    """Radius of the circle of sensors, m; in a file by default the scene's."""
    sensor: Annotated[Sensor, Absent(OF_SCENE)] = PAPER_SENSOR
    """The sensor model; in a file by default the scene's."""
    serial: Annotated[str, Field(pattern=f"^{SERIAL}$")] | None = field(default=None, compare=False)
    """Serial number of the ring's board, 16 hexadecimal digits; default: unknown."""
    zone_turn_deg: Literal[0, 90, 180, 270] = field(default=0, compare=False)
    """Angle by which its sensors are turned about their axes on their boards, degrees,
    counter-clockwise as seen along the axis; of sensors with zones."""
    zone_mirrored: bool = field(default=False, compare=False)
    """Whether the columns of its sensors' zones are sent in the opposite order."""

    def __repr__(self) -> str:
        angles = f"tilt={float(self.tilt):.4g}, phase={float(self.phase):.4g}"
        beam = "" if self.sensor == PAPER_SENSOR else f", sensor={self.sensor!r}"
        return (
            f"Ring({self.link!r}, {float(self.position):.4g}, {self.count}, {angles},"
            f" radius={self.radius:g}{beam})"
        )


Group = Ring | MountedSensor
"""A ring, or a single sensor: what one number stands for in lists of a setup's sensors."""


@definition
class Setup:
    """All rings and single sensors on one robot."""

    rings: Annotated[Items[Ring], Field(max_length=1000)] = ()
    """The rings, numbered from 0 in this order."""
    singles: Annotated[Items[MountedSensor], Field(max_length=1000, alias="sensors")] = ()
    """The single sensors, whose numbers follow those of the rings."""

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

    def with_sensors(self, change: Callable[[Sensor], Sensor]) -> "Setup":
        """Return the setup with ``change`` applied to the sensor of each ring and single sensor."""
        rings = tuple(replace(ring, sensor=change(ring.sensor)) for ring in self.rings)
        return Setup(rings, tuple(replace(s, sensor=change(s.sensor)) for s in self.singles))

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
