"""Expected readings of a mounted setup: the nearest body of robot, cell and test rod in each beam.

A single-zone sensor returns the nearest point anywhere in its beam. Whatever lies between sensor
and that point is in the beam too, and nearer, so nothing can occlude it. The distance is therefore
the minimum over all bodies, taken one by one.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float, Int

from ...coverage.occlusion.first_return import Beam, capsule_in_beam
from ...coverage.occlusion.polyhedron_return import polyhedron_in_beam
from ...coverage.occlusion.ranging import slabs
from ...coverage.pytrees import mapped
from ...coverage.rings.ring import Setup
from ...coverage.rings.ring_kinematics import seats, seen_from
from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import carried_polyhedra, robot_capsules
from ...coverage.robots.robot import Robot
from ...coverage.solids.beams import Beams
from ...coverage.solids.capsules import Capsules
from ...coverage.solids.cones import around
from ...coverage.solids.polyhedra import Polyhedron
from ...coverage.solids.segments import point_to_segment
from ...objectives.scene import Scene
from .ray_fan import Hit, ball_around, hit_capsules, hit_polyhedron, nearest_by_rays

NOTHING, ROBOT, CELL, ROD = -1, 0, 1, 2  # what a sensor reads
_FEW, _MANY = 1 << 9, 1 << 12  # pairs of beam and capsule per batch: two compilations
_PIECES = 4  # of a capsule, each in a ball, to exclude capsules outside a beam
_NEAR = 1e-6  # m


class Expected(NamedTuple):
    """Expected readings of K sensors at T joint vectors, ring by ring."""

    distance: Float[np.ndarray, "T K"]
    """m; infinite where the beam is empty."""
    what: Int[np.ndarray, "T K"]
    """``ROBOT``, ``CELL``, ``ROD`` or ``NOTHING``."""


def expected(
    scene: Scene, setup: Setup, joints: Float[np.ndarray, "T J"], rod: Capsules | None = None
) -> Expected:
    """Return the noise-free reading of every sensor of ``setup`` at every joint vector.

    Args:
        scene: with the robot's bodies (without bodies, the robot is invisible) and the obstacles.
        setup: rings as they are mounted; positions may lie beyond a link's ends.
        joints: (T, J) rad.
        rod: additional capsules, start and end (T, M, 3) m, radius (M,) m.
    """
    poses, which = np.unique(joints, axis=0, return_inverse=True)
    beams, of = beams_at(scene, setup, poses), np.repeat(np.arange(len(poses)), setup.sensors)
    found = np.full((3, len(joints), setup.sensors), np.inf)
    cell = to_cell(beams, tuple(o.body for o in scene.obstacles))
    found[CELL] = cell.reshape(len(poses), -1)[which.ravel()]
    if scene.robot.bodies:
        bodies = robot_capsules(scene.robot, forward(scene.robot.chain, poses))
        own = np.minimum(
            to_capsules(beams, of, bodies, cell), _to_carried(scene.robot, beams, of, poses)
        )
        found[ROBOT] = own.reshape(len(poses), -1)[which.ravel()]
    if rod is not None:
        every, within = np.repeat(np.arange(len(joints)), setup.sensors), found.min(axis=0).ravel()
        found[ROD] = to_capsules(beams_at(scene, setup, joints), every, rod, within).reshape(
            found[ROD].shape
        )
    distance = found.min(axis=0)
    return Expected(distance, np.where(np.isfinite(distance), found.argmin(axis=0), NOTHING))


def beams_at(scene: Scene, setup: Setup, joints: Float[np.ndarray, "T J"]) -> Beams:
    """Return the T times K beams of all sensors at all joint vectors, in the base frame."""
    here, seat = seats(scene.robot, setup.groups)
    frames = forward(scene.robot.chain, np.asarray(joints, float))
    apex, axis, up = (np.asarray(a).reshape(-1, 3) for a in seen_from(here, seat, frames, up=True))
    shapes = mapped(lambda a: np.tile(np.asarray(a), len(joints)), here.beams)
    return shapes.solids(apex, axis, up)


def only(beams: Beams, some: Any) -> Beams:
    """Select beams by a mask or by indices."""
    return mapped(lambda a: a[some], beams)


def to_cell(beams: Beams, bodies: tuple[Polyhedron, ...]) -> Float[np.ndarray, " R"]:
    """Return the distance (R,) m of the nearest of several convex bodies in each of R beams;
    infinite if none is in it, 0 inside one.
    """
    each = [to_body(beams, body) for body in bodies]
    nearest: np.ndarray = np.min(each, axis=0, initial=np.inf) + np.zeros(len(beams))
    return nearest


def _to_carried(
    robot: Robot, beams: Beams, of: Int[np.ndarray, " R"], poses: Float[np.ndarray, "P J"]
) -> Float[np.ndarray, " R"]:
    """Return the distance (R,) m of the nearest polyhedron that the robot carries in each of R
    beams at the poses ``of`` (R,); infinite if none is in it."""
    distance = np.full(len(beams), np.inf)
    for p in range(len(poses)) if robot.carried else ():
        here = np.flatnonzero(of == p)
        distance[here] = to_cell(only(beams, here), carried_polyhedra(robot, poses[p]))
    return distance


def to_body(beams: Beams, body: Polyhedron) -> Float[np.ndarray, " R"]:
    """Return the same for one body."""
    middle, size = ball_around(body)
    near = np.flatnonzero(outside(beams, middle) <= size + _NEAR)
    some, found = only(beams, near), np.full(len(beams), np.inf)
    distance = _nearest(some, lambda cones: polyhedron_in_beam(cones, body), hit_polyhedron(body))
    distance[body(some.apex) <= 0] = 0.0
    found[near] = distance
    return found


def to_capsules(
    beams: Beams,
    of: Int[np.ndarray, " R"],
    capsules: Capsules,
    within: Float[np.ndarray, " R"],
) -> Float[np.ndarray, " R"]:
    """Return the distance (R,) m of the nearest capsule in each beam. Beam r is tested against the
    capsules of ``of[r]``, with start and end (T, M, 3) m; capsules not closer than ``within`` (R,)
    m may be omitted.
    """
    found = np.full(len(beams), np.inf)
    start, end, radius = (np.asarray(a) for a in capsules.arrays())
    reach = np.linalg.norm(end - start, axis=2) / (2 * _PIECES) + radius + _NEAR
    pairs = []
    for m, thick in enumerate(radius):
        a, b = start[of, m], end[of, m]
        near = np.flatnonzero(
            np.asarray(point_to_segment(np.asarray(beams.apex), a, b)) - thick < within
        )
        some, a, b = only(beams, near), a[near], b[near]
        off = [outside(some, a + (i + 0.5) / _PIECES * (b - a)) for i in range(_PIECES)]
        pairs.append(near[np.min(off, axis=0) <= reach[of[near], m]])
    row, body = np.concatenate(pairs), np.repeat(np.arange(len(radius)), [len(p) for p in pairs])
    if len(row):
        np.minimum.at(
            found,
            row,
            in_beams(only(beams, row), start[of[row], body], end[of[row], body], radius[body]),
        )
    return found


def in_beams(
    beams: Beams,
    start: Float[np.ndarray, "R 3"],
    end: Float[np.ndarray, "R 3"],
    radius: Float[np.ndarray, " R"],
) -> Float[np.ndarray, " R"]:
    """Return the distance (R,) m of capsule r in beam r; infinite if the beam misses it."""
    rays, bodies = beams.by_rays(), (start, end, radius)
    beside = tuple(a[~rays] for a in bodies)
    size = _FEW if len(beside[0]) <= 2 * _FEW else _MANY
    return _nearest(
        beams,
        lambda cones: slabs(_capsules, (*cones, *beside), size=size),
        hit_capsules(*(a[rays] for a in bodies)),
    )


def _nearest(
    beams: Beams, in_cones: Callable[[Beam], np.ndarray], hit: Hit
) -> Float[np.ndarray, " R"]:
    """Return the distance (R,) m of bodies in beams, by one test for the cones among them, and one
    for beams that rays measure."""
    rays, found = beams.by_rays(), np.full(len(beams), np.inf)
    if not rays.all():
        looks = Beam(*(np.asarray(getattr(beams, key))[~rays] for key in Beam._fields))
        found[~rays] = in_cones(looks)
    if rays.any():
        found[rays] = nearest_by_rays(only(beams, rays), hit)
    return found


@jax.jit
def _capsules(rows: Any, fixed: Any) -> Any:
    apex, axis, half, range_m, start, end, radius = rows
    return capsule_in_beam(Beam(apex, axis, half, range_m), start, end, radius)[0]


def outside(beams: Beams, points: Any) -> Any:
    """Return a lower bound (m) on the distance of points (3,) or (R, 3) from the beams."""
    points = np.array(np.broadcast_to(points, beams.apex.shape))
    return around(beams).part(points, np.arange(len(beams)))
