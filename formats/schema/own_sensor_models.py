"""Model of a sensor file: a user's own sensor with the fields of the catalogue."""

from collections.abc import Callable, Iterator
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from ...coverage.sensors.catalogue import MODELS
from ...coverage.sensors.sensor_model import (
    DARK,
    LEVEL,
    Corners,
    Figure,
    Light,
    Model,
    Price,
    Supply,
    diagonal_of_sides,
)
from .base_model import Fault, StrictModel, refuse
from .board_models import BoardModel
from .field_types import Metres
from .mapping import MappedModel
from .versions import VersionedFile

_AGREE_DEG = 1.0  # a stated diagonal may differ from that of the stated sides by rounding
_Angle = Annotated[float, Field(gt=0, lt=180)]
_Zones = Annotated[int, Field(ge=1, le=1000)]
_Text = Annotated[str, Field(max_length=1000)]


class RangeModel(StrictModel):
    """A range for one light level and one target that fills the beam."""

    ambient: Annotated[str, Field(max_length=100)] = Field(
        default=DARK.label,
        description="ambient light: dark, a number with its unit such as 5klx, or a name",
    )
    reflectance: float = Field(
        default=0.88, gt=0, le=1, description="reflectance of the target, as a share"
    )
    range_m: Metres = Field(description="range, m")


class SupplyModel(MappedModel[Supply]):
    """Electrical power of one sensor."""

    power_w: float = Field(gt=0, le=1000, description="power, W")
    limit: bool = Field(default=False, description="whether the power is a limit; else typical")
    source: _Text = Field(description="source of the power")


class PriceOfferModel(MappedModel[Price]):
    """Price of one sensor, with its source and date."""

    amount: float = Field(ge=0, le=1e9, description="price of one sensor")
    currency: Annotated[str, Field(max_length=20)] = Field(description="currency")
    date: Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$")] = Field(
        description="day of the offer, as 2026-11-22"
    )
    source: _Text = Field(description="who offers it")


class OwnSensorModel(MappedModel[Model]):
    """A sensor in one mode: beam, ranges by light and target, and further figures.

    A round beam states ``fov_deg``. A square one states its sides ``fov_deg`` and ``fov_up_deg``,
    or its ``diagonal_deg``, or all three if they agree.
    """

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_.-]*$", max_length=100)] = Field(
        description="short name, in lower case; none of the catalogue's"
    )
    title: Annotated[str, Field(max_length=100)] = Field(
        default="", description="full name; default: the short one"
    )
    fov_deg: _Angle | None = Field(
        default=None,
        description="full field of view, degrees; of a square beam, along the ring",
    )
    fov_up_deg: _Angle | None = Field(
        default=None,
        description="full field of view of a square beam along the ring's axis, degrees",
    )
    diagonal_deg: _Angle | None = Field(
        default=None,
        description="full field of view of a square beam across its corners, degrees",
    )
    corners: Corners = Field(
        default="tangents",
        description=(
            "how a diagonal follows from the sides: tangents for a planar pyramid, sines for"
            " the figures of ST (AN5894)"
        ),
    )
    zones: _Zones = Field(default=1, description="zones in a row of a square beam")
    zones_up: _Zones | None = Field(
        default=None, description="rows of zones; default: as many as zones in a row"
    )
    ranges: list[RangeModel] = Field(
        min_length=1, max_length=100, description="ranges by light and target"
    )
    least_m: Metres | None = Field(default=None, description="least measurable distance, m")
    rate_hz: Annotated[float, Field(gt=0, le=1e6)] | None = Field(
        default=None, description="highest rate of readings, Hz"
    )
    targets: Annotated[int, Field(ge=1, le=100)] | None = Field(
        default=None, description="most targets that a zone reports, one behind the other"
    )
    separation_m: Metres | None = Field(
        default=None, description="least distance between two such targets, m"
    )
    histogram: bool | None = Field(
        default=None, description="whether the raw histogram of returns can be read"
    )
    safety: _Text = Field(default="", description="safety rating")
    life_cycle: _Text = Field(default="", description="whether the sensor is still made")
    source: _Text = Field(min_length=1, description="source of the figures")
    note: _Text = Field(default="", description="how the source was interpreted")
    board: BoardModel | None = Field(default=None, description="board that carries the sensor")
    supply: SupplyModel | None = Field(default=None, description="electrical power")
    price: PriceOfferModel | None = Field(default=None, description="price")

    @model_validator(mode="after")
    def _agreeing(self) -> Self:
        refuse(self._beam_faults())
        refuse(self._range_faults())
        if self.name in MODELS:
            refuse([(("name",), self.name, "a name that the catalogue lacks")])
        if self.separation_m is not None and self.targets in (None, 1):
            refuse([(("separation_m",), self.separation_m, "only with targets, 2 or more")])
        return self

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
            yield from self._corner_faults(along, up, diagonal)
        if up is None and diagonal is None:
            for key in ("zones", "zones_up"):
                if (getattr(self, key) or 1) > 1:
                    yield (key,), getattr(self, key), "1 for a round beam; more with fov_up_deg"

    def _corner_faults(self, along: float, up: float, diagonal: float) -> Iterator[Fault]:
        by = {rule: diagonal_of_sides(along, up, rule) for rule in ("tangents", "sines")}
        if abs(by[self.corners] - diagonal) > _AGREE_DEG:
            values = " or ".join(f"{value:.1f} (corners = {rule})" for rule, value in by.items())
            yield ("diagonal_deg",), diagonal, f"{values} for sides of {along:g} and {up:g}"

    def _range_faults(self) -> Iterator[Fault]:
        """Yield light levels in mixed notations, ranges stated twice, and ranges that grow with
        light or as the target gets darker."""
        units = {m[2] if (m := LEVEL.fullmatch(a)) else "" for a in self._levels}
        if len(units) > 1:
            levels = ", ".join(self._levels)
            yield ("ranges",), levels, "light in one unit, as 5klx, or by names only"
            return
        figures = self._figures()
        none = [i for i, f in enumerate(figures) if f.light != DARK and f.light.value == 0]
        if none:
            yield ("ranges", none[0], "ambient"), figures[none[0]].light.label, "dark for no light"
            return
        for i, one in enumerate(figures):
            if any(_key(f) == _key(one) for f in figures[:i]):
                yield ("ranges", i), one.light.label, "one range for each light and reflectance"
            bounds = [f for f in figures if _bounds(f, one, figures) and f.range_m < one.range_m]
            if bounds:
                least = min(bounds, key=lambda f: f.range_m)
                yield (
                    ("ranges", i, "range_m"),
                    one.range_m,
                    f"at most {least.range_m:g}, the range for {100 * least.reflectance:.3g} % in"
                    f" {least.light.label}",
                )
        longest = max(one.range_m for one in figures)
        if self.least_m is not None and self.least_m >= longest:
            yield ("least_m",), self.least_m, f"below the longest range, {longest:g}"

    @property
    def _levels(self) -> list[str]:
        """Light levels other than dark, each once, in the order of the file."""
        return list(dict.fromkeys(r.ambient for r in self.ranges if r.ambient != DARK.label))

    def _figures(self) -> tuple[Figure, ...]:
        """Return the ranges; named light levels grow stronger in the order of the file."""
        values = {DARK.label: DARK.value}
        for i, level in enumerate(self._levels):
            match = LEVEL.fullmatch(level)
            values[level] = float(match[1]) if match else i + 1.0
        return tuple(
            Figure(Light(r.ambient, values[r.ambient]), r.reflectance, r.range_m)
            for r in self.ranges
        )

    def to_domain(self, **given: Any) -> Model:
        """Return the sensor's model."""
        return super().to_domain(
            title=self.title or self.name,
            figures=self._figures(),
            **given,
        )

    @classmethod
    def from_domain(cls, value: Model, **given: Any) -> Self:
        """Return the table of a sensor's model."""
        ranges = [
            RangeModel(ambient=f.light.label, reflectance=f.reflectance, range_m=f.range_m)
            for f in value.figures
        ]
        return super().from_domain(value, ranges=ranges, **given)


def _key(figure: Figure) -> tuple[float, float]:
    return figure.light.value, figure.reflectance


def _bounds(f: Figure, one: Figure, figures: tuple[Figure, ...]) -> bool:
    """Return whether the range of ``f`` bounds that of ``one``: the light is no stronger and the
    target no darker, or both are the brightest targets in their light."""

    def brightest(x: Figure) -> bool:
        return all(x.reflectance >= y.reflectance for y in figures if y.light == x.light)

    return f.light.value <= one.light.value and (
        f.reflectance >= one.reflectance or (brightest(f) and brightest(one))
    )


class OwnSensorFile(OwnSensorModel, VersionedFile):
    """A user's own sensor (TOML): the fields of the catalogue, for one mode of the sensor."""


def with_tables(
    keys: dict[str, Any], read: Callable[[str, str], OwnSensorModel], at: str = ""
) -> dict[str, Any]:
    """Return the keys of a file with the tables of sensors in place of the files that it names.

    Args:
        keys: keys of the file, as TOML has them.
        read: returns the sensor of a key and the name of a file.
        at: key of the table ``keys`` in the file.
    """

    def inlined(name: str, value: Any) -> Any:
        key = f"{at}.{name}".lstrip(".")
        match value:
            case {"model": str() as file} if name == "sensor" and file.lower().endswith(".toml"):
                return {**value, "model": read(f"{key}.model", file)}
            case dict():
                return with_tables(value, read, key)
            case list():
                return [
                    with_tables(v, read, f"{key}[{i}]") if isinstance(v, dict) else v
                    for i, v in enumerate(value)
                ]
        return value

    return {name: inlined(name, value) for name, value in keys.items()}
