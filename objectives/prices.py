"""Prices of rings and sensors, and what a setup costs."""

import math
from collections.abc import Collection
from dataclasses import field
from difflib import get_close_matches
from typing import Annotated

from pydantic import Field

from ..coverage.definitions.definition import definition, refuse
from ..coverage.definitions.units import Decimals
from ..coverage.rings.ring import Ring, Setup
from ..coverage.sensors.catalogue import MODELS
from ..coverage.sensors.sensor import Sensor

_LIKE = 0.65  # likeness of two names, above which one is a slip of the other
_Price = Annotated[float, Field(ge=0, le=1e9)]


@definition
class SetupPrice:
    """What a setup costs; fixed rings and sensors exist and cost nothing."""

    total: Annotated[float, Decimals(6)]
    """Price of all new rings with their sensors."""
    rings: Annotated[float, Decimals(6)]
    """Part of it for the rings without their sensors."""
    sensors: Annotated[float, Decimals(6)]
    """Part of it for the sensors."""
    currency: str = ""
    """Currency of the scene's prices."""


@definition
class Prices:
    """Prices of a ring and of a sensor, in any currency."""

    ring: _Price = 0.0
    """Price of a ring without its sensors: clamp, cable, mounting."""
    sensor: _Price = 0.0
    """Price of a sensor with its board."""
    currency: Annotated[str, Field(max_length=20)] = ""
    """Name or sign of the currency, for texts."""
    models: dict[str, _Price] = field(default_factory=dict)
    """Prices by the name of a model, of the catalogue or of a sensor file, in place of
    ``sensor``."""

    def __post_init__(self) -> None:
        """Refuse names that are nearly those of catalogue models; any other may be that of a sensor
        file."""
        near = {name: get_close_matches(name, MODELS, 3, _LIKE) for name in self.models}
        refuse(
            (("models", name), name, f"{' or '.join(names)}, or the name in a sensor file")
            for name, names in near.items()
            if names and name not in MODELS
        )

    def of_sensor(self, sensor: Sensor) -> float:
        """Return the price of one sensor."""
        model = "" if sensor.use is None else sensor.use.name
        return self.models.get(model, self.sensor)

    def of_ring(self, ring: Ring) -> float:
        """Return the price of a ring with its sensors."""
        return self.ring + ring.count * self.of_sensor(ring.sensor)

    def of_setup(self, setup: Setup, fixed: Collection[object]) -> "SetupPrice":
        """Return the price of the rings and single sensors that are not ``fixed``."""
        new = [ring for ring in setup.rings if ring not in fixed]
        singles = (one.sensor for one in setup.singles if one not in fixed)
        total = sum(map(self.of_ring, new)) + math.fsum(map(self.of_sensor, singles))
        rings = len(new) * self.ring
        return SetupPrice(total, rings, total - rings, self.currency)

    def text(self, amount: float) -> str:
        """Return an amount as text, such as ``1,160 EUR``; fractions have two digits."""
        number = f"{amount:,.2f}".removesuffix(".00")
        return f"{number} {self.currency}".rstrip()
