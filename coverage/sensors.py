"""One Time-of-Flight unit."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Sensor:
    """A unit that sees a cone: fov, full angle in radians, in (0, pi); range_m, height of the cone, m."""

    fov: float = math.radians(25)
    range_m: float = 1.5

    @property
    def volume(self) -> float:
        """Volume of the cone, m^3: 0.1737 for the paper's sensor."""
        return math.pi / 3 * self.range_m**3 * math.tan(self.fov / 2) ** 2


PAPER_SENSOR = Sensor()
