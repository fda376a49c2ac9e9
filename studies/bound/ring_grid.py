"""A grid of rings, what each covers of points in a target, and which of them do not go together."""

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from ...coverage.rings.ring import Ring, Setup
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.soft.sampling import sample
from ...coverage.targets import Target
from ...objectives.scene import Scene
from .max_cover import CoverProblem, greedy, grouped, relaxed, solved

_CLOSE = 1e-9  # m


@dataclass(frozen=True)
class RingGrid:
    """Rings at so many positions along each link and tilts (ends of their limits included), with
    these counts, and at so many phases within the spacing of their sensors."""

    positions: int = 7
    tilts: int = 11
    counts: tuple[int, ...] = (8, 16, 24)
    phases: int = 2

    def rings(self, scene: Scene) -> list[Ring]:
        """All rings of the grid, link by link and place by place."""
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
                    found.append(Ring(mount.link, *at, scene.ring_radius, scene.sensor))
        return found


def limits(scene: Scene, rings: list[Ring]) -> tuple[tuple[np.ndarray, int], ...]:
    """Which rings exclude each other: of those nearer than the rules' spacing one, of a link as
    many as the rules allow.
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
        found.append((mine, scene.rules.rings_per_link))
    return tuple(found)


def points_in(scene: Scene, target: Target, count: int, seed: int) -> Float[np.ndarray, "N 3"]:
    """Points (N, 3) m drawn in the target at the scene's first pose."""
    return sample(scene.solid(target, 0), count, seed)


def covered(scene: Scene, setup: Setup, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
    """Which of ``points`` (N, 3) m a setup covers at the scene's first pose."""
    return np.asarray(sensor_cones(scene.robot, setup, scene.poses[0].q)(points) <= 0)


def choice(
    scene: Scene, grid: RingGrid, points: Float[np.ndarray, "N 3"], budget: int
) -> tuple[list[Ring], CoverProblem]:
    """The grid's rings, and the problem of choosing among them within a budget of sensors."""
    rings = grid.rings(scene)
    covers, weight = grouped(np.stack([covered(scene, Setup((ring,)), points) for ring in rings]))
    return rings, CoverProblem(
        covers, weight, np.array([ring.count for ring in rings]), budget, limits(scene, rings)
    )


def bounded(
    scene: Scene, target: Target, budget: int, grid: RingGrid, count: int, seed: int, seconds: float
) -> dict[str, Any]:
    """Percents of ``count`` points: greedy, the best choice met, the integer and the linear
    programme's upper bounds; whether the integer programme was solved in its ``seconds``; rings of
    the grid, and groups of points."""
    rings, asked = choice(scene, grid, points_in(scene, target, count, seed), budget)
    first = asked.share(greedy(asked))
    linear, best = relaxed(asked, seconds), solved(asked, seconds)
    percents = {
        "greedy": first,
        "chosen": max(first, asked.share(best.taken)),
        "integer_bound": best.bound,
        "linear_bound": linear,
    }
    return {f"{key}_percent": round(100 * value, 4) for key, value in percents.items()} | {
        "optimal": best.optimal,
        "rings": len(rings),
        "groups": len(asked.weight),
    }
