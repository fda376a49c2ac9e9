"""The tasks that studies are made of: functions of what JSON can hold, returning what JSON can
hold.

Those that several studies share are here; a study registers its own.
"""

import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, TypeVar

from ...coverage.rings.ring import Setup, named_setup
from ...coverage.targets import Target
from ...formats.schema.ring_models import RingModel, ring_models, setup_of
from ...formats.schema.scene_models import SceneModel
from ...objectives.criterion import Criterion
from ...objectives.occlusion import unseeing
from ...objectives.scene import Scene
from ...objectives.verify import Rule, Verifier
from ...placement.search.design import Space
from ...placement.search.layout import ring_layout
from ...placement.search.progress import Outcome
from ...placement.search.schedule import short as shorter
from ...placement.search.search import search as searching
from .store import Cell

Rings = list[dict[str, Any]]
_Task = TypeVar("_Task", bound=Callable[..., Any])
_COUNTING = 0.2  # of a search's time, kept for the exact count of its finalists


def scene_from(scene: Mapping[str, Any]) -> Scene:
    """A scene from the keys in which it differs from the reference scene, as a scene's file has
    them.
    """
    return SceneModel.model_validate(dict(scene)).to_domain()


def setup_from(setup: str | Rings, scene: Scene) -> Setup:
    """A setup from the paper's name or from rings as a proposal's file has them."""
    if isinstance(setup, str):
        return named_setup(setup, scene.sensor, scene.ring_radius)
    return setup_of(
        [RingModel.model_validate(ring) for ring in setup], scene.sensor, scene.ring_radius
    )


@lru_cache(maxsize=2)
def _verifier(scene: str, rule: Rule, voxel: float | None, width: float) -> Verifier:
    """The last ones are kept, with the voxels of their targets: cells side by side share them."""
    return Verifier(scene_from(json.loads(scene)), voxel, rule, width)


def zeta(
    scene: Mapping[str, Any],
    setup: str | Rings,
    target: str,
    radius: float | None,
    rule: Rule,
    voxel: float | None,
    width: float = 0.0,
) -> dict[str, Any]:
    """Exact zeta of a setup for one target, in percent with its bounds, the voxels counted, and the
    seconds it took.

    Raises:
        KeyboardInterrupt: also where Ctrl-C left an interval wider than was asked for: a study must
            not keep that.
    """
    verifier = _verifier(json.dumps(scene, sort_keys=True), rule, voxel, width)
    found = verifier.verify(setup_from(setup, verifier.scene), Target(target, radius))
    if any(pose.proof is not None and width > 0 and not pose.proof.reached for pose in found.poses):
        raise KeyboardInterrupt
    percents = {f"{key}_percent": 100 * getattr(found, key) for key in ("zeta", "low", "high")}
    return percents | {
        "target": found.target_voxels,
        "covered": found.covered_voxels,
        "seconds": found.seconds,
    }


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


def place(scene: Mapping[str, Any], seed: int, **asked: Any) -> Rings:
    """The rings of a searched setup, as a proposal lists them: of a layout (``rings_per_link``,
    ``sensors_per_ring``), or where ``sensors`` are given of any rings; from the ``known`` setups
    too, by a ``short`` schedule where these are good.

    Raises:
        KeyboardInterrupt: also where Ctrl-C left the best so far: a study must not keep that.
    """
    return _searched(scene, seed, **asked)[0]


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


def unseeing_sensors(scene: Mapping[str, Any], setup: str | Rings) -> int:
    """How many sensors of a setup see next to nothing at a pose, as the scene's occlusion has
    it.
    """
    where = scene_from(scene)
    return len({(u.ring, u.sensor) for u in unseeing(where, setup_from(setup, where))})


def shared(cell: Cell) -> str:
    """What cells with costly preparation in common have in common: everything but the setup."""
    return Cell(
        cell.work, {key: value for key, value in cell.arguments.items() if key != "setup"}
    ).key


TASKS: dict[str, Callable[..., Any]] = {
    "zeta": zeta,
    "place": place,
    "place in time": place_in_time,
    "unseeing sensors": unseeing_sensors,
}


def register(name: str) -> Callable[[_Task], _Task]:
    """Make a function a task that cells name so: each study registers those of its own, in its
    module ``tasks``.

    Raises:
        ValueError: if another function has that name already.
    """

    def add(function: _Task) -> _Task:
        if TASKS.setdefault(name, function) is not function:
            raise ValueError(f"found two tasks called {name!r}")
        return function

    return add
