"""A Time-of-Flight sensor: its beam and its use."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from .boards import Board
from .sensor_model import Model


@dataclass(frozen=True)
class Use:
    """A sensor model and its use. None: as the manufacturer measured."""

    model: str
    """Name in the catalogue, or of ``own``."""
    ambient: str | None = None
    """Ambient light in the catalogue's notation, such as ``50kcps``."""
    reflectance: float | None = None
    """Reflectance of the target, in (0, 1]."""
    size: tuple[float, float] | None = None
    """Width and height of the target, m."""
    own: Model | None = None
    """The user's own model, of a sensor file; None: that of the catalogue."""

    @classmethod
    def of(cls, own: Model) -> "Use":
        """Return the use of a user's own model, as its source measured."""
        return cls(own.name, own=own)


@dataclass(frozen=True)
class Sensor:
    """A sensor whose beam is a cone or a pyramid."""

    fov: float = math.radians(25)
    """Full angle of a cone, or of a pyramid along its ring, rad, in (0, pi)."""
    range_m: float = 1.5
    """Height of the cone or pyramid, m."""
    use: Use | None = None
    """The use from which the range of a catalogue model follows; None for other sensors."""
    fov_up: float | None = None
    """Full angle of a pyramid along its ring's axis (tilted with the sensor), rad; None: a cone."""
    zones: int = 1
    """Zones in a row of a pyramid, each of which reports its own first return; 1: the whole beam
    reports one distance, as a cone does."""
    board: Board | None = None
    """The board that carries the sensor, if known."""

    def __post_init__(self) -> None:
        """Reject values outside their range with a ``ValueError``."""
        up = self.fov_up
        for name, value, allowed, holds in (
            ("fov", self.fov, "rad, above 0 and below pi", 0 < self.fov < math.pi),
            ("range_m", self.range_m, "m, above 0", 0 < self.range_m < math.inf),
            ("fov_up", up, "None, or rad, above 0 and below pi", up is None or 0 < up < math.pi),
            ("zones", self.zones, "at least 1", self.zones >= 1),
        ):
            if not holds:
                raise ValueError(f"Sensor: {name}: found {value}, allowed: {allowed}")

    def __repr__(self) -> str:
        up = "" if self.fov_up is None else f", fov_up={self.fov_up:.6g}, zones={self.zones}"
        use = "" if self.use is None else f", use={self.use!r}"
        return f"Sensor(fov={self.fov:.6g}, range_m={self.range_m:.4g}{up}{use})"

    @property
    def square(self) -> bool:
        """Whether the beam is a pyramid."""
        return self.fov_up is not None

    @property
    def zoned(self) -> bool:
        """Whether each zone of the beam reports its own distance."""
        return self.square and self.zones > 1

    @property
    def half_angle(self) -> float:
        """Half angle of the beam along its ring, rad; for a cone in every direction."""
        return self.fov / 2

    @property
    def half_angle_up(self) -> float:
        """Half angle of a square beam along its ring's axis, rad; 0 for a cone."""
        return 0.0 if self.fov_up is None else self.fov_up / 2

    @property
    def inscribed_half_angle(self) -> float:
        """Half angle of the beam's inscribed cone, rad: the smaller one of a pyramid's."""
        return self.half_angle if self.fov_up is None else min(self.fov, self.fov_up) / 2

    @property
    def circumscribed_half_angle(self) -> float:
        """Half angle of the circumscribed cone, rad; it passes through a pyramid's corners."""
        return math.atan(math.hypot(math.tan(self.half_angle), math.tan(self.half_angle_up)))

    def with_angles(self, change: Callable[[float], float]) -> "Sensor":
        """Return the sensor with ``change`` applied to each of its full angles, rad."""
        up = None if self.fov_up is None else change(self.fov_up)
        return replace(self, fov=change(self.fov), fov_up=up)

    @property
    def volume(self) -> float:
        """Volume of the beam, m^3; 0.1737 for the paper's sensor."""
        wide, high = math.tan(self.half_angle), math.tan(self.half_angle_up)
        if self.square:
            return 4 / 3 * self.range_m**3 * wide * high
        return math.pi / 3 * self.range_m**3 * wide**2


PAPER_SENSOR = Sensor()
