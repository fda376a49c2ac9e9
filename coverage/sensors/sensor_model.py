"""Figures that a manufacturer or a user states for a sensor: beam, ranges by light and target,
readings, power."""

import math
import re
from collections.abc import Iterator
from functools import cached_property
from typing import Annotated, Literal

from pydantic import Field

from ..definitions.definition import Fault, definition, refuse
from ..definitions.field_types import Items, Metres, Text
from .boards import Board

Corners = Literal["tangents", "sines"]
"""How the diagonal D of a square beam follows from its sides H and V: ``tangents`` for the planar
pyramid, tan²(D/2) = tan²(H/2) + tan²(V/2); ``sines`` by ST's definition (AN5894, section 2.3),
sin²(D/2) = sin²(H/2) + sin²(V/2)."""
BelowLeast = Literal["nothing", "wrong", "reported"]
"""What a sensor does with a target nearer than its least distance: it reports nothing, a distance
that is wrong, or the target with a status that says so."""
DARK = "dark"
_LEVEL = re.compile(r"(\d+(?:\.\d+)?)([a-z]+)")  # of light, in a unit
_AGREE_DEG = 1.0  # a stated diagonal may differ from that of the stated sides by rounding
_Angle = Annotated[float, Field(gt=0, lt=180)]
_Zones = Annotated[int, Field(ge=1, le=1000)]
_Line = Annotated[str, Field(max_length=1000)]


@definition(kw_only=True)
class Range:
    """A range for one light level and one target that fills the beam."""

    ambient: Text = DARK
    """Ambient light: dark, a number with its unit such as 5klx, or a name."""
    reflectance: Annotated[float, Field(gt=0, le=1)] = 0.88
    """Reflectance of the target, as a share."""
    range_m: Metres
    """Range, m."""


@definition(kw_only=True)
class Supply:
    """Electrical power of one sensor in operation."""

    power_w: Annotated[float, Field(gt=0, le=1000)]
    """Power, W."""
    limit: bool = False
    """Whether the power is a limit; else typical."""
    source: _Line
    """Source of the power."""


@definition
class Price:
    """What one sensor costs, with the place and the day of the offer."""

    amount: Annotated[float, Field(ge=0, le=1e9)]
    """Price of one sensor."""
    currency: Annotated[str, Field(max_length=20)]
    """Currency."""
    date: Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$")]
    """Day of the offer, as 2026-11-22."""
    source: _Line
    """Who offers it."""


@definition(kw_only=True)
class Model:
    """A sensor in one mode, with figures from its sources: beam, ranges by light and target, and
    further figures; None where no source states one.

    A round beam states ``fov_deg``. A square one states its sides ``fov_deg`` and ``fov_up_deg``,
    or its ``diagonal_deg``, or all three if they agree. The beam that is counted is the planar
    pyramid of those sides. By either rule for corners it lies within the stated beam.
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_.-]*$", max_length=100)]
    """Short name, in lower case; in a file none of the catalogue's."""
    title: Text = ""
    """Full name; default: the short one."""
    fov_deg: _Angle | None = None
    """Full field of view, degrees; of a square beam, along the ring."""
    fov_up_deg: _Angle | None = None
    """Full field of view of a square beam along the ring's axis, degrees."""
    diagonal_deg: _Angle | None = None
    """Full field of view of a square beam across its corners, degrees."""
    corners: Corners = "tangents"
    """How a diagonal follows from the sides: tangents for a planar pyramid, sines for the figures
    of ST (AN5894)."""
    zones: _Zones = 1
    """Zones in a row of a square beam; each ranges separately."""
    zones_up: _Zones | None = None
    """Rows of zones; default: as many as zones in a row."""
    ranges: Annotated[Items[Range], Field(min_length=1, max_length=100)]
    """Ranges by light and target; named levels of light grow stronger in the order of the file."""
    least_m: Metres | None = None
    """Least measurable distance, m."""
    rate_hz: Annotated[float, Field(gt=0, le=1e6)] | None = None
    """Highest rate of readings, Hz."""
    detection_rate: Annotated[float, Field(gt=0, lt=1)] | None = None
    """Share of frames that report a target at the stated ranges."""
    below_least: BelowLeast | None = None
    """What happens nearer than the least distance: nothing is reported, a wrong distance, or the
    target with a status."""
    crosstalk: Annotated[float, Field(ge=0, le=1)] | None = None
    """Light that a cover glass throws back, as a share of the light from a target at the stated
    range that fills the beam."""
    detection_source: _Line = ""
    """Source of the three figures above."""
    targets: Annotated[int, Field(ge=1, le=100)] | None = None
    """Most targets that a zone reports, one behind the other."""
    separation_m: Metres | None = None
    """Least distance between two such targets, m."""
    histogram: bool | None = None
    """Whether the raw histogram of returns can be read."""
    wavelength_nm: Annotated[float, Field(ge=200, le=20_000)] | None = None
    """Wavelength of the emitted light, nm."""
    immune: bool = False
    """Whether it ranges undisturbed by the light of other sensors, as by a code of its own."""
    safety: _Line = ""
    """Safety rating."""
    life_cycle: _Line = ""
    """Whether the sensor is still made."""
    source: Annotated[str, Field(min_length=1, max_length=1000)]
    """Source of the figures."""
    note: _Line = ""
    """How the source was interpreted."""
    board: Board | None = None
    """Board that carries the sensor."""
    supply: Supply | None = None
    """Electrical power."""
    price: Price | None = None
    """Price."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "title", self.title or self.name)
        refuse(self._beam_faults())
        refuse(self._range_faults())
        if self.separation_m is not None and self.targets in (None, 1):
            refuse([(("separation_m",), self.separation_m, "only with targets, 2 or more")])
        stated = (self.detection_rate, self.below_least, self.crosstalk)
        if any(figure is not None for figure in stated) and not self.detection_source:
            text = "the source of detection_rate, below_least and crosstalk"
            refuse([(("detection_source",), self.detection_source, text)])

    def _beam_faults(self) -> Iterator[Fault]:
        """Yield angles that are missing, or that contradict each other."""
        along, up, diagonal = self.fov_deg, self.fov_up_deg, self.diagonal_deg
        if along is None and up is not None:
            yield ("fov_deg",), None, "the angle along the ring, because fov_up_deg is stated"
        elif along is None and diagonal is None:
            yield ("fov_deg",), None, "the full angle, degrees, or diagonal_deg of a square beam"
        elif along is not None and up is None and diagonal is not None:
            yield (
                ("fov_up_deg",),
                None,
                "the angle along the ring's axis; a square beam states both sides or its diagonal"
                " alone",
            )
        elif along is not None and up is not None and diagonal is not None:
            by = {rule: diagonal_of_sides(along, up, rule) for rule in ("tangents", "sines")}
            if abs(by[self.corners] - diagonal) > _AGREE_DEG:
                values = " or ".join(f"{v:.1f} (corners = {rule})" for rule, v in by.items())
                yield ("diagonal_deg",), diagonal, f"{values} for sides of {along:g} and {up:g}"
        if not self.square:
            for key in ("zones", "zones_up"):
                if (getattr(self, key) or 1) > 1:
                    yield (key,), getattr(self, key), "1 for a round beam; more with fov_up_deg"

    def _range_faults(self) -> Iterator[Fault]:
        """Yield light levels in mixed notations, ranges stated twice, and ranges that grow with
        light or as the target gets darker."""
        ranges, levels = self.ranges, [level for level in self.levels if level != DARK]
        if len({m[2] if (m := _LEVEL.fullmatch(level)) else "" for level in levels}) > 1:
            yield (
                ("ranges",),
                ", ".join(dict.fromkeys(r.ambient for r in ranges if r.ambient != DARK)),
                "light in one unit, as 5klx, or by names only",
            )
            return
        for i, r in enumerate(ranges):
            if r.ambient != DARK and self.levels[r.ambient] == 0:
                yield ("ranges", i, "ambient"), r.ambient, "dark for no light"
                return
        for i, r in enumerate(ranges):
            if any(self._level(r) == self._level(f) for f in ranges[:i]):
                yield ("ranges", i), r.ambient, "one range for each light and reflectance"
            bounds = [f for f in ranges if f.range_m < r.range_m and self._bounds(f, r)]
            if bounds:
                least = min(bounds, key=lambda f: f.range_m)
                yield (
                    ("ranges", i, "range_m"),
                    r.range_m,
                    f"at most {least.range_m:g}, the range for {100 * least.reflectance:.3g} % in"
                    f" {least.ambient}",
                )
        longest = max(r.range_m for r in ranges)
        if self.least_m is not None and self.least_m >= longest:
            yield ("least_m",), self.least_m, f"below the longest range, {longest:g}"

    def _level(self, r: Range) -> tuple[float, float]:
        return self.levels[r.ambient], r.reflectance

    def _bounds(self, f: Range, r: Range) -> bool:
        """Return whether the range of ``f`` bounds that of ``r``: the light is no stronger and the
        target no darker, or both are the brightest targets in their light."""
        brightest = [self.brightest(self.levels[x.ambient]).reflectance for x in (f, r)]
        return self.levels[f.ambient] <= self.levels[r.ambient] and (
            f.reflectance >= r.reflectance or brightest == [f.reflectance, r.reflectance]
        )

    @cached_property
    def levels(self) -> dict[str, float]:
        """Levels of light with a stated range, the weakest first: as text, and in the sensor's
        unit, or the place of a named one in the order of the ranges; 0 for dark."""
        named = dict.fromkeys(r.ambient for r in self.ranges if r.ambient != DARK)
        values = {
            level: float(m[1]) if (m := _LEVEL.fullmatch(level)) else i + 1.0
            for i, level in enumerate(named)
        }
        if any(r.ambient == DARK for r in self.ranges):
            values[DARK] = 0.0
        return dict(sorted(values.items(), key=lambda item: item[1]))

    def brightest(self, level: float) -> Range:
        """Return the range for the brightest target at a level of light."""
        here = (r for r in self.ranges if self.levels[r.ambient] == level)
        return max(here, key=lambda r: r.reflectance)

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
        side = side_of_diagonal(self.diagonal_deg or 0.0, self.corners)
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
    def unit(self) -> str:
        """Unit of ambient light; empty if light levels have names, or dark is the only one."""
        match = _LEVEL.fullmatch([*self.levels][-1])
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
