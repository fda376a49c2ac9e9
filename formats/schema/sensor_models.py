"""Models of a sensor and of the board that carries it."""

import math
from dataclasses import replace
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from ...coverage.sensors.boards import Board
from ...coverage.sensors.catalogue import MODELS
from ...coverage.sensors.effective_range import effective
from ...coverage.sensors.sensor import Sensor, Use
from .base_model import Fault, refuse
from .field_types import Metres
from .mapping import DEGREES, MappedModel, Of

_USES = ("ambient", "reflectance", "target_size")
_SAME = 1e-6  # degrees and metres, largest difference between a stated beam and the catalogue's


_Small = Annotated[float, Field(gt=0, le=0.2, description="length, m")]
_OnBoard = Annotated[
    list[Annotated[float, Field(ge=-0.1, le=0.1, description="coordinate from the middle, m")]],
    Field(min_length=2, max_length=2),
]


class BoardModel(MappedModel[Board]):
    """The board that carries a sensor, seen from the front; x points right, y up, from its
    middle."""

    width: _Small = Field(description="width of the board, m")
    height: _Small = Field(description="height of the board, m")
    thickness: _Small = Field(default=0.0016, description="thickness of the board, m")
    lens: _OnBoard = Field(default=[0.0, 0.0], description="position of the sensor's lens, m")
    lens_height: float = Field(
        default=0.001, ge=0, le=0.1, description="height of the sensor's front above the board, m"
    )
    holes: list[_OnBoard] = Field(
        default=[], max_length=16, description="positions of the screw holes, m"
    )
    hole: _Small = Field(default=0.0025, description="diameter of the holes, m")
    plugs: Annotated[
        list[Annotated[float, Field(ge=0, le=0.1, description="room beyond an edge, m")]],
        Field(min_length=2, max_length=2),
    ] = Field(
        default=[0.0, 0.0],
        description="room for plugs beyond the edges left and right, and above and below, m",
    )
    plug_height: float = Field(
        default=0.003, ge=0, le=0.1, description="height of plugs above the board's front, m"
    )
    source: str = Field(default="", max_length=1000, description="source of the figures")

    @model_validator(mode="after")
    def _within_its_outline(self) -> Self:
        half = (self.width / 2, self.height / 2)
        spots = {("lens",): (self.lens, 0.0)} | {
            ("holes", i): (at, self.hole / 2) for i, at in enumerate(self.holes)
        }
        refuse(
            (loc, str(at), f"within the outline of {self.width:g} by {self.height:g} m")
            for loc, (at, r) in spots.items()
            if any(abs(x) + r > h for x, h in zip(at, half, strict=True))
        )
        return self


class SensorModel(MappedModel[Sensor]):
    """A sensor, stated by its beam or by a catalogue model with its operating conditions.

    The conditions determine the beam. A file may state both if they agree; files that place-rings
    writes do. A square beam with neither a model nor a number of zones counts as one zone, so that
    coverage is not overstated.
    """

    fov_deg: Annotated[float, Of("fov", DEGREES)] = Field(
        default=25.0,
        gt=0,
        le=360,
        description=(
            "full field of view, degrees: below 180, of a dome up to 180, of a fan up to 360"
        ),
    )
    range_m: Metres = Field(default=1.5, description="range, m")
    fov_up_deg: Annotated[float | None, Of("fov_up", DEGREES)] = Field(
        default=None,
        gt=0,
        lt=180,
        description=(
            "full field of view along the ring's axis, degrees, for a square beam; omit "
            "for a round beam"
        ),
    )
    zones: int = Field(
        default=1,
        ge=1,
        le=1000,
        description=(
            "zones in a row of a square beam, each with its own reading; 1: one reading "
            "for the whole beam"
        ),
    )
    model: Annotated[str, Field(max_length=100)] | None = Field(
        default=None, description="model in the catalogue"
    )
    ambient: Annotated[str, Field(max_length=100)] | None = Field(
        default=None, description="ambient light, for example 50kcps or 5klx"
    )
    reflectance: float | None = Field(
        default=None, gt=0, le=1, description="reflectance of the target, as a share"
    )
    target_size: Annotated[list[Metres], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="width and height of the target, m"
    )
    shape: Literal["beam", "dome", "fan"] = Field(
        default="beam",
        description=(
            "beam: a cone or pyramid; dome: a cone that ends in a ball about its apex, as of a"
            " capacitive pad; fan: a sector across up, as of a laser scanner"
        ),
    )
    thickness: Metres | None = Field(default=None, description="thickness of a fan, m")
    near_m: float = Field(
        default=0.0,
        ge=0,
        le=100,
        description="distance along the axis at which a cone or pyramid begins, m",
    )
    board: BoardModel | None = Field(
        default=None,
        description="board that carries the sensor; default: the catalogue's, if it has one",
    )

    @property
    def use(self) -> Use | None:
        """Operating conditions of the catalogue model; None without a model."""
        if self.model is None:
            return None
        size = None if self.target_size is None else (self.target_size[0], self.target_size[1])
        return Use(self.model, self.ambient, self.reflectance, size)

    @model_validator(mode="after")
    def _of_its_shape(self) -> Self:
        fan, plain = self.shape == "fan", self.shape == "beam"
        most = {"beam": "below 180", "dome": "at most 180", "fan": "at most 360"}[self.shape]
        wide = self.fov_deg >= 180 if plain else self.fov_deg > (360 if fan else 180)
        faults: list[Fault] = []
        if wide:
            allowed = f"a number above 0 and {most} (full field of view, degrees)"
            faults.append((("fov_deg",), self.fov_deg, allowed))
        if not plain and self.fov_up_deg is not None:
            faults.append((("fov_up_deg",), self.fov_up_deg, f"no such key for a {self.shape}"))
        if fan != (self.thickness is not None):
            allowed = "the thickness of the fan, m" if fan else "no such key, except for a fan"
            faults.append((("thickness",), self.thickness, allowed))
        if self.near_m >= self.range_m or (self.near_m > 0 and not plain):
            allowed = "below range_m" if plain else f"no such key for a {self.shape}"
            faults.append((("near_m",), self.near_m, allowed))
        if not plain and self.model is not None:
            faults.append((("shape",), self.shape, "beam, the shape of all catalogue models"))
        refuse(faults)
        return self

    @model_validator(mode="after")
    def _of_the_catalogue(self) -> Self:
        use, given = self.use, self.model_fields_set
        if use is None:
            refuse(
                ((key,), getattr(self, key), "only together with a model")
                for key in _USES
                if getattr(self, key) is not None
            )
            if self.zones > 1 and self.fov_up_deg is None:
                refuse([(("zones",), self.zones, "1 for a round beam; more only with fov_up_deg")])
            return self
        if use.model not in MODELS:
            refuse([(("model",), use.model, ", ".join(MODELS))])
        try:
            sensor = effective(use).sensor
        except ValueError as error:
            raise PydanticCustomError("rule", "{error}", {"error": str(error)}) from error
        up = None if sensor.fov_up is None else math.degrees(sensor.fov_up)
        beam = {
            "fov_deg": math.degrees(sensor.fov),
            "range_m": sensor.range_m,
            "fov_up_deg": up,
            "zones": sensor.zones,
        }
        refuse(
            (
                (key,),
                getattr(self, key),
                f"{value:.9g}, the value of {use.model} here, or omit the key",
            )
            for key, value in beam.items()
            if key in given
            and value is not None
            and abs((getattr(self, key) or 0.0) - value) > _SAME
        )
        refuse(
            ((key,), getattr(self, key), f"no such key, because the beam of {use.model} is round")
            for key, value in beam.items()
            if value is None and getattr(self, key) is not None
        )
        return self

    def to_domain(self, **given: Any) -> Sensor:
        """Return the sensor, from the catalogue or by its beam."""
        if self.use is None:
            return super().to_domain(**given)
        sensor = effective(self.use).sensor
        return sensor if self.board is None else replace(sensor, board=self.board.to_domain())

    @classmethod
    def from_domain(cls, value: Sensor, **given: Any) -> Self:
        """Return the table of a sensor; for a catalogue sensor, both its conditions and the
        resulting beam."""
        use, known = value.use, None
        stated: dict[str, Any] = dict.fromkeys(("model", *_USES))
        if use is not None:
            known = effective(use).sensor.board
            size = None if use.size is None else list(use.size)
            stated = {"model": use.model, "ambient": use.ambient} | {
                "reflectance": use.reflectance,
                "target_size": size,
            }
        if value.board == known:
            stated["board"] = None
        if value.fov_up is None:
            stated["zones"] = 1
        return super().from_domain(value, **stated, **given)
