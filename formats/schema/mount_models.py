"""Models of mounting limits, rules, and printing."""

from collections.abc import Iterable, Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from ...coverage.sensors.board_packing import Printing
from ...coverage.sensors.lids import lid_fault
from ...objectives.mount_rules import Limits, Mounting, Rules
from .base_model import Fault, refuse
from .field_types import Interval, RingRadius, Tilt, ascending
from .mapping import DEGREES, MappedModel, Of, Unit, rounded_millimetres
from .sensor_models import SensorModel

_BOLT = Unit(lambda name: int(name[1:]) / 1000, lambda diameter: f"M{1000 * diameter:.0f}")
_FORMER = "rings_per_link"  # a command's option of that name sets a number, not a maximum
_MILLIMETRES = rounded_millimetres(6)
_NUT = Unit(lambda name: name == "trap", lambda trapped: "trap" if trapped else "through")


class PrintingModel(MappedModel[Printing]):
    """Parameters of printed rings."""

    wall: float = Field(
        default=0.003, ge=0.0008, le=0.05, description="least thickness of load-bearing walls, m"
    )
    clearance: float = Field(
        default=0.0003,
        ge=0,
        le=0.005,
        description="clearance of a board in its pocket on every side, m",
    )
    slack: float = Field(
        default=0.0005, ge=0, le=0.02, description="clearance between ring and link, m"
    )
    relief: float = Field(default=0.002, ge=0, le=0.05, description="free depth behind a board, m")
    bolt: Annotated[Literal["M3", "M4", "M5"], Of(unit=_BOLT)] = Field(
        default="M3", description="size of the bolts that close a ring"
    )
    nut: Annotated[Literal["trap", "through"], Of(unit=_NUT)] = Field(
        default="trap", description="hexagonal trap for each nut, or a through hole"
    )
    fastening: Literal["nut", "insert"] = Field(
        default="nut", description="what the bolts are screwed into: nuts, or heat-set inserts"
    )
    gap: float = Field(
        default=0.001,
        ge=0,
        le=0.01,
        description="gap between the halves before the bolts are tightened, m",
    )
    channel: float = Field(
        default=0.004, ge=0, le=0.02, description="width and depth of the cable groove, m"
    )
    least_wall: float = Field(
        default=0.0012,
        ge=0.0002,
        le=0.01,
        description="smallest acceptable measured wall thickness, m",
    )
    overhang: float = Field(
        default=0.05, ge=0, le=1, description="largest acceptable overhanging share of the surface"
    )
    bed_mm: Annotated[
        list[Annotated[float, Field(ge=20, le=5000)]] | None,
        Field(min_length=3, max_length=3),
        Of("bed", _MILLIMETRES),
    ] = Field(
        default=None,
        description="width, depth and height that the printer can print, mm; default: parts of any"
        " size, on plates of 250 × 210 mm",
    )
    lettering: bool = Field(
        default=True,
        description="whether each part is engraved with its number, its link and an arrow to the"
        " wrist",
    )
    ties: bool = Field(
        default=True,
        description="whether each part has a bridge to which a cable tie holds the cables",
    )
    cover: bool = Field(
        default=False,
        description="whether each board has a lid, which its screws hold; left out where false",
    )

    @model_serializer(mode="wrap")
    def _without_absent_cover(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {key: v for key, v in write(self).items() if key != "cover" or v}

    @model_validator(mode="after")
    def _walls_hold(self) -> Self:
        if self.wall < 2 * self.least_wall:
            refuse(
                [
                    (
                        ("wall",),
                        self.wall,
                        f"at least {2 * self.least_wall:g}, because half of it remains at a split",
                    )
                ]
            )
        return self

    def faults(self, sensors: Iterable[SensorModel]) -> Iterator[Fault]:
        """Yield the first of a scene's sensors whose board is known and has no room for a lid."""
        for sensor in (model.to_domain() for model in sensors if self.cover):
            terms = (sensor, self.clearance, self.least_wall)
            if sensor.board is not None and (why := lid_fault(sensor.board, *terms)):
                yield ("printing", "cover"), True, f"false, because {why}"
                return


class MountModel(MappedModel[Limits]):
    """Limits of rings on one link."""

    position: Interval = Field(
        default=[0.0, 1.0], description="interval of allowed positions, from 0 proximal to 1 distal"
    )
    tilt_deg: Annotated[
        list[Tilt],
        Field(min_length=2, max_length=2),
        AfterValidator(ascending),
        Of("tilt", DEGREES),
    ] = Field(default=[-70.0, 70.0], description="lowest and highest tilt, degrees")
    keep_out: list[Interval] = Field(
        default=[],
        max_length=100,
        description="intervals without rings, from 0 proximal to 1 distal",
    )
    sensor: SensorModel | None = Field(
        default=None, description="sensor on this link; default: the scene's"
    )
    ring_radius: Annotated[RingRadius | None, Of("radius")] = Field(
        default=None, description="radius of rings on this link, m; default: the scene's"
    )


class RulesModel(MappedModel[Rules]):
    """Rules that make a setup buildable."""

    @model_validator(mode="before")
    @classmethod
    def _renamed(cls, keys: Any) -> Any:
        """Read the former name of ``max_rings_per_link``."""
        if isinstance(keys, dict) and _FORMER in keys and "max_rings_per_link" not in keys:
            keys = {k: v for k, v in keys.items() if k != _FORMER} | {
                "max_rings_per_link": keys[_FORMER]
            }
        return keys

    spacing: float = Field(
        default=0.03, ge=0, le=10, description="least distance between two rings on a link, m"
    )
    from_joints: float = Field(
        default=0.0, ge=0, le=10, description="least distance from a link's ends, m"
    )
    sensors_per_ring: Annotated[
        list[Annotated[int, Field(ge=1, le=1000)]],
        Field(min_length=2, max_length=2, description="fewest and most sensors of a ring"),
        AfterValidator(ascending),
        Of("sensors"),
    ] = [3, 24]
    max_rings_per_link: int = Field(
        default=8, ge=1, le=200, description="largest number of rings on a link"
    )
    shared_tilt: bool = Field(
        default=False,
        description="whether all rings but fixed ones have the same tilt, up to its sign",
    )
    mount: Mounting = Field(
        default="real",
        description=(
            "real: rings have bodies and must be mountable; free: they need not be, as in the"
            " paper; default without bodies of the robot: free"
        ),
    )
    standoff: float = Field(
        default=0.012,
        ge=0,
        le=1,
        description="distance from the surface that a ring surrounds to its sensors, m",
    )
    clearance: float = Field(
        default=0.002,
        ge=0,
        le=1,
        description=(
            "least distance of a ring's envelope from obstacles, other rings, and bodies except"
            " the tube that it grips, m"
        ),
    )
