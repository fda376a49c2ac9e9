"""Tasks that search a setup by layout or number of sensors, completely or within a time limit."""

import math
import time
from collections.abc import Mapping, Sequence
from typing import Any

from ...formats.schema.ring_models import ring_models
from ...objectives.criterion import Criterion
from ...objectives.named_layouts import ring_layout
from ...placement.search.global_stage import usual
from ...placement.search.progress import Outcome
from ...placement.search.search import search as searching
from ...placement.space.design import Space
from .registry import register
from .scenes import Rings, scene_from, setup_from

_COUNTING = 0.2  # share of a search's time reserved for the exact count of its finalists


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
    """Return the rings of a searched setup, as in a proposal, and how the search ended; see
    ``place``.
    """
    asked = scene_from(scene)
    space = Space(
        asked, None if sensors else ring_layout(asked, rings_per_link, sensors_per_ring), sensors
    )
    setups = [setup_from(rings, asked) for rings in known]
    schedule = usual(asked, space, Criterion(), known=True) if short else None
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
    """Search a setup and return its rings as in a proposal.

    The search uses a layout (``rings_per_link``, ``sensors_per_ring``), or any rings if ``sensors``
    is given. It also starts from the ``known`` setups, with a ``short`` schedule if these are good.

    Raises:
        KeyboardInterrupt: also if Ctrl-C left a partial result, which a study must not store.
    """
    return _searched(scene, seed, **asked)[0]


@register("place in time")
def place_in_time(
    scene: Mapping[str, Any], seed: int, sensors: int, seconds: float
) -> dict[str, Any]:
    """Search within a limit of processor seconds, which other jobs of the machine do not consume.

    The exchange stops early enough to count the finalists exactly.

    Returns:
        The rings, the processor and wall seconds, and whether the search completed.

    Raises:
        KeyboardInterrupt: see ``place``.
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
