"""Tasks of the study of bounds."""

from collections.abc import Mapping
from typing import Any

from ..engine.registry import register
from ..engine.scenes import Rings, scene_from, setup_from
from .ring_grid import RingGrid, bounded, covered, points_in


@register("share of points")
def share_of_points(
    scene: Mapping[str, object], setup: str | Rings, points: int, seed: int
) -> float:
    """Return the percentage of random points in the scene's first target that a setup covers.

    Points and coverage are those of the scene's first pose.
    """
    where = scene_from(scene)
    drawn = points_in(where, where.goals[0].target, points, seed)
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
    """Bound the coverage of setups from a grid on such points; see ``ring_grid`` and
    ``max_cover``.
    """
    where = scene_from(scene)
    return bounded(where, where.goals[0].target, sensors, RingGrid(**grid), points, seed, limit)
