"""Tasks that count and search: ζ of a setup, its sensors that are almost fully blocked, and a
setup by layout or number of sensors, searched completely or within a time limit."""

import json
import math
import time
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

from ...coverage.choices import Rule
from ...coverage.targets.target import Target
from ...objectives.criterion import Criterion
from ...objectives.named_layouts import ring_layout
from ...objectives.occlusion import unseeing
from ...objectives.verify import Verifier
from ...placement.search.context import SearchContext
from ...placement.search.options import SearchOptions
from ...placement.search.progress import Outcome
from ...placement.search.schedule import usual
from ...placement.search.search import search as searching
from ...placement.space.design import Space
from ...placement.stop_token import StopToken
from .runner import register
from .scenes import Rings, Sensors, asked_from, ring_keys, scene_from, setup_from
from .store import Cell

_COUNTING = 0.2  # share of a search's time reserved for the exact count of its finalists


def zeta_cell(
    scene: Mapping[str, Any],
    setup: str | Rings | Sensors,
    target: Target,
    rule: str = "centre",
    voxel: float | None = 0.01,
    **width: float,
) -> Cell:
    """Return the cell that counts ζ of a setup for one target; see ``zeta``."""
    name, radius = target.key
    where = {"scene": scene, "setup": setup, "target": name, "radius": radius}
    return Cell("zeta", where | {"rule": rule, "voxel": voxel} | width)


@lru_cache(maxsize=2)
def _verifier(scene: str, rule: Rule, voxel: float | None, width: float) -> Verifier:
    """Return a verifier; the latest ones are cached with their voxels for neighbouring cells."""
    return Verifier(scene_from(json.loads(scene)), voxel, rule, width)


@register("zeta")
def zeta(
    scene: Mapping[str, Any],
    setup: str | Rings | Sensors,
    target: str,
    radius: float | None,
    rule: Rule,
    voxel: float | None,
    width: float = 0.0,
) -> dict[str, Any]:
    """Count ζ of a setup for one target.

    Returns:
        ζ in percent with its bounds, the number of voxels, and the time in seconds.

    Raises:
        KeyboardInterrupt: also if Ctrl-C left an interval wider than ``width``, which a study must
            not store.
    """
    verifier = _verifier(json.dumps(scene, sort_keys=True), rule, voxel, width)
    found = verifier.verify(*asked_from(verifier.scene, setup, target, radius))
    if any(
        pose.bounds is not None and width > 0 and not pose.bounds.reached for pose in found.poses
    ):
        raise KeyboardInterrupt
    percents = {f"{key}_percent": 100 * getattr(found, key) for key in ("zeta", "low", "high")}
    return percents | {
        "target": found.target_voxels,
        "covered": found.covered_voxels,
        "seconds": found.seconds,
    }


@register("unseeing sensors")
def unseeing_sensors(scene: Mapping[str, Any], setup: str | Rings | Sensors) -> int:
    """Return how many sensors are almost fully blocked at some pose, under the scene's
    occlusion.
    """
    where = scene_from(scene)
    return len({(u.ring, u.sensor) for u in unseeing(where, setup_from(setup, where))})


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
    brake = StopToken(processor_time, time.process_time)
    context = SearchContext(Verifier(asked), brake=brake, schedule=schedule)
    found = searching(space, SearchOptions(seed=seed, start=setups), context)
    if found.outcome is Outcome.INTERRUPTED:
        raise KeyboardInterrupt
    return ring_keys(found.setup, asked.sensor), found.outcome


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
