"""Lines about the price of a setup."""

from collections import Counter

from ...coverage.rings.ring import Setup
from ...objectives.scene import CoreScene
from ..text import counted


def price_line(scene: CoreScene, setup: Setup) -> str | None:
    """Return the price of a setup with its parts; None for a scene without prices."""
    prices, total = scene.prices, scene.price_of(setup)
    if prices is None or total is None:
        return None
    new = [ring for ring in setup.rings if ring not in scene.rules.fixed]
    parts = [f"{counted(len(new), 'ring')} at {prices.text(prices.ring)}"]
    sensors = Counter[float]()
    for ring in new:
        sensors[prices.of_sensor(ring.sensor)] += ring.count
    parts += [f"{counted(n, 'sensor')} at {prices.text(each)}" for each, n in sensors.items()]
    fixed = "; fixed rings cost nothing" if len(new) < len(setup.rings) else ""
    return f"Price: {prices.text(total)} ({', '.join(parts)}{fixed})."
