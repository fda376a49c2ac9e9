"""Expected readings of the zones of a ring's sensors: the nearest body in each zone, and what a
zone that straddles its edge sees behind it.

The rays are those of ``zone_fan``.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import carried_polyhedra, robot_capsules
from ...coverage.solids.capsules import Capsules
from ...objectives.scene import Scene
from ...simulation.twin.zone_fan import ZONE_STEPS, fan_places, fan_rays, zone_targets
from ...simulation.twin.zone_grid import zone_grid
from .expected import beams_at, only, outside
from .ray_fan import Hit, ball_around, hit_capsules, hit_polyhedron, ray_to_capsule

_AT_ONCE = 1 << 7  # beams
_NEAR = 1e-6  # m


def expected_zones(
    scene: Scene,
    setup: Setup,
    ring: int,
    joints: Float[np.ndarray, "T J"],
    rod: Capsules | None = None,
    targets: int = 1,
) -> Float[np.ndarray, "T n r c t"]:
    """Return the noise-free readings of the zones of one ring's sensors.

    Args:
        scene: as in ``expected``.
        setup: the rings.
        ring: number of the ring.
        joints: (T, J) rad.
        rod: as in ``expected``.
        targets: number of targets of a zone.

    Returns:
        Distances, m, along each target's ray, nearest first; infinite where there is none.
    """
    group, alone = setup.groups[ring], _alone(setup, ring)
    poses, which = np.unique(joints, axis=0, return_inverse=True)
    if rod is not None:
        poses, which = joints, np.arange(len(joints))
    beams = beams_at(scene, alone, poses)
    rows, columns = zone_grid(group.sensor)
    shape = (len(poses), group.count, rows, columns, targets)
    found = np.empty((len(beams), rows, columns, targets))
    for first in range(0, len(beams), _AT_ONCE):
        some = np.arange(first, min(first + _AT_ONCE, len(beams)))
        part, of = only(beams, some), some // group.count
        rays, length = fan_rays(part, fan_places(rows, columns, ZONE_STEPS))
        nearest = np.full(rays.shape[:2], np.inf)
        for middle, size, hit in _bodies(scene, poses, of, rod):
            near = np.flatnonzero(outside(part, middle) <= size + _NEAR)
            if len(near):
                origin = np.asarray(part.apex)[near, None]
                distance = hit(near, origin, rays[near])
                nearest[near] = np.minimum(nearest[near], distance)
        nearest = np.where(nearest <= length, nearest, np.inf)
        found[some] = zone_targets(nearest, (rows, columns), ZONE_STEPS, targets)
    return found.reshape(shape)[which.ravel()]


def zones_of_rods(
    scene: Scene,
    setup: Setup,
    ring: int,
    sensor: int,
    q: Float[np.ndarray, " J"],
    rods: Capsules,
) -> Float[np.ndarray, "N r c"]:
    """Return the distances (N, r, c) m of N rods, each alone, in the zones of one sensor at ``q``
    (J,) rad; infinite where a rod is not in the zone.
    """
    rows, columns = zone_grid(setup.groups[ring].sensor)
    beam = only(beams_at(scene, _alone(setup, ring), q[None]), [sensor])
    rays, length = fan_rays(beam, fan_places(rows, columns, ZONE_STEPS))
    origin = np.asarray(beam.apex)[:, None]
    start, end, radius = (np.asarray(a) for a in rods.arrays())
    found = np.empty((len(start), rows, columns))
    for first in range(0, len(start), _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        distance = ray_to_capsule(origin, rays, start[some], end[some], radius[0])
        distance = np.where(distance <= length, distance, np.inf)
        found[some] = zone_targets(distance, (rows, columns), ZONE_STEPS, 1)[..., 0]
    return found


def _alone(setup: Setup, ring: int) -> Setup:
    """Return a setup of one of the rings or single sensors."""
    rings = setup.rings[ring : ring + 1]
    return Setup(rings) if rings else Setup((), setup.singles[ring - len(setup.rings) :][:1])


def _bodies(
    scene: Scene, poses: Float[np.ndarray, "T J"], of: np.ndarray, rod: Capsules | None
) -> Iterator[tuple[Any, Any, Hit]]:
    """Yield the bodies at the pose ``of`` (B,) each beam: centre (3,) or (B, 3) m and radius () or
    (B,) m of a ball around it, and its test.
    """
    for obstacle in scene.obstacles:
        yield *ball_around(obstacle.body), hit_polyhedron(obstacle.body)
    carried = [] if rod is None else [rod]
    if scene.robot.bodies:
        carried.append(robot_capsules(scene.robot, forward(scene.robot.chain, poses)))
    for some in carried:
        starts, ends, radius = (np.asarray(a) for a in some.arrays())
        for m, thick in enumerate(radius):
            start, end = starts[of, m], ends[of, m]
            size = np.linalg.norm(end - start, axis=1) / 2 + thick
            yield (start + end) / 2, size, hit_capsules(start, end, np.full(len(of), thick))
    if scene.robot.carried:
        for pose in np.unique(of):
            for body in carried_polyhedra(scene.robot, poses[pose]):
                middle, reach = ball_around(body)
                yield middle, np.where(of == pose, reach, -np.inf), hit_polyhedron(body)
