"""Prices of rings and sensors, and what a setup costs."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from ..coverage.rings.ring import Ring
from ..coverage.sensors.sensor import Sensor


@dataclass(frozen=True)
class Prices:
    """What one ring and one sensor cost. The unit is any currency.

    Raises:
        ValueError: for a negative price.
    """

    ring: float = 0.0
    """Price of a ring without its sensors: clamp, cable, mounting."""
    sensor: float = 0.0
    """Price of a sensor with its board."""
    currency: str = ""
    """Name or sign of the currency, for texts."""
    models: dict[str, float] = field(default_factory=dict)
    """Prices by the name of a model, of the catalogue or the user's own, in place of
    ``sensor``."""

    def __post_init__(self) -> None:
        for name, price in {"ring": self.ring, "sensor": self.sensor, **self.models}.items():
            if not 0 <= price < float("inf"):
                raise ValueError(f"price of {name}: found {price}, allowed: 0 or more")

    def of_sensor(self, sensor: Sensor) -> float:
        """Return the price of one sensor."""
        model = "" if sensor.use is None else sensor.use.model
        return self.models.get(model, self.sensor)

    def of_ring(self, ring: Ring) -> float:
        """Return the price of a ring with its sensors."""
        return self.ring + ring.count * self.of_sensor(ring.sensor)

    def total(self, rings: Iterable[Ring]) -> float:
        """Return the price of rings with their sensors."""
        return sum(map(self.of_ring, rings))

    def text(self, amount: float) -> str:
        """Return an amount as text, such as ``1,160 EUR``; fractions have two digits."""
        number = f"{amount:,.2f}".removesuffix(".00")
        return f"{number} {self.currency}".rstrip()
