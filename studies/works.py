"""The measurements that studies are made of: functions of what JSON can hold, returning what JSON can hold."""

import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np

from ..coverage.rings.ring import Setup, named_setup
from ..coverage.robots.built_in import ROBOTS
from ..coverage.targets import Target
from ..formats.convert.scenes import ring_models, scene_of, setup_of
from ..formats.schema.mount_models import RingModel
from ..formats.schema.scene_models import SceneFile
from ..objectives.criterion import Aim
from ..objectives.occlusion import unseeing
from ..objectives.scene import Scene
from ..objectives.verify import Rule, Verifier
from ..placement.search.design import Space
from ..placement.search.layout import ring_layout
from ..placement.search.progress import Outcome
from ..placement.search.schedule import short as shorter
from ..placement.search.search import search as searching
from ..simulation import distance
from ..simulation.approach import unseen_approaches
from ..simulation.distance import repeated
from ..simulation.task import Motion, pick_and_place
from . import grid
from .grid import Grid, bounded
from .store import Cell

Rings = list[dict[str, Any]]
_COUNTING = 0.2  # of a search's time, kept for the exact count of its finalists


def scene_from(scene: Mapping[str, Any]) -> Scene:
    """A scene from the keys in which it differs from the reference scene, as a scene's file has them."""
    return scene_of(SceneFile.model_validate(dict(scene)))


def setup_from(setup: str | Rings, scene: Scene) -> Setup:
    """A setup from the paper's name or from rings as a proposal's file has them."""
    if isinstance(setup, str):
        return named_setup(setup, scene.sensor, scene.ring_radius)
    return setup_of([RingModel.model_validate(ring) for ring in setup], scene.sensor, scene.ring_radius)


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
    """Exact zeta of a setup for one target, in percent with its bounds, the voxels counted, and the seconds it took.

    Raises:
        KeyboardInterrupt: also where Ctrl-C left an interval wider than was asked for: a study must not keep that.
    """
    verifier = _verifier(json.dumps(scene, sort_keys=True), rule, voxel, width)
    found = verifier.verify(setup_from(setup, verifier.scene), Target(target, radius))
    if any(pose.proof is not None and width > 0 and not pose.proof.reached for pose in found.poses):
        raise KeyboardInterrupt
    percents = {f"{key}_percent": 100 * getattr(found, key) for key in ("zeta", "low", "high")}
    return percents | {"target": found.target_voxels, "covered": found.covered_voxels, "seconds": found.seconds}


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
    """The rings of a searched setup, as a proposal lists them, and how the search ended: see ``place``."""
    asked = scene_from(scene)
    space = Space(asked, None if sensors else ring_layout(asked, rings_per_link, sensors_per_ring), sensors)
    setups = [setup_from(rings, asked) for rings in known]
    schedule = shorter(asked, space, Aim()) if short else None
    found = searching(asked, space, seed, processor_time, schedule, known=setups, clock=time.process_time)
    if found.outcome is Outcome.INTERRUPTED:
        raise KeyboardInterrupt
    return [ring.model_dump(exclude_none=True) for ring in ring_models(found.setup, asked.sensor)], found.outcome


def place(scene: Mapping[str, Any], seed: int, **asked: Any) -> Rings:
    """The rings of a searched setup, as a proposal lists them: of a layout (``rings_per_link``, ``sensors_per_ring``), or
    where ``sensors`` are given of any rings; from the ``known`` setups too, by a ``short`` schedule where these are good.

    Raises:
        KeyboardInterrupt: also where Ctrl-C left the best so far: a study must not keep that.
    """
    return _searched(scene, seed, **asked)[0]


def place_in_time(scene: Mapping[str, Any], seed: int, sensors: int, seconds: float) -> dict[str, Any]:
    """The same within so many seconds of processors, all together, of which a machine's other jobs take nothing: the rings,
    the seconds taken, of processors and on the wall, and whether the search came to its end.

    The climbs are stopped while there is time left to count the finalists exactly. Raises KeyboardInterrupt like ``place``.
    """
    wall, processor = time.monotonic(), time.process_time()
    rings, outcome = _searched(scene, seed, sensors=sensors, processor_time=(1 - _COUNTING) * seconds)
    spent = {"processor_seconds": time.process_time() - processor, "wall_seconds": time.monotonic() - wall}
    return {"rings": rings, "finished": outcome is Outcome.FINISHED, **spent}


def unseeing_sensors(scene: Mapping[str, Any], setup: str | Rings) -> int:
    """How many sensors of a setup see next to nothing at a pose, as the scene's occlusion has it."""
    where = scene_from(scene)
    return len({(u.ring, u.sensor) for u in unseeing(where, setup_from(setup, where))})


def share_of_points(scene: Mapping[str, Any], setup: str | Rings, points: int, seed: int) -> float:
    """Percent of the points drawn in the scene's first target that a setup covers, at its first pose."""
    where = scene_from(scene)
    drawn = grid.points_in(where, where.goals[0].target, points, seed)
    return 100 * float(grid.covered(where, setup_from(setup, where), drawn).mean())


def bound(
    scene: Mapping[str, Any], sensors: int, seed: int, points: int, grid: Mapping[str, Any], limit: float
) -> dict[str, Any]:
    """Upper bounds of what setups of a grid cover of such points, and what some do: see ``grid`` and ``maxcover``."""
    where = scene_from(scene)
    return bounded(where, where.goals[0].target, sensors, Grid(**grid), points, seed, limit)


@cache
def _task(robot: str, rate: float, duration: float) -> Motion:
    """The paper's task, again and again for so many seconds."""
    once = pick_and_place(ROBOTS[robot]).every(rate)
    time_s, q = repeated(once.time_s, once.q, duration)
    return Motion(time_s, q, np.zeros(len(q), bool))


def minimum_distance(
    robot: str, setup: str | Rings, thing: str, seed: int, mode: str, rate: float, duration: float
) -> dict[str, float | None]:
    """What rings make of the distance of a human or a thing while the robot does the paper's task: ``distance.cell``."""
    motion = _task(robot, rate, duration)
    where = scene_from({"robot": robot})
    return distance.cell(where.robot, setup_from(setup, where), motion.time_s, motion.q, thing, seed, mode)


def unseen_approach(robot: str, setup: str | Rings, q_deg: list[float], radii: list[float]) -> list[dict[str, Any]]:
    """The ways of balls that come nearest to the robot's moving parts without being seen: see ``approach``."""
    where = scene_from({"robot": robot})
    found = unseen_approaches(where.robot, setup_from(setup, where), np.radians(q_deg), tuple(radii))
    return [{"radius": a.radius, "gap_m": a.gap_m, "path": np.round(a.path, 6).tolist()} for a in found]


def shared(cell: Cell) -> str:
    """What cells with costly preparation in common have in common: everything but the setup."""
    return Cell(cell.work, {key: value for key, value in cell.arguments.items() if key != "setup"}).key


WORKS: dict[str, Callable[..., Any]] = {
    "zeta": zeta,
    "place": place,
    "place in time": place_in_time,
    "unseeing sensors": unseeing_sensors,
    "share of points": share_of_points,
    "bound": bound,
    "minimum distance": minimum_distance,
    "unseen approach": unseen_approach,
}
