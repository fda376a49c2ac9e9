"""One Time-of-Flight unit."""

import math
from dataclasses import dataclass

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
    def zoned(self) -> bool:
        """Is the beam read zone by zone?"""
        return self.fov_up is not None and self.zones > 1

    @property
    def volume(self) -> float:
        """Volume of the beam, m^3: 0.1737 for the paper's sensor."""
        if self.fov_up is not None:
            return 4 / 3 * self.range_m**3 * math.tan(self.fov / 2) * math.tan(self.fov_up / 2)
        return math.pi / 3 * self.range_m**3 * math.tan(self.fov / 2) ** 2


PAPER_SENSOR = Sensor()
