"""Models of prices: what rings and sensors cost, and what a setup costs."""

from difflib import get_close_matches
from typing import Annotated, Self

from pydantic import Field, model_validator

from ...coverage.rings.ring import Setup
from ...coverage.sensors.catalogue import MODELS
from ...objectives.prices import Prices
from ...objectives.scene import CoreScene
from .base_model import StrictModel, refuse
from .mapping import MappedModel

_LIKE = 0.65  # likeness of two names, above which one is a slip of the other
_Price = Annotated[float, Field(ge=0, le=1e9, description="price")]


class PricesModel(MappedModel[Prices]):
    """Prices of a ring and of a sensor, in any currency."""

    ring: _Price = Field(default=0.0, description="price of a ring without its sensors")
    sensor: _Price = Field(default=0.0, description="price of a sensor with its board")
    models: dict[str, _Price] = Field(
        default={},
        description="prices by model, of the catalogue or of a sensor file, in place of sensor",
    )
    currency: Annotated[str, Field(max_length=20)] = Field(
        default="", description="currency, for texts"
    )

    @model_validator(mode="after")
    def _no_slips(self) -> Self:
        """Refuse names that are nearly those of catalogue models; any other name may be that of a
        sensor file."""
        near = {name: get_close_matches(name, MODELS, 3, _LIKE) for name in self.models}
        refuse(
            (("models", name), name, f"{' or '.join(each)}, or the name in a sensor file")
            for name, each in near.items()
            if each and name not in MODELS
        )
        return self


class PriceModel(StrictModel):
    """What a setup costs; fixed rings exist and cost nothing."""

    total: float = Field(description="price of all new rings with their sensors")
    rings: float = Field(description="part of it for the rings without their sensors")
    sensors: float = Field(description="part of it for the sensors")
    currency: str = Field(default="", description="currency of the scene's prices")

    @classmethod
    def of(cls, scene: CoreScene, setup: Setup) -> Self | None:
        """Return the price of a setup; None for a scene without prices."""
        total = scene.price_of(setup)
        if scene.prices is None or total is None:
            return None
        new = sum(ring not in scene.rules.fixed for ring in setup.rings)
        rings = new * scene.prices.ring
        return cls(
            total=round(total, 6),
            rings=round(rings, 6),
            sensors=round(total - rings, 6),
            currency=scene.prices.currency,
        )
