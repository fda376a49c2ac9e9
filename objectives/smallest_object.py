"""The smallest object that is seen at each place: the largest sphere and the largest vertical rod
about it that no sensor sees.

ISO 13855:2024 calls the size from which on objects are detected the effective detection capability
d_e. Here it is geometry: an object larger than the largest unseen one is in some beam wherever its
centre is in the target. It may stick out of the target, but not reach into the robot or an
obstacle. Mounted rings are no obstacle. Each pose counts by itself, and the worst one decides: an
object that is seen at another pose of a motion is unseen at this one. Objects of more than 1 m are
not told apart.
"""

import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ..coverage.rings.ring import Setup
from ..coverage.rings.ring_kinematics import sensor_cones
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import carried_polyhedra, robot_capsules
from ..coverage.solids.base import Solid, Union
from ..coverage.solids.polyhedra import polyhedra
from ..coverage.targets.named import Near
from ..coverage.targets.posed_robot import robot_curve
from ..coverage.targets.target import Target
from ..coverage.voxels.largest_object import largest_object
from ..coverage.voxels.object_room import BALL, ObjectShape, TargetCells, UnseenSpace
from .object_bounds import MOST, ObjectBounds, SmallestObject, verdict_of
from .occlusion import sight
from .options import ObjectOptions
from .pose_subset import MANY
from .scene import Scene
from .verify import Verifier

ON_BEAM = 1e-9  # m, by which a point on the surface of its beam may miss it through rounding
WIDTH = 0.002  # m, of an interval of a diameter
SIDE = 0.02  # m, smallest side of the cells with which the work starts
_FINEST = 0.0005  # m, side of the smallest cells
_MOST_CELLS = 1 << 21  # cells of the grid on which the work starts
_ALONG = 100  # points of a zone's ray that are examined


def bodies_of(scene: Scene, pose: int, box: Float[np.ndarray, "2 3"], more: float = 0.0) -> Solid:
    """Return where no object may be at a pose, in a box (2, 3) m: the robot, what it carries, and
    the obstacles. A robot without bodies is its V_R.

    All are larger by ``more`` m. Flat bodies grow by moving their faces, so that places just beside
    their edges are in them, too.
    """
    q, robot = scene.poses[pose].q, scene.robot
    if robot.bodies:
        own = robot_capsules(robot, forward(robot.chain, q))
        grown: Solid = replace(own, radius=own.radius + more)
    else:
        shape = scene.curve
        grown = robot_curve(robot, q, shape).tube(shape.robot_radius + more, shape.points_per_bend)
    flat = (*(o.body for o in scene.obstacles), *carried_polyhedra(robot, q))
    moved = tuple(replace(body, offset=body.offset + more) for body in flat)
    return Union(grown, polyhedra(moved, box)) if moved else grown


def unseen_space(
    scene: Scene, setup: Setup, target: Target, pose: int, side: float, rod_length: float
) -> TargetCells:
    """Return what bodies and sensors leave about a target at a pose, in cells of ``side`` m or
    more.

    Raises:
        ValueError: if the target is empty.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    q, solid = scene.poses[pose].q, scene.solid(target, pose)
    cones = sensor_cones(scene.robot, scene.with_cell(setup), q)
    seen = sight(scene, cones, q, bracketed=True)
    rim = max(MOST, rod_length) / 2
    around = solid.bounds() + np.array([[-rim], [rim]])
    side = max(side, (float(np.prod(np.ptp(around, axis=0))) / _MOST_CELLS) ** (1 / 3))
    levels = max(math.ceil(math.log2(side / _FINEST)), 0)
    bodies = bodies_of(scene, pose, around)
    nearest = target.radius if isinstance(target, Near) else math.inf
    space = UnseenSpace.about(solid, bodies, seen, side, levels, MOST / 2, rod_length, nearest)
    return space.grid(levels)


def smallest_object(
    scene: Scene,
    setup: Setup,
    target: Target,
    side: float,
    rod_length: float,
    at: Callable[[int], None] = lambda _: None,
) -> SmallestObject:
    """Return the largest unseen sphere and rod of ``setup`` in ``target`` over the scene's poses.

    Args:
        scene: the scene.
        setup: the setup.
        target: the target, of which ``largest_gap`` is decided.
        side: side of the voxels of a count, m. The work starts with cells as large, but of 0.02 m
            or more; smaller ones follow where they matter.
        rod_length: length of the rod, m.
        at: called with the index of each pose before it is examined.

    Raises:
        ValueError: for a rod that is not longer than a cell, and as ``unseen_space`` does.
    """
    start, spheres, rods = time.perf_counter(), list[ObjectBounds](), list[ObjectBounds]()
    limit = None if target.largest_gap is None else target.largest_gap / 2
    first = min(max(side, SIDE), rod_length / 2)
    for pose in range(len(scene.poses)):
        at(pose)
        here = unseen_space(scene, setup, target, pose, first, rod_length)
        ball = largest_object(here, BALL, WIDTH / 2, limit)
        rod = largest_object(here, ObjectShape(rod_length), WIDTH / 2)
        spheres.append(ObjectBounds.of(ball, pose))
        rods.append(ObjectBounds.of(rod, pose))
    sphere = ObjectBounds.worst(spheres)
    return SmallestObject(
        sphere=sphere,
        rod=ObjectBounds.worst(rods),
        rod_length=rod_length,
        largest_gap=target.largest_gap,
        verdict=verdict_of(sphere, target.largest_gap),
        zones_per_m3=point_density(scene, setup, target, side),
        spheres=tuple(spheres),
        rods=tuple(rods),
        seconds=time.perf_counter() - start,
    )


def gap_excess(scene: Scene, setup: Setup) -> float:
    """Return by how much the diameters of unseen spheres of ``setup`` that were found exceed the
    goals' largest gaps, as a share of each, summed over the goals; 0 for more than ``MANY`` poses,
    at which finding them takes too long for a search.

    Raises:
        ValueError: as ``unseen_space`` does.
    """
    excess = []
    for goal in scene.targets:
        if goal.largest_gap is not None and len(scene.poses) <= MANY:
            spaces = (
                unseen_space(scene, setup, goal.target, pose, SIDE, 0.0)
                for pose in range(len(scene.poses))
            )
            largest = max(largest_object(space, BALL, WIDTH / 2).low for space in spaces)
            excess.append(max(2 * largest / goal.largest_gap - 1, 0.0))
    return math.fsum(excess)


def smallest_objects(
    scene: Scene,
    setup: Setup,
    side: float,
    options: ObjectOptions,
    at: Callable[[int], None] = lambda _: None,
) -> tuple[SmallestObject | None, ...]:
    """Return the largest unseen objects of each goal, where the options ask for them or the goal
    states the largest gap; None for other goals.

    Args:
        scene, setup, side, at: as in ``smallest_object``.
        options: whether all goals are examined, and the length of the rod.
    """
    return tuple(
        smallest_object(scene, setup, goal, side, options.rod_length, at)
        if options.smallest_object or goal.largest_gap is not None
        else None
        for goal in scene.targets
    )


def zone_rays(scene: Scene, setup: Setup, pose: int) -> Float[np.ndarray, "Z P 3"]:
    """Return points m along the unoccluded part of each zone's centre ray, for Z zones and P places
    from the apex to the range; nan where the ray is occluded.

    The zones of a square beam are equal in tangents; any other beam is one zone, whose ray is its
    axis.
    """
    q, placed = scene.poses[pose].q, scene.with_cell(setup)
    cones = sensor_cones(scene.robot, placed, q)
    seen = sight(scene, cones, q)
    rays = [np.zeros((0, _ALONG, 3))]
    part = (np.arange(_ALONG) + 0.5) / _ALONG
    for group, members in zip(placed.groups, placed.slices, strict=True):
        sensor = group.sensor
        middles = ((2 * np.arange(n) + 1) / n - 1 for n in (sensor.zones, sensor.rows))
        places = np.stack(np.meshgrid(*middles, indexing="ij"), -1).reshape(1, -1, 2)
        for k in range(members.start, members.stop):
            way = np.asarray(cones.axis)[[k]]  # (zones, 3)
            if sensor.zones > 1:
                way = cones.ways(np.array([k]), places)[0]
            points = cones.out(k, np.asarray(cones.range_m)[k] * way[:, None] * part[:, None])
            flat = points.reshape(-1, 3)
            hidden = np.asarray(seen.part(flat, k)) > ON_BEAM
            rays.append(np.where(hidden.reshape(points.shape[:2])[..., None], np.nan, points))
    return np.concatenate(rays)


def point_density(scene: Scene, setup: Setup, target: Target, side: float) -> float:
    """Return the zones per m³ of a target, as ``SmallestObject.zones_per_m3`` says.

    Rays are examined at a hundred points each, and the volume is counted in voxels of ``side`` m.
    """
    verifier, density = Verifier(scene, side, "centre"), 0.0
    for pose, weight in enumerate(scene.pose_weights):
        points = zone_rays(scene, setup, pose)
        free = np.isfinite(points[..., 0])
        inside = np.zeros_like(free)
        inside[free] = scene.solid(target, pose)(points[free]) <= 0
        volume = math.fsum(wanted.volume for wanted, _ in verifier.pieces(target, pose))
        density += float(weight) * int(inside.any(axis=1).sum()) / volume
    return density
