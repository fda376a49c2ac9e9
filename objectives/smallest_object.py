"""The smallest object that is seen at each place: the largest sphere and the largest vertical rod
that can be in a target unseen.

ISO 13855:2024 calls the size from which on objects are detected the effective detection capability
d_e. Here it is geometry: an object larger than the largest unseen one is in some beam wherever it
is in the target. An object may not reach into the robot or an obstacle, nor out of the target.
Mounted rings are no obstacle. Each pose counts by itself, and the worst one decides: an object that
is seen at another pose of a motion is unseen at this one.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..coverage.rings.ring import Setup
from ..coverage.rings.ring_kinematics import sensor_cones
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.solids.base import Difference
from ..coverage.targets.target import Target
from ..coverage.voxels.largest_object import BALL, ObjectShape, largest_object
from ..coverage.voxels.unseen_cells import CellGrid, UnseenSpace
from .object_bounds import ObjectBounds, SmallestObject, verdict_of
from .occlusion import sight
from .scene import Scene
from .verify import Verifier

WIDTH = 0.002  # m, of an interval of a diameter
_FINEST = 0.0005  # m, side of the smallest cells
_MOST_CELLS = 1 << 21  # cells of the grid on which the work starts
_ALONG = 100  # points of a zone's ray that are examined


@dataclass(frozen=True)
class PosedSpace:
    """The unseen space of a target at a pose."""

    space: UnseenSpace
    grid: CellGrid
    """Its cells of one level."""


def unseen_space(scene: Scene, setup: Setup, target: Target, pose: int, side: float) -> PosedSpace:
    """Return the part of a target at a pose that no sensor sees, in cells of ``side`` m or more.

    Raises:
        ValueError: if the target is empty.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    q, solid = scene.poses[pose].q, scene.solid(target, pose)
    if scene.robot.bodies and "V_N" not in target.names:  # V_N has its own bodies subtracted
        solid = Difference(solid, robot_capsules(scene.robot, forward(scene.robot.chain, q)))
    cones = sensor_cones(scene.robot, scene.with_cell(setup), q)
    seen = sight(scene, cones, q, bracketed=True)
    box = float(np.prod(np.ptp(solid.bounds(), axis=0)))
    side = max(side, (box / _MOST_CELLS) ** (1 / 3))
    levels = max(math.ceil(math.log2(side / _FINEST)), 0)
    space = UnseenSpace.of(solid, seen, side, levels)
    return PosedSpace(space, space.grid(levels))


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
        side: side of the cells with which the work starts, m; smaller ones follow where they
            matter.
        rod_length: length of the rod, m.
        at: called with the index of each pose before it is examined.

    Raises:
        ValueError: for a rod that is not longer than a cell, and as ``unseen_space`` does.
    """
    start, spheres, rods = time.perf_counter(), list[ObjectBounds](), list[ObjectBounds]()
    limit = None if target.largest_gap is None else target.largest_gap / 2
    side = min(side, rod_length / 2)
    for pose in range(len(scene.poses)):
        at(pose)
        here = unseen_space(scene, setup, target, pose, side)
        ball = largest_object(here.space, here.grid, BALL, WIDTH / 2, limit)
        rod = largest_object(here.space, here.grid, ObjectShape(rod_length), WIDTH / 2)
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


def zone_rays(scene: Scene, setup: Setup, pose: int) -> Float[np.ndarray, "Z P 3"]:
    """Return points m along the unoccluded part of each zone's centre ray, for Z zones and P places
    from the apex to the range; nan where the ray is occluded.

    A square beam of n zones a row has n x n of them, equal in tangents; any other beam is one zone,
    whose ray is its axis.
    """
    q, placed = scene.poses[pose].q, scene.with_cell(setup)
    cones = sensor_cones(scene.robot, placed, q)
    seen = sight(scene, cones, q)
    rays = [np.zeros((0, _ALONG, 3))]
    part = (np.arange(_ALONG) + 0.5) / _ALONG
    for group, members in zip(placed.groups, placed.slices, strict=True):
        zones = group.sensor.zones
        row = (2 * np.arange(zones) + 1) / zones - 1
        places = np.stack(np.meshgrid(row, row, indexing="ij"), -1).reshape(1, -1, 2)
        for k in range(members.start, members.stop):
            way = np.asarray(cones.axis)[[k]]  # (zones^2, 3)
            if zones > 1:
                way = cones.ways(np.array([k]), places)[0]
            points = cones.out(k, np.asarray(cones.range_m)[k] * way[:, None] * part[:, None])
            flat = points.reshape(-1, 3)
            hidden = np.asarray(seen.part(flat, k)) > _ON_BEAM
            rays.append(np.where(hidden.reshape(points.shape[:2])[..., None], np.nan, points))
    return np.concatenate(rays)


_ON_BEAM = 1e-9  # m, by which a point on the edge of its beam may miss it through rounding


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
