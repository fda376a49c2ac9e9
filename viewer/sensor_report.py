"""What one sensor does: what it covers, what it alone covers, and what blocks its view."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ..coverage.occlusion.occluders import Occluders, beams
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.targets.target import Target
from ..objectives.occlusion import occluders
from .quick_estimate import QuickEstimate

POINTS = 20_000  # sample points of the target


@dataclass(frozen=True)
class SensorReport:
    """One sensor at one pose; shares are of the target's volume."""

    group: int
    """Index of its ring, or of itself if it is a single sensor."""
    sensor: int
    """Index on its ring."""
    covered: float
    """Share that it covers."""
    alone: float
    """Share that no other sensor covers."""
    blocked: float
    """Share that lies in its cone, but is occluded."""
    blockers: tuple[tuple[str, float], ...]
    """Names of the bodies and obstacles that occlude it, and the share behind each; most first."""


def sensor_report(
    glance: QuickEstimate,
    setup: Setup,
    target: Target,
    pose: int,
    occlusion: Occlusion,
    group: int,
    sensor: int,
) -> SensorReport:
    """Return the report of one sensor.

    Args:
        glance: estimate of the scene.
        setup: setup with the sensor.
        target: one of the targets.
        pose: index of the pose.
        occlusion: model of occlusion.
        group: index of the ring or single sensor.
        sensor: index of the sensor on its ring.

    Raises:
        IndexError: if there is no such sensor.
        BodilessError: see ``QuickEstimate.verdict``.
    """
    if not 0 <= sensor < setup.groups[group].count:
        raise IndexError(f"ring {group} has no sensor {sensor}")
    points = glance.points(target, pose, POINTS)
    number = glance.verdict(setup, target, pose, occlusion, POINTS).seen
    cones, seen = glance.beams(setup.groups[group], pose, occlusion)
    held = cones.part(points, sensor) <= 0
    clear = held if seen is cones else held & (seen.part(points, sensor) <= 0)
    hidden = points[held & ~clear]
    blockers = []
    for name, one in _each_occluder(glance, pose, occlusion) if len(hidden) else ():
        part = beams(cones, one, "shadow" if occlusion == "ignore" else occlusion)
        behind = np.count_nonzero(part.part(hidden, sensor) > 0) / len(points)
        if behind:
            blockers.append((name, behind))
    return SensorReport(
        group,
        sensor,
        float(clear.mean()),
        float((clear & (number == 1)).mean()),
        len(hidden) / len(points),
        tuple(sorted(blockers, key=lambda b: -b[1])),
    )


def _each_occluder(
    glance: QuickEstimate, pose: int, occlusion: Occlusion
) -> Iterator[tuple[str, Occluders]]:
    """Yield the name of each body and obstacle, and it as the only occluder."""
    scene = replace(glance.scene, occlusion=occlusion)
    every = occluders(scene, scene.poses[pose].q)
    names = [body.name for body in scene.robot.bodies]
    if every.bodies is not None:
        for i, name in enumerate(names):
            start, end, radius = (a[i : i + 1] for a in every.bodies.arrays())
            yield name, Occluders(type(every.bodies)(start, end, radius))
    others = [o.name for o in scene.obstacles] + [c.name for c in scene.robot.carried]
    for name, body in zip(others, every.obstacles, strict=False):
        yield name, Occluders(None, (body,))


def nearest_sensor(
    apexes: Float[np.ndarray, "K 3"],
    origin: Float[np.ndarray, " 3"],
    direction: Float[np.ndarray, " 3"],
) -> int:
    """Return the index of the sensor that a ray hits, or passes most closely.

    Of sensors that are equally close to the ray, the one nearer to its origin counts.

    Args:
        apexes: places (K, 3) m of the sensors.
        origin: start of the ray, m.
        direction: unit direction of the ray.
    """
    away = apexes - origin
    along = away @ direction
    across = np.linalg.norm(away - along[:, None] * direction, axis=1)
    reached = across <= across.min() + _CHIP
    return int(np.argmin(np.where(reached, along, np.inf)))


_CHIP = 0.012  # m, half the edge of a drawn sensor
