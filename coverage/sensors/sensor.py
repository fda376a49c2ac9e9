"""A sensor: its beam and its use."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

from ..angles import radians_hint
from .boards import Board
from .sensor_model import Model

Shape = Literal["beam", "dome", "fan"]


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
    """A sensor whose beam is a cone or a pyramid, a dome or a fan."""

    fov: float = math.radians(25)
    """Full angle of a cone, or of a pyramid along its ring, rad, in (0, pi); of a dome up to pi, of
    a fan up to 2 pi."""
    range_m: float = 1.5
    """Height of the cone or pyramid, radius of the dome or fan, m."""
    use: Use | None = None
    """The use from which the range of a catalogue model follows; None for other sensors."""
    fov_up: float | None = None
    """Full angle of a pyramid along its ring's axis (tilted with the sensor), rad; None: a cone."""
    zones: int = 1
    """Zones in a row of a pyramid, each of which reports its own first return; 1: the whole beam
    reports one distance, as a cone does."""
    board: Board | None = None
    """The board that carries the sensor, if known."""
    shape: Shape = "beam"
    """``beam``: a cone or pyramid. ``dome``: a cone that ends in a ball about its apex, such as the
    field of a capacitive pad. ``fan``: a sector in the plane across ``up``, as of a laser
    scanner."""
    thickness: float | None = None
    """Thickness of a fan, m; None for other shapes."""
    near_m: float = 0.0
    """Distance along the axis at which a cone or pyramid begins, m."""

    def __post_init__(self) -> None:
        """Reject values outside their range with a ``ValueError``."""
        up, fan = self.fov_up, self.shape == "fan"
        fov = {
            "beam": ("rad, above 0 and below pi", 0 < self.fov < math.pi),
            "dome": ("rad, above 0 and at most pi", 0 < self.fov <= math.pi),
            "fan": ("rad, above 0 and at most 2 pi", 0 < self.fov <= 2 * math.pi),
        }
        if self.shape not in fov:
            raise ValueError(f"Sensor: shape: found {self.shape}, allowed: {', '.join(fov)}")
        thick = self.thickness
        for name, value, allowed, holds in (
            ("fov", self.fov, *fov[self.shape]),
            ("range_m", self.range_m, "m, above 0", 0 < self.range_m < math.inf),
            ("fov_up", up, "None, or rad, above 0 and below pi", up is None or 0 < up < math.pi),
            ("zones", self.zones, "at least 1", self.zones >= 1),
            ("fov_up", up, f"None for a {self.shape}", up is None or self.shape == "beam"),
            (
                "thickness",
                thick,
                "m, above 0, for a fan; None for others",
                0 < thick < math.inf if fan and thick is not None else thick is None and not fan,
            ),
            (
                "near_m",
                self.near_m,
                "m, at least 0 and below the range; 0 for a dome or fan",
                0 <= self.near_m < self.range_m and (self.shape == "beam" or self.near_m == 0),
            ),
        ):
            if not holds:
                hint = radians_hint(value or 0.0) if name in ("fov", "fov_up") else ""
                raise ValueError(f"Sensor: {name}: found {value}, allowed: {allowed}{hint}")

    def __repr__(self) -> str:
        up = "" if self.fov_up is None else f", fov_up={self.fov_up:.6g}, zones={self.zones}"
        use = "" if self.use is None else f", use={self.use!r}"
        shape = "" if self.shape == "beam" else f", shape={self.shape!r}"
        shape += "" if self.thickness is None else f", thickness={self.thickness:g}"
        shape += f", near_m={self.near_m:g}" if self.near_m else ""
        return f"Sensor(fov={self.fov:.6g}, range_m={self.range_m:.4g}{up}{shape}{use})"

    @property
    def square(self) -> bool:
        """Whether the beam is a pyramid."""
        return self.fov_up is not None

    @property
    def special(self) -> bool:
        """Whether the beam is more than a cone or pyramid from the apex on."""
        return self.shape != "beam" or self.near_m > 0

    @property
    def plain(self) -> bool:
        """Whether the beam is a cone from the apex on."""
        return not self.square and not self.special

    @property
    def oriented(self) -> bool:
        """Whether the beam has an ``up``: that of a pyramid or fan has, a round one has not."""
        return self.square or self.shape == "fan"

    @property
    def zoned(self) -> bool:
        """Whether an occluder in a part of the beam leaves the others as they are: each zone of a
        pyramid reports its own distance, a fan measures in each direction, and a dome is no
        distance measurement."""
        return (self.square and self.zones > 1) or self.shape != "beam"

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
        """Half angle of the beam's inscribed cone, rad: the smaller one of a pyramid's or fan's."""
        if self.thickness is not None:
            return min(math.atan(self.thickness / 2 / self.range_m), self.fov / 2)
        return self.half_angle if self.fov_up is None else min(self.fov, self.fov_up) / 2

    @property
    def circumscribed_half_angle(self) -> float:
        """Half angle of the circumscribed cone, rad; it passes through a pyramid's corners.

        That of a dome or fan is limited: no cone holds a half ball.
        """
        if self.shape != "beam":
            return min(self.half_angle, 1.4)
        return math.atan(math.hypot(math.tan(self.half_angle), math.tan(self.half_angle_up)))

    def with_angles(self, change: Callable[[float], float]) -> "Sensor":
        """Return the sensor with ``change`` applied to each of its full angles, rad."""
        up = None if self.fov_up is None else change(self.fov_up)
        return replace(self, fov=change(self.fov), fov_up=up)

    @property
    def farthest(self) -> float:
        """Distance from the apex to the farthest point of the beam, m."""
        if self.shape != "beam":
            return math.hypot(self.range_m, (self.thickness or 0.0) / 2)
        return self.range_m / math.cos(self.circumscribed_half_angle)

    @property
    def volume(self) -> float:
        """Volume of the beam, m^3; 0.1737 for the paper's sensor."""
        if self.shape == "dome":
            return 2 * math.pi / 3 * self.range_m**3 * (1 - math.cos(self.half_angle))
        if self.thickness is not None:
            return self.half_angle * self.range_m**2 * self.thickness
        long = self.range_m**3 - self.near_m**3
        wide, high = math.tan(self.half_angle), math.tan(self.half_angle_up)
        if self.square:
            return 4 / 3 * long * wide * high
        return math.pi / 3 * long * wide**2


PAPER_SENSOR = Sensor()
