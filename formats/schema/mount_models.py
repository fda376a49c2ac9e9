"""Models of mounting limits and rules."""

from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    Field,
    model_validator,
)

from ...coverage.sensors.sensor import Sensor
from ...objectives.mount_rules import Limits, Mounting, Rules
from .field_types import Interval, RingRadius, Tilt, ascending
from .mapping import DEGREES, MappedModel, Of

_FORMER = "rings_per_link"  # a command's option of that name sets a number, not a maximum


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
    sensor: Sensor | None = Field(
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
