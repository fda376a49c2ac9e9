"""Figures that manufacturers state for a sensor: beam, ranges by light and target, power."""

import math
from dataclasses import dataclass

from . import boards


@dataclass(frozen=True)
class Light:
    """Ambient light as a source states it."""

    label: str
    """The level as text."""
    value: float
    """The level in the sensor's unit, or a step of a named scale; larger values reduce range."""


DARK = Light("dark", 0.0)


@dataclass(frozen=True)
class Figure:
    """A range stated for one light level and one target that fills the beam."""

    light: Light
    """Ambient light."""
    reflectance: float
    """Reflectance of the target."""
    range_m: float
    """Range, m."""


@dataclass(frozen=True)
class Model:
    """A sensor of the catalogue. No source states a price for any of them."""

    name: str
    """Name in files and options."""
    title: str
    """Name in text."""
    side_deg: float
    """Full angle of a round beam, or of both sides of a square beam, degrees."""
    square: bool
    """Whether the beam is square."""
    zones: int
    """Zones in a row of a square beam; each ranges separately."""
    figures: tuple[Figure, ...]
    """Stated ranges, darkest light first and, within a light, brightest target first."""
    unit: str
    """Unit of ambient light; empty if light levels have names."""
    least_m: float | None
    """Stated minimum range, m; None if no source states it."""
    rate_hz: float | None
    """Maximum rate, Hz."""
    source: str
    """Source of the figures."""
    note: str = ""
    """How the source was interpreted."""
    board: boards.Board | None = None
    """A common board that carries the sensor; None if no source was available."""

    @property
    def zone_deg(self) -> tuple[float, float]:
        """Full angles of the beam, or of one of its zones if it has several, degrees."""
        return self.side_deg / self.zones, self.side_deg / self.zones

    @property
    def lights(self) -> tuple[Light, ...]:
        """Light levels with a stated range, the darkest first."""
        return tuple(sorted({f.light for f in self.figures}, key=lambda light: light.value))


def side_of_diagonal(diagonal_deg: float) -> float:
    """Return the side, degrees, of the square beam with a diagonal of ``diagonal_deg``.

    That beam lies inside the cone of the diagonal.
    """
    return math.degrees(2 * math.atan(math.tan(math.radians(diagonal_deg) / 2) / math.sqrt(2)))


@dataclass(frozen=True)
class Supply:
    """Electrical power of one sensor in operation."""

    power_w: float
    """Power, W."""
    limit: bool
    """Whether the source states it as a limit; otherwise as typical."""
    source: str
    """Source of the figure."""
