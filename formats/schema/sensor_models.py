"""The models of a sensor and of the board that carries it."""

import math
from dataclasses import replace
from typing import Annotated, Any, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from ...coverage.sensors.boards import Board
from ...coverage.sensors.catalogue import MODELS
from ...coverage.sensors.effective_range import effective
from ...coverage.sensors.sensor import Sensor, Use
from .base_model import refuse
from .field_types import Metres
from .mapping import DEGREES, MappedModel, Of

_USES = ("ambient", "reflectance", "target_size")
_SAME = 1e-6  # degrees and metres, by which a stated beam may be off that of the catalogue


_Small = Annotated[float, Field(gt=0, le=0.2, description="metres")]
_OnBoard = Annotated[
    list[Annotated[float, Field(ge=-0.1, le=0.1, description="metres, from the middle")]],
    Field(min_length=2, max_length=2),
]


class BoardModel(MappedModel[Board]):
    """The board that carries a sensor, seen from the front: x to the right, y up, from its
    middle.
    """

    width: _Small
    height: _Small
    thickness: _Small = 0.0016
    lens: _OnBoard = Field(default=[0.0, 0.0], description="the sensor's middle")
    lens_height: float = Field(
        default=0.001, ge=0, le=0.1, description="metres, of the sensor's front above the board"
    )
    holes: list[_OnBoard] = Field(default=[], max_length=16, description="of screws")
    hole: _Small = Field(default=0.0025, description="metres, diameter of the holes")
    source: str = Field(default="", max_length=1000)

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
    """A beam; or a model of the catalogue and what it is used for, from which the beam follows. A
    file may state both, as those that are written do, if they agree. A square beam that neither is
    of a model nor says how many zones it has is taken as of one: then no more is claimed than is
    seen."""

    fov_deg: Annotated[float, Of("fov", DEGREES)] = Field(
        default=25.0, gt=0, lt=180, description="degrees, the full angle"
    )
    range_m: Metres = 1.5
    fov_up_deg: Annotated[float | None, Of("fov_up", DEGREES)] = Field(
        default=None,
        gt=0,
        lt=180,
        description="degrees, of a square beam along its ring's axis; none: a round beam",
    )
    zones: int = Field(
        default=1,
        ge=1,
        le=1000,
        description="in a row of a square beam, each seeing by itself; 1: blinded as a whole",
    )
    model: Annotated[str, Field(max_length=100)] | None = Field(
        default=None, description="of the catalogue"
    )
    ambient: Annotated[str, Field(max_length=100)] | None = Field(
        default=None, description="light, like 50kcps or 5klx"
    )
    reflectance: float | None = Field(
        default=None, gt=0, le=1, description="of the target, a share"
    )
    target_size: Annotated[list[Metres], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="width and height of the target, metres"
    )
    board: BoardModel | None = Field(
        default=None, description="that carries it; the catalogue's, if it has one"
    )

    @property
    def use(self) -> Use | None:
        """What the model is used for; None without one."""
        if self.model is None:
            return None
        size = None if self.target_size is None else (self.target_size[0], self.target_size[1])
        return Use(self.model, self.ambient, self.reflectance, size)

    @model_validator(mode="after")
    def _of_the_catalogue(self) -> Self:
        use, given = self.use, self.model_fields_set
        if use is None:
            refuse(
                ((key,), getattr(self, key), "only beside a model")
                for key in _USES
                if getattr(self, key) is not None
            )
            if self.zones > 1 and self.fov_up_deg is None:
                refuse(
                    [(("zones",), self.zones, "1 for a round beam; more only beside fov_up_deg")]
                )
            return self
        if use.model not in MODELS:
            refuse([(("model",), use.model, ", ".join(MODELS))])
        try:
            found = effective(use).sensor
        except ValueError as error:
            raise PydanticCustomError("rule", "{error}", {"error": str(error)}) from error
        up = None if found.fov_up is None else math.degrees(found.fov_up)
        beam = {
            "fov_deg": math.degrees(found.fov),
            "range_m": found.range_m,
            "fov_up_deg": up,
            "zones": found.zones,
        }
        refuse(
            ((key,), getattr(self, key), f"{value:.9g}, as {use.model} has it here, or no such key")
            for key, value in beam.items()
            if key in given
            and value is not None
            and abs((getattr(self, key) or 0.0) - value) > _SAME
        )
        refuse(
            ((key,), getattr(self, key), f"no such key, as the beam of {use.model} is round")
            for key, value in beam.items()
            if value is None and getattr(self, key) is not None
        )
        return self

    def to_domain(self, **given: Any) -> Sensor:
        """Return the sensor: of the catalogue by its use, or by its beam."""
        if self.use is None:
            return super().to_domain(**given)
        sensor = effective(self.use).sensor
        return sensor if self.board is None else replace(sensor, board=self.board.to_domain())

    @classmethod
    def from_domain(cls, value: Sensor, **given: Any) -> Self:
        """Return the table of a sensor: of the catalogue both the use and the beam that follows."""
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
