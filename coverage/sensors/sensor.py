"""One Time-of-Flight unit."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from .boards import Board


@dataclass(frozen=True)
class Use:
    """A model of the catalogue, and what it is used for. ambient: light as the catalogue writes it,
    like ``50kcps``; reflectance: of the target, in (0, 1]; size: width and height of the target, m.
    None: as its maker measured."""

    model: str
    ambient: str | None = None
    reflectance: float | None = None
    size: tuple[float, float] | None = None


@dataclass(frozen=True)
class Sensor:
    """A unit that sees a cone, or a pyramid: fov, full angle in radians, in (0, pi); range_m,
    height, m. use: where it is a model of the catalogue, and the range follows from what it is used
    for. fov_up: of a pyramid, the full angle along its ring's axis (tilted with the sensor), where
    ``fov`` is that along the ring; None: a cone. zones: in a row of a pyramid, each of which
    reports the nearest thing in itself; 1: the beam reports one distance, as that of a cone does.
    board: that carries it, if that is known."""

    fov: float = math.radians(25)
    range_m: float = 1.5
    use: Use | None = None
    fov_up: float | None = None
    zones: int = 1
    board: Board | None = None

    def __post_init__(self) -> None:
        """Refuse what no sensor has: ValueError."""
        up = self.fov_up
        for name, value, allowed, holds in (
            ("fov", self.fov, "rad, above 0 and below pi", 0 < self.fov < math.pi),
            ("range_m", self.range_m, "m, above 0", 0 < self.range_m < math.inf),
            ("fov_up", up, "None, or rad, above 0 and below pi", up is None or 0 < up < math.pi),
            ("zones", self.zones, "1 and more", self.zones >= 1),
        ):
            if not holds:
                raise ValueError(f"Sensor: {name}: found {value}, allowed: {allowed}")

    def __repr__(self) -> str:
        up = "" if self.fov_up is None else f", fov_up={self.fov_up:.6g}, zones={self.zones}"
        use = "" if self.use is None else f", use={self.use!r}"
        return f"Sensor(fov={self.fov:.6g}, range_m={self.range_m:.4g}{up}{use})"

    @property
    def square(self) -> bool:
        """Is the beam a pyramid, not a cone?"""
        return self.fov_up is not None

    @property
    def zoned(self) -> bool:
        """Is the beam read zone by zone?"""
        return self.square and self.zones > 1

    @property
    def half_angle(self) -> float:
        """Half angle of the beam along its ring, rad; in every direction where it is a cone."""
        return self.fov / 2

    @property
    def half_angle_up(self) -> float:
        """Half angle of a square beam along its ring's axis, rad; 0 where it is a cone."""
        return 0.0 if self.fov_up is None else self.fov_up / 2

    @property
    def inscribed_half_angle(self) -> float:
        """Half angle of the widest cone within the beam, rad: the smaller one of a pyramid's."""
        return self.half_angle if self.fov_up is None else min(self.fov, self.fov_up) / 2

    @property
    def circumscribed_half_angle(self) -> float:
        """Half angle of the narrowest cone around the beam, rad: through a pyramid's corners."""
        return math.atan(math.hypot(math.tan(self.half_angle), math.tan(self.half_angle_up)))

    def with_angles(self, change: Callable[[float], float]) -> "Sensor":
        """The sensor with each of its full angles, rad, replaced by ``change`` of it."""
        up = None if self.fov_up is None else change(self.fov_up)
        return replace(self, fov=change(self.fov), fov_up=up)

    @property
    def volume(self) -> float:
        """Volume of the beam, m^3: 0.1737 for the paper's sensor."""
        wide, high = math.tan(self.half_angle), math.tan(self.half_angle_up)
        if self.square:
            return 4 / 3 * self.range_m**3 * wide * high
        return math.pi / 3 * self.range_m**3 * wide**2


PAPER_SENSOR = Sensor()
