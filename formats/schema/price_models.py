"""Model of the price of a setup."""

from typing import Self

from pydantic import Field

from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from .base_model import StrictModel


class PriceModel(StrictModel):
    """What a setup costs; fixed rings exist and cost nothing."""

    total: float = Field(description="price of all new rings with their sensors")
    rings: float = Field(description="part of it for the rings without their sensors")
    sensors: float = Field(description="part of it for the sensors")
    currency: str = Field(default="", description="currency of the scene's prices")

    @classmethod
    def of(cls, scene: Scene, setup: Setup) -> Self | None:
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
