"""The models of what is mounted: sensors, where rings may sit and how, and the rings themselves."""

import math
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from ...coverage.sensors.catalogue import MODELS
from ...coverage.sensors.effective_range import effective
from ...coverage.sensors.sensor import Use
from ...objectives.scene import Mounting
from .base_model import StrictModel, refuse
from .field_types import Interval, Metres, Position, Tilt, ascending

_USES = ("ambient", "reflectance", "target_size")
_SAME = 1e-6  # degrees and metres, by which a stated beam may be off that of the catalogue


_Small = Annotated[float, Field(gt=0, le=0.2, description="metres")]
_OnBoard = Annotated[
    list[Annotated[float, Field(ge=-0.1, le=0.1, description="metres, from the middle")]],
    Field(min_length=2, max_length=2),
]


class BoardModel(StrictModel):
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


class PrintingModel(StrictModel):
    """How rings are printed."""

    wall: float = Field(
        default=0.003, ge=0.0008, le=0.05, description="metres, least thickness of what carries"
    )
    clearance: float = Field(
        default=0.0003, ge=0, le=0.005, description="metres, of a board in its pocket, all around"
    )
    slack: float = Field(default=0.0005, ge=0, le=0.02, description="metres, between ring and link")
    relief: float = Field(
        default=0.002, ge=0, le=0.05, description="metres, free depth behind a board"
    )
    bolt: Literal["M3", "M4", "M5"] = Field(
        default="M3", description="of the bolts that close a ring"
    )
    nut: Literal["trap", "through"] = Field(
        default="trap", description="a hexagonal trap for each nut, or a through hole"
    )
    gap: float = Field(
        default=0.001,
        ge=0,
        le=0.01,
        description="metres, between the halves before the bolts are drawn",
    )
    channel: float = Field(
        default=0.004, ge=0, le=0.02, description="metres, width and depth of the groove for cables"
    )
    least_wall: float = Field(
        default=0.0012, ge=0.0002, le=0.01, description="metres, thinnest that may be measured"
    )
    overhang: float = Field(
        default=0.05, ge=0, le=1, description="largest share of the surface that may hang over"
    )

    @model_validator(mode="after")
    def _walls_hold(self) -> Self:
        if self.wall < 2 * self.least_wall:
            refuse(
                [
                    (
                        ("wall",),
                        self.wall,
                        f"{2 * self.least_wall:g} and more, as half of it is left at a split",
                    )
                ]
            )
        return self


class SensorModel(StrictModel):
    """A beam; or a model of the catalogue and what it is used for, from which the beam follows. A
    file may state both, as those that are written do, if they agree. A square beam that neither is
    of a model nor says how many zones it has is taken as of one: then no more is claimed than is
    seen."""

    fov_deg: float = Field(default=25.0, gt=0, lt=180, description="degrees, the full angle")
    range_m: Metres = 1.5
    fov_up_deg: float | None = Field(
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


class MountModel(StrictModel):
    position: Interval = [0.0, 1.0]
    tilt_deg: Annotated[
        list[Tilt], Field(min_length=2, max_length=2), AfterValidator(ascending)
    ] = [-70.0, 70.0]
    keep_out: list[Interval] = Field(
        default=[], max_length=100, description="intervals without rings"
    )
    sensor: SensorModel | None = Field(default=None, description="the scene's, if none is given")
    ring_radius: Metres | None = Field(
        default=None, description="metres; the scene's, if none is given"
    )


class RulesModel(StrictModel):
    """What makes a setup buildable."""

    spacing: float = Field(
        default=0.03, ge=0, le=10, description="metres, between two rings on a link"
    )
    from_joints: float = Field(default=0.0, ge=0, le=10, description="metres, from a link's ends")
    sensors_per_ring: Annotated[
        list[Annotated[int, Field(ge=1, le=1000)]],
        Field(min_length=2, max_length=2, description="least and most"),
        AfterValidator(ascending),
    ] = [3, 24]
    rings_per_link: int = Field(default=8, ge=1, le=200, description="rings, at most")
    shared_tilt: bool = Field(default=False, description="all rings have one tilt, up to its sign")
    mount: Mounting | None = Field(
        default=None,
        description=(
            "real: rings have bodies; free: none; real unless occlusion is ignore, if none is given"
        ),
    )
    standoff: float = Field(
        default=0.012, ge=0, le=1, description="metres, from what a ring surrounds to its sensors"
    )
    ring_thickness: float = Field(
        default=0.01, ge=0, le=1, description="metres, of a ring's body across the axis"
    )
    ring_width: float = Field(
        default=0.02, ge=0, le=1, description="metres, of a ring's body along the axis"
    )

    @model_validator(mode="after")
    def _of_one_body(self) -> Self:
        if self.ring_width < self.ring_thickness:
            refuse(
                [
                    (
                        ("ring_width",),
                        self.ring_width,
                        f"{self.ring_thickness:g} and more, the ring_thickness",
                    )
                ]
            )
        if self.standoff < self.ring_thickness / 2:
            refuse(
                [
                    (
                        ("standoff",),
                        self.standoff,
                        f"{self.ring_thickness / 2:g} and more, half the ring_thickness",
                    )
                ]
            )
        return self


class RingModel(StrictModel):
    link: Annotated[str, Field(max_length=100)]
    position: Position = 0.0
    count: int = Field(ge=1, le=1000, description="sensors")
    tilt_deg: Tilt = 0.0
    phase_deg: float = Field(default=0.0, ge=-360, le=360, description="degrees")
    radius: Metres | None = Field(default=None, description="metres; the scene's, if none is given")
    sensor: SensorModel | None = Field(default=None, description="the scene's, if none is given")


_Index = Annotated[int, Field(ge=0, le=999, description="counted from 0")]
_Place = Annotated[float, Field(ge=-100, le=100, description="metres, base frame")]
_Part = Annotated[
    float, Field(ge=-1.001, le=1.001, description="part of a unit vector, base frame")
]


class ConeRow(StrictModel):
    """A row of ``place-rings cones``: a sensor at a pose, base frame."""

    pose: int = Field(ge=0, lt=10_000, description="counted from 0")
    ring: _Index
    sensor: _Index
    apex_x: _Place
    apex_y: _Place
    apex_z: _Place
    axis_x: _Part
    axis_y: _Part
    axis_z: _Part
    fov_deg: float = Field(gt=0, lt=180, description="degrees, the full angle")
    range_m: Metres


class SquareConeRow(ConeRow):
    """A row where some sensors have square beams: with the full angle along ``up``, 0 of a cone,
    and ``up`` itself.
    """

    fov_up_deg: float = Field(
        ge=0, lt=180, description="degrees, the full angle along up; 0: a cone"
    )
    up_x: _Part
    up_y: _Part
    up_z: _Part
