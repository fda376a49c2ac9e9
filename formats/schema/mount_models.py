"""The models of where rings may sit and how they are made."""

from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from ...coverage.sensors.board_packing import Printing
from ...objectives.scene import Limits, Mounting, Rules
from .base_model import refuse
from .field_types import Interval, Metres, Tilt, ascending
from .mapping import DEGREES, MappedModel, Of, Unit
from .sensor_models import SensorModel

_BOLT = Unit(lambda name: int(name[1:]) / 1000, lambda diameter: f"M{1000 * diameter:.0f}")
_NUT = Unit(lambda name: name == "trap", lambda trapped: "trap" if trapped else "through")


class PrintingModel(MappedModel[Printing]):
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
    bolt: Annotated[Literal["M3", "M4", "M5"], Of(unit=_BOLT)] = Field(
        default="M3", description="of the bolts that close a ring"
    )
    nut: Annotated[Literal["trap", "through"], Of(unit=_NUT)] = Field(
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


class MountModel(MappedModel[Limits]):
    position: Interval = [0.0, 1.0]
    tilt_deg: Annotated[
        list[Tilt],
        Field(min_length=2, max_length=2),
        AfterValidator(ascending),
        Of("tilt", DEGREES),
    ] = [-70.0, 70.0]
    keep_out: list[Interval] = Field(
        default=[], max_length=100, description="intervals without rings"
    )
    sensor: SensorModel | None = Field(default=None, description="the scene's, if none is given")
    ring_radius: Annotated[Metres | None, Of("radius")] = Field(
        default=None, description="metres; the scene's, if none is given"
    )


class RulesModel(MappedModel[Rules]):
    """What makes a setup buildable."""

    spacing: float = Field(
        default=0.03, ge=0, le=10, description="metres, between two rings on a link"
    )
    from_joints: float = Field(default=0.0, ge=0, le=10, description="metres, from a link's ends")
    sensors_per_ring: Annotated[
        list[Annotated[int, Field(ge=1, le=1000)]],
        Field(min_length=2, max_length=2, description="least and most"),
        AfterValidator(ascending),
        Of("sensors"),
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

    def to_domain(self, **given: Any) -> Rules:
        """Return the rules; ``fixed``: rings that stay."""
        return super().to_domain(band=(self.ring_thickness, self.ring_width), **given)

    @classmethod
    def from_domain(cls, value: Rules, **given: Any) -> Self:
        """Return the table of the rules."""
        thickness, width = value.band
        return super().from_domain(value, ring_thickness=thickness, ring_width=width, **given)
