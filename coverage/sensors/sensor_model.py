"""Figures that a manufacturer or a user states for a sensor: beam, ranges by light and target,
readings, power."""

import math
import re
from dataclasses import dataclass
from typing import Literal

from . import boards

Corners = Literal["tangents", "sines"]
"""How the diagonal D of a square beam follows from its sides H and V: ``tangents`` for the planar
pyramid, tan²(D/2) = tan²(H/2) + tan²(V/2); ``sines`` by ST's definition (AN5894, section 2.3),
sin²(D/2) = sin²(H/2) + sin²(V/2)."""
LEVEL = re.compile(r"(\d+(?:\.\d+)?)([a-z]+)")
"""A light level in a unit: number and unit."""


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
class Supply:
    """Electrical power of one sensor in operation."""

    power_w: float
    """Power, W."""
    limit: bool
    """Whether the source states it as a limit; otherwise as typical."""
    source: str
    """Source of the figure."""


@dataclass(frozen=True)
class Price:
    """What one sensor costs, with the place and the day of the offer."""

    amount: float
    """Price of one sensor."""
    currency: str
    """Currency."""
    date: str
    """Day of the offer, as 2026-11-22."""
    source: str
    """Who offers it."""


@dataclass(frozen=True)
class Model:
    """A sensor in one of its modes, with figures from its sources; None where none states it.

    A square beam is stated by its sides, by its diagonal, or by both. The beam that is counted is
    the planar pyramid of those sides. By either rule for corners it lies within the stated beam.
    """

    name: str
    """Name in files and options."""
    title: str
    """Name in text."""
    figures: tuple[Figure, ...]
    """Stated ranges, darkest light first and, within a light, brightest target first."""
    source: str
    """Source of the figures."""
    fov_deg: float | None = None
    """Stated full angle of a round beam, or of a square one along the ring, degrees; None for a
    square beam that is stated by its diagonal."""
    fov_up_deg: float | None = None
    """Stated full angle of a square beam along the ring's axis, degrees; None for a round beam."""
    diagonal_deg: float | None = None
    """Stated full angle of a square beam across its corners, degrees."""
    corners: Corners = "tangents"
    """How the stated diagonal follows from the sides."""
    zones: int = 1
    """Zones in a row of a square beam; each ranges separately."""
    zones_up: int | None = None
    """Rows of zones; None: as many as zones in a row."""
    least_m: float | None = None
    """Minimum range, m."""
    rate_hz: float | None = None
    """Maximum rate, Hz."""
    targets: int | None = None
    """Maximum number of targets that a zone reports, one behind the other."""
    separation_m: float | None = None
    """Minimum distance between two such targets, m."""
    histogram: bool | None = None
    """Whether the raw histogram of returns can be read."""
    safety: str = ""
    """Safety rating; empty: none."""
    life_cycle: str = ""
    """Whether the manufacturer still makes it, as far as known."""
    note: str = ""
    """How the source was interpreted."""
    board: boards.Board | None = None
    """A common board that carries the sensor."""
    supply: Supply | None = None
    """Electrical power."""
    price: Price | None = None
    """Price."""

    @property
    def square(self) -> bool:
        """Whether the beam is a pyramid."""
        return self.fov_up_deg is not None or self.diagonal_deg is not None

    @property
    def sides_deg(self) -> tuple[float, float]:
        """Full angles along the ring and along its axis, degrees; equal for a round beam."""
        if self.fov_deg is not None:
            up = self.fov_deg if self.fov_up_deg is None else self.fov_up_deg
            return self.fov_deg, up
        if self.diagonal_deg is None:
            raise ValueError(f"{self.name}: a beam needs fov_deg or diagonal_deg")
        side = side_of_diagonal(self.diagonal_deg, self.corners)
        return side, side

    @property
    def rows(self) -> int:
        """Number of rows of zones."""
        return self.zones if self.zones_up is None else self.zones_up

    @property
    def zone_deg(self) -> tuple[float, float]:
        """Full angles of the beam, or of one of its zones if it has several, degrees."""
        along, up = self.sides_deg
        return along / self.zones, up / self.rows

    @property
    def lights(self) -> tuple[Light, ...]:
        """Light levels with a stated range, the darkest first."""
        return tuple(sorted({f.light for f in self.figures}, key=lambda light: light.value))

    @property
    def unit(self) -> str:
        """Unit of ambient light; empty if light levels have names, or dark is the only one."""
        match = LEVEL.fullmatch(self.lights[-1].label)
        return match[2] if match else ""

    @property
    def definition(self) -> str:
        """Which of the stated angles the beam is taken from, as text."""
        if not self.square:
            return "full angle of a cone"
        rule = "by ST's AN5894" if self.corners == "sines" else "of a planar pyramid"
        across = "" if self.diagonal_deg is None else f"{self.diagonal_deg:g}° across the corners"
        if self.fov_deg is None:
            return f"sides that give {across}, {rule}"
        return "sides as stated" + (across and f"; {across} agree, {rule}")


def diagonal_of_sides(along_deg: float, up_deg: float, corners: Corners = "tangents") -> float:
    """Return the diagonal, degrees, of a square beam with sides of ``along_deg`` and ``up_deg``."""
    trig, inverse = (math.sin, math.asin) if corners == "sines" else (math.tan, math.atan)
    across = math.hypot(*(trig(math.radians(side) / 2) for side in (along_deg, up_deg)))
    return math.degrees(2 * inverse(min(across, 1.0) if corners == "sines" else across))


def side_of_diagonal(diagonal_deg: float, corners: Corners = "tangents") -> float:
    """Return the side, degrees, of the square beam with a diagonal of ``diagonal_deg``.

    The planar pyramid of that side lies inside the cone of the diagonal.
    """
    trig, inverse = (math.sin, math.asin) if corners == "sines" else (math.tan, math.atan)
    return math.degrees(2 * inverse(trig(math.radians(diagonal_deg) / 2) / math.sqrt(2)))
