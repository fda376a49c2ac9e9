"""Rings of sensors, and setups of rings."""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from numbers import Integral, Real

import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array
from ..sensors.sensor import PAPER_SENSOR, Sensor

RING_RADIUS = 0.08  # m, in the paper's setups


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

    def __post_init__(self) -> None:
        """Reject values outside their range with a ``ValueError``."""
        if not isinstance(self.link, str):
            raise ValueError(f"Ring: link: found {self.link!r}, allowed: the name of a link")
        if not isinstance(self.sensor, Sensor):
            raise ValueError(
                f"Ring: sensor: found {self.sensor!r}, allowed: a Sensor, as a catalogue has them"
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
                raise ValueError(f"Ring: {name}: found {value}, allowed: {allowed}")

    def __repr__(self) -> str:
        angles = f"tilt={float(self.tilt):.4g}, phase={float(self.phase):.4g}"
        beam = "" if self.sensor == PAPER_SENSOR else f", sensor={self.sensor!r}"
        return (
            f"Ring({self.link!r}, {float(self.position):.4g}, {self.count}, {angles},"
            f" radius={self.radius:g}{beam})"
        )


@dataclass(frozen=True)
class Setup:
    """All rings on one robot.

    Raises:
        ValueError: if an item is not a ``Ring``.
    """

    rings: tuple[Ring, ...]
    """The rings, numbered from 0 in this order; a list becomes a tuple."""

    def __post_init__(self) -> None:
        if not isinstance(self.rings, Iterable):
            raise ValueError(f"Setup: rings: found {self.rings!r}, allowed: Rings")
        rings = tuple(self.rings)
        for ring in rings:
            if not isinstance(ring, Ring):
                raise ValueError(f"Setup: rings: found a {type(ring).__name__}, allowed: Ring")
        object.__setattr__(self, "rings", rings)

    def __repr__(self) -> str:
        each = "".join(f"\n    {ring!r}," for ring in self.rings)
        return f"Setup(({each}\n))  # {self.sensors} sensors" if each else "Setup(())"

    @staticmethod
    def named(name: str, sensor: Sensor = PAPER_SENSOR, radius: float = RING_RADIUS) -> "Setup":
        """Return the paper's setup of a name such as ``n2_16_25``; see ``named_setup``."""
        return named_setup(name, sensor, radius)

    @property
    def values(self) -> Float[np.ndarray, "3 R"]:
        """Positions (row 0), tilts and phases (rows 1 and 2, rad) of the rings."""
        v = ring_values(self)
        return np.stack([v.position, v.tilt, v.phase])

    def with_values(self, values: Float[np.ndarray, "3 R"]) -> "Setup":
        """Return the same rings at other positions, tilts and phases.

        Args:
            values: positions (row 0), tilts and phases (rows 1 and 2, rad), as in ``values``.

        Raises:
            ValueError: if the shape or a value is not valid.
        """
        values = np.asarray(values, float)
        if values.shape != (3, len(self.rings)):
            raise ValueError(f"values: found shape {values.shape}, allowed: (3, {len(self.rings)})")
        return Setup(
            tuple(
                replace(ring, position=float(p), tilt=float(t), phase=float(f))
                for ring, (p, t, f) in zip(self.rings, values.T, strict=True)
            )
        )

    @property
    def sensors(self) -> int:
        """Total number of sensors."""
        return sum(ring.count for ring in self.rings)

    @property
    def ring_of_sensor(self) -> Int[np.ndarray, " K"]:
        """Index of each sensor's ring."""
        return np.repeat(np.arange(len(self.rings)), [ring.count for ring in self.rings])


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


def ring_values(setup: Setup) -> RingValues:
    """Return the design variables of a setup's rings, as 64-bit NumPy arrays."""
    return RingValues(
        *(
            np.array([getattr(r, key) for r in setup.rings], float)
            for key in ("position", "tilt", "phase")
        )
    )


def sensor_optics(setup: Setup) -> tuple[Float[np.ndarray, " K"], Float[np.ndarray, " K"]]:
    """Return half angle (K,) rad and range (K,) m of all sensors, ring by ring.

    The half angle of a pyramid is that of its inscribed cone.
    """
    return (
        np.concatenate([np.full(r.count, r.sensor.inscribed_half_angle) for r in setup.rings]),
        np.concatenate([np.full(r.count, r.sensor.range_m) for r in setup.rings]),
    )
