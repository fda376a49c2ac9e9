"""A grid of rings, the points that each ring covers, and rings that exclude each other."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from ...coverage.rings.ring import Ring, Setup
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.targets.target import Target
from ...objectives.scene import Scene
from ..engine.runner import register
from ..engine.scenes import Rings, scene_from, setup_from
from .max_cover import CoverProblem, greedy, grouped, relaxed, solved

_CLOSE = 1e-9  # m


@dataclass(frozen=True)
class RingGrid:
    """Rings on a regular grid, the ends of their limits included."""

    positions: int = 7
    """Number of positions along each link."""
    tilts: int = 11
    """Number of tilts."""
    counts: tuple[int, ...] = (8, 16, 24)
    """Numbers of sensors on a ring."""
    phases: int = 2
    """Number of phases within the angle between two sensors."""

    def rings(self, scene: Scene) -> list[Ring]:
        """Return all rings of the grid, ordered by link and position."""
        found = []
        for mount in scene.robot.mounts:
            limits = scene.limits_of(mount.link)
            places = (
                np.linspace(*limits.position, self.positions) if mount.length > 0 else np.zeros(1)
            )
            for place, tilt in itertools.product(places, np.linspace(*limits.tilt, self.tilts)):
                for count, phase in itertools.product(self.counts, range(self.phases)):
                    turn = 2 * math.pi / count * phase / self.phases
                    at = float(place), count, float(tilt), turn
                    found.append(Ring(mount.link, *at, scene.default_radius, scene.sensor))
        return found


def limits(scene: Scene, rings: list[Ring]) -> tuple[tuple[np.ndarray, int], ...]:
    """Return sets of rings that exclude each other, with the number that may be taken from each.

    Of rings closer than the rules' spacing one may be taken; of the rings on a link, as many as the
    rules allow.
    """
    found = []
    for mount in scene.robot.mounts:
        mine = np.array([i for i, ring in enumerate(rings) if ring.link == mount.link])
        if not len(mine):
            continue
        at = np.array([rings[i].position * mount.length for i in mine])
        sets = {
            tuple(mine[(at >= start - _CLOSE) & (at < start + scene.rules.spacing - _CLOSE)])
            for start in set(at)
        }
        if mount.length == 0:
            sets = {tuple(mine)}
        found += [
            (np.array(some), 1)
            for some in sorted(sets)
            if some and not any(set(some) < set(o) for o in sets)
        ]
        found.append((mine, scene.rules.max_rings_per_link))
    return tuple(found)


def points_in(scene: Scene, target: Target, count: int, seed: int) -> Float[np.ndarray, "N 3"]:
    """Draw points (N, 3) m in the target at the scene's first pose."""
    return scene.sample(target, 0, count, seed)


def covered(scene: Scene, setup: Setup, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
    """Return which ``points`` (N, 3) m a setup covers at the scene's first pose."""
    return np.asarray(sensor_cones(scene.robot, setup, scene.poses[0].q)(points) <= 0)


def choice(
    scene: Scene, grid: RingGrid, points: Float[np.ndarray, "N 3"], budget: int
) -> tuple[list[Ring], CoverProblem]:
    """Return the grid's rings, and the problem of choosing among them within a budget of
    sensors.
    """
    rings = grid.rings(scene)
    covers, weight = grouped(np.stack([covered(scene, Setup((ring,)), points) for ring in rings]))
    return rings, CoverProblem(
        covers, weight, np.array([ring.count for ring in rings]), budget, limits(scene, rings)
    )


@register("share of points")
def share_of_points(
    scene: Mapping[str, object], setup: str | Rings, points: int, seed: int
) -> float:
    """Return the percentage of random points in the scene's first target that a setup covers.

    Points and coverage are those of the scene's first pose.
    """
    where = scene_from(scene)
    drawn = points_in(where, where.targets[0].target, points, seed)
    return 100 * float(covered(where, setup_from(setup, where), drawn).mean())


@register("bound")
def bound(
    scene: Mapping[str, object],
    sensors: int,
    seed: int,
    points: int,
    grid: Mapping[str, Any],
    limit: float,
) -> dict[str, Any]:
    """Bound the coverage of setups from a grid on random points in the scene's first target.

    Args:
        scene: keys of the scene.
        sensors: number of sensors.
        seed: random seed of the points.
        points: number of points.
        grid: fields of ``RingGrid``.
        limit: time limit of each programme, s.

    Returns:
        Percent of the points for greedy, the best known choice, and the upper bounds of the integer
            and the linear programme; whether the integer programme was solved; the numbers of rings
            in the grid and of groups of points.
    """
    where = scene_from(scene)
    drawn = points_in(where, where.targets[0].target, points, seed)
    rings, problem = choice(where, RingGrid(**grid), drawn, sensors)
    first = problem.share(greedy(problem))
    linear, best = relaxed(problem, limit), solved(problem, limit)
    percents = {
        "greedy": first,
        "chosen": max(first, problem.share(best.taken)),
        "integer_bound": best.bound,
        "linear_bound": linear,
    }
    return {f"{key}_percent": round(100 * value, 4) for key, value in percents.items()} | {
        "optimal": best.optimal,
        "rings": len(rings),
        "groups": len(problem.weight),
    }
