"""Tasks of the study of optimality gaps."""

import time
from collections.abc import Mapping
from typing import Any

from ...objectives.criterion import Criterion
from ...placement.bound.upper_bound import upper_bound
from ...placement.space.design import Space
from ..engine.registry import register
from ..engine.scenes import scene_from


@register("upper bound")
def bound(scene: Mapping[str, object], sensors: int, seen: int = 1) -> dict[str, Any]:
    """Return the upper bound of any rings with this number of sensors, in percent, with its two
    parts for the scene's first target at its first pose, and its processor time in seconds."""
    where, began = scene_from(scene), time.process_time()
    found = upper_bound(where, Space(where, sensors=sensors), Criterion(seen))
    if found is None:
        raise ValueError("no bound is known")
    first = found.terms[0]
    return {
        "bound_percent": round(100 * found.value, 3),
        "volume_percent": round(100 * first.by_volume, 3),
        "prices_percent": round(100 * first.by_prices, 3),
        "seconds": round(time.process_time() - began, 1),
    }
