"""The models of rings, and of the rows that list their sensors."""

import math
from typing import Annotated

from pydantic import Field

from ...coverage.rings.ring import RING_RADIUS, Ring, Setup
from ...coverage.rings.rounding import DIGITS_POSITION, phase_deg, tilt_deg
from ...coverage.sensors.sensor import Sensor
from .base_model import StrictModel
from .field_types import Metres, Position, Tilt
from .mapping import MappedModel, Of, Unit, decimals
from .sensor_models import SensorModel

_TILT = Of("tilt", Unit(math.radians, tilt_deg))
_PHASE = Of("phase", Unit(math.radians, phase_deg))


class RingModel(MappedModel[Ring]):
    link: Annotated[str, Field(max_length=100)]
    position: Annotated[Position, Of(unit=decimals(DIGITS_POSITION))] = 0.0
    count: int = Field(ge=1, le=1000, description="sensors")
    tilt_deg: Annotated[Tilt, _TILT] = 0.0
    phase_deg: Annotated[float, _PHASE] = Field(default=0.0, ge=-360, le=360, description="degrees")
    radius: Metres | None = Field(default=None, description="metres; the scene's, if none is given")
    sensor: SensorModel | None = Field(default=None, description="the scene's, if none is given")


def setup_of(rings: list[RingModel], sensor: Sensor, radius: float = RING_RADIUS) -> Setup:
    """The setup that a proposal's rings make; a ring that names no sensor or radius has the
    scene's.
    """
    return Setup(
        tuple(
            ring.to_domain(
                radius=radius if ring.radius is None else ring.radius,
                sensor=ring.sensor.to_domain() if ring.sensor else sensor,
            )
            for ring in rings
        )
    )


def ring_models(setup: Setup, sensor: Sensor) -> list[RingModel]:
    """The rings of a setup as a proposal lists them, rounded as files are; ``sensor`` is the
    scene's.
    """
    return [
        RingModel.from_domain(ring)
        if ring.sensor != sensor
        else RingModel.from_domain(ring, sensor=None)
        for ring in setup.rings
    ]


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
