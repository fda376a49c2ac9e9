"""Models of rings, and of the rows in a list of their sensors."""

import math
from typing import Annotated, Literal

from pydantic import Field

from ...coverage.definitions.field_types import Metres
from ...coverage.rings.ring import RING_RADIUS, SERIAL, Ring, Setup
from ...coverage.rings.rounding import DIGITS_POSITION, phase_deg, tilt_deg
from ...coverage.sensors.sensor import Sensor, Shape
from .base_model import StrictModel
from .field_types import Position, RingRadius, Tilt
from .mapping import MappedModel, Of, Unit, decimals

_TILT = Of("tilt", Unit(math.radians, tilt_deg))
_PHASE = Of("phase", Unit(math.radians, phase_deg))


class RingModel(MappedModel[Ring]):
    """A ring of sensors around a link."""

    link: Annotated[str, Field(max_length=100)] = Field(description="link that carries the ring")
    position: Annotated[Position, Of(unit=decimals(DIGITS_POSITION))] = Field(
        default=0.0, description="position along the link, from 0 proximal to 1 distal"
    )
    count: int = Field(ge=1, le=1000, description="number of sensors")
    tilt_deg: Annotated[Tilt, _TILT] = Field(
        default=0.0, description="tilt in degrees, positive towards the distal end"
    )
    phase_deg: Annotated[float, _PHASE] = Field(
        default=0.0, ge=-360, le=360, description="azimuth of the first sensor, degrees"
    )
    radius: RingRadius | None = Field(default=None, description="radius, m; default: the scene's")
    sensor: Sensor | None = Field(default=None, description="sensor; default: the scene's")
    serial: str | None = Field(
        default=None,
        pattern=f"^{SERIAL}$",
        description="serial number of the ring's board, 16 hexadecimal digits; default: unknown",
    )
    zone_turn_deg: Literal[0, 90, 180, 270] = Field(
        default=0,
        description="angle by which the sensors are turned about their axes on their boards,"
        " degrees, counter-clockwise as seen along the axis; of sensors with zones",
    )
    zone_mirrored: bool = Field(
        default=False, description="whether the zones' columns are sent in the opposite order"
    )


def setup_of(rings: list[RingModel], sensor: Sensor, radius: float = RING_RADIUS) -> Setup:
    """Return the setup of a proposal's rings; a ring without sensor or radius takes the scene's."""
    return Setup(
        tuple(
            ring.to_domain(
                radius=radius if ring.radius is None else ring.radius,
                sensor=ring.sensor or sensor,
            )
            for ring in rings
        )
    )


def ring_models(setup: Setup, sensor: Sensor) -> list[RingModel]:
    """Return the rings of a setup as a proposal lists them, rounded as in files; ``sensor`` is the
    scene's."""
    return [
        RingModel.from_domain(ring)
        if ring.sensor != sensor
        else RingModel.from_domain(ring, sensor=None)
        for ring in setup.rings
    ]


_Index = Annotated[int, Field(ge=0, le=999, description="number, counted from 0")]
_Place = Annotated[float, Field(ge=-100, le=100, description="coordinate in the base frame, m")]
_Part = Annotated[
    float, Field(ge=-1.001, le=1.001, description="unit vector component in the base frame")
]


class ConeRow(StrictModel):
    """A row of ``place-rings cones``: one sensor at one pose, in the base frame."""

    pose: int = Field(ge=0, lt=10_000, description="number of the pose, counted from 0")
    ring: _Index
    sensor: _Index
    apex_x: _Place
    apex_y: _Place
    apex_z: _Place
    axis_x: _Part
    axis_y: _Part
    axis_z: _Part
    fov_deg: float = Field(gt=0, lt=180, description="full field of view, degrees")
    range_m: Metres = Field(description="range, m")


class SquareConeRow(ConeRow):
    """A row in a file with square beams: also the full angle along ``up``, 0 for a round beam, and
    ``up`` itself."""

    fov_up_deg: float = Field(
        ge=0, lt=180, description="full field of view along up, degrees; 0: a round beam"
    )
    up_x: _Part
    up_y: _Part
    up_z: _Part


class SpecialConeRow(SquareConeRow):
    """A row in a file with other shapes or with beams that begin at a distance: also the shape, its
    thickness (0 where it states none), and that distance."""

    fov_deg: float = Field(gt=0, le=360, description="full field of view, degrees")
    shape: Shape = Field(description="shape of the beam")
    thickness_m: float = Field(
        ge=0, le=100, description="thickness of a fan, or of a frustum's aperture, m; 0: none"
    )
    near_m: float = Field(
        ge=0, le=100, description="distance along the axis at which a cone or pyramid begins, m"
    )
