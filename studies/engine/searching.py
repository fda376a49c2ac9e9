"""The tasks that search: a setup by its layout or its sensors, to the end or for some time."""

import math
import time
from collections.abc import Mapping, Sequence
from typing import Any

from ...formats.schema.ring_models import ring_models
from ...objectives.criterion import Criterion
from ...placement.search.design import Space
from ...placement.search.layout import ring_layout
from ...placement.search.progress import Outcome
from ...placement.search.schedule import short as shorter
from ...placement.search.search import search as searching
from .scenes import Rings, scene_from, setup_from
from .tasks import register

_COUNTING = 0.2  # of a search's time, kept for the exact count of its finalists


def _searched(
    scene: Mapping[str, Any],
    seed: int,
    rings_per_link: int = 2,
    sensors_per_ring: int = 16,
    sensors: int | None = None,
    known: Sequence[Rings] = (),
    short: bool = False,
    processor_time: float = math.inf,
) -> tuple[Rings, Outcome]:
    """The rings of a searched setup, as a proposal lists them, and how the search ended: see
    ``place``.
    """
    asked = scene_from(scene)
    space = Space(
        asked, None if sensors else ring_layout(asked, rings_per_link, sensors_per_ring), sensors
    )
    setups = [setup_from(rings, asked) for rings in known]
    schedule = shorter(asked, space, Criterion()) if short else None
    found = searching(
        asked, space, seed, processor_time, schedule, known=setups, clock=time.process_time
    )
    if found.outcome is Outcome.INTERRUPTED:
        raise KeyboardInterrupt
    return [
        ring.model_dump(exclude_none=True) for ring in ring_models(found.setup, asked.sensor)
    ], found.outcome


@register("place")
def place(scene: Mapping[str, Any], seed: int, **asked: Any) -> Rings:
    """The rings of a searched setup, as a proposal lists them: of a layout (``rings_per_link``,
    ``sensors_per_ring``), or where ``sensors`` are given of any rings; from the ``known`` setups
    too, by a ``short`` schedule where these are good.

    Raises:
        KeyboardInterrupt: also where Ctrl-C left the best so far: a study must not keep that.
    """
    return _searched(scene, seed, **asked)[0]


@register("place in time")
def place_in_time(
    scene: Mapping[str, Any], seed: int, sensors: int, seconds: float
) -> dict[str, Any]:
    """The same within so many seconds of processors, all together, of which a machine's other jobs
    take nothing: the rings, the seconds taken, of processors and on the wall, and whether the
    search came to its end.

    The climbs are stopped while there is time left to count the finalists exactly. Raises
    KeyboardInterrupt like ``place``.
    """
    wall, processor = time.monotonic(), time.process_time()
    rings, outcome = _searched(
        scene, seed, sensors=sensors, processor_time=(1 - _COUNTING) * seconds
    )
    spent = {
        "processor_seconds": time.process_time() - processor,
        "wall_seconds": time.monotonic() - wall,
    }
    return {"rings": rings, "finished": outcome is Outcome.FINISHED, **spent}
