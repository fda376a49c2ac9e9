"""One Time-of-Flight unit."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Use:
    """A model of the catalogue, and what it is used for. ambient: light as the catalogue writes it, like ``50kcps``;
    reflectance: of the target, in (0, 1]; size: width and height of the target, m. None: as its maker measured."""

    model: str
    ambient: str | None = None
    reflectance: float | None = None
    size: tuple[float, float] | None = None


@dataclass(frozen=True)
class Sensor:
    """A unit that sees a cone: fov, full angle in radians, in (0, pi); range_m, height of the cone, m. use: where it is a
    model of the catalogue, and the range follows from what it is used for."""

    fov: float = math.radians(25)
    range_m: float = 1.5
    use: Use | None = None

    @property
    def volume(self) -> float:
        """Volume of the cone, m^3: 0.1737 for the paper's sensor."""
        return math.pi / 3 * self.range_m**3 * math.tan(self.fov / 2) ** 2


PAPER_SENSOR = Sensor()
