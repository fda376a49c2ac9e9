"""Model of a sensor: its beam, or a model with its operating conditions."""

import math
from dataclasses import replace
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from ...coverage.sensors.catalogue import MODELS
from ...coverage.sensors.effective_range import effective
from ...coverage.sensors.sensor import Sensor, Use
from ..errors import IN_LINE, NAMED
from .base_model import Fault, refuse
from .board_models import BoardModel
from .field_types import Metres
from .mapping import DEGREES, MappedModel, Of
from .own_sensor_models import OwnSensorModel

_USES = ("ambient", "reflectance", "target_size")
_SAME = 1e-6  # degrees and metres
# The catalogue may become more precise; a file keeps a beam that it states and that is as near to
# the catalogue's as this: degrees of an angle, and a share of a range.
_CLOSE_ANGLE, _CLOSE_RANGE = 0.2, 0.02


SensorKey = Annotated[
    Annotated[str, Field(max_length=100), Tag(NAMED)] | Annotated[OwnSensorModel, Tag(IN_LINE)],
    Discriminator(lambda found: IN_LINE if isinstance(found, dict | OwnSensorModel) else NAMED),
]


class SensorModel(MappedModel[Sensor]):
    """A sensor, stated by its beam or by a model with its operating conditions. The model is one
    of the catalogue or the user's own.

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
    model: SensorKey | None = Field(
        default=None,
        description="model in the catalogue, a sensor file (.toml), or a sensor's table in-line",
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
        """Model with its operating conditions; None without a model."""
        if self.model is None:
            return None
        size = None if self.target_size is None else (self.target_size[0], self.target_size[1])
        own = None if isinstance(self.model, str) else self.model.to_domain()
        name = self.model if isinstance(self.model, str) else self.model.name
        return Use(name, self.ambient, self.reflectance, size, own)

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
        if use.own is None and use.model not in MODELS:
            refuse([(("model",), use.model, f"{', '.join(MODELS)}, or a sensor file (.toml)")])
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
            and abs((getattr(self, key) or 0.0) - value) > _close(key, value)
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
        stated = self.model_fields_set
        if "fov_deg" in stated and abs(self.fov_deg - math.degrees(sensor.fov)) > _SAME:
            sensor = replace(sensor, fov=math.radians(self.fov_deg))
        if "range_m" in stated and abs(self.range_m - sensor.range_m) > _SAME:
            sensor = replace(sensor, range_m=self.range_m)
        up = self.fov_up_deg if sensor.fov_up is not None else None
        if up is not None and abs(up - math.degrees(sensor.fov_up or 0.0)) > _SAME:
            sensor = replace(sensor, fov_up=math.radians(up))
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
            model = use.model if use.own is None else OwnSensorModel.from_domain(use.own)
            stated = {"model": model, "ambient": use.ambient} | {
                "reflectance": use.reflectance,
                "target_size": size,
            }
        if value.board == known:
            stated["board"] = None
        if value.fov_up is None:
            stated["zones"] = 1
        return super().from_domain(value, **stated, **given)


def _close(key: str, value: float) -> float:
    """Return by how much a stated value may differ from the catalogue's."""
    if key == "range_m":
        return _CLOSE_RANGE * value
    return _CLOSE_ANGLE if "fov" in key else _SAME
