"""Solids as flat faces for a ``Sheet``: circles, balls and rods, a robot with its rings, cones,
discs and hulls.
"""

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection

from ...coverage.rings.ring import Ring, Setup
from ...coverage.robots.link_bodies import robot_capsules
from ...coverage.robots.robot import Robot
from ...coverage.solids.base import Solid, Union
from ...coverage.solids.capsules import Capsules
from ...coverage.solids.cones import Cones
from ...coverage.solids.polyhedra import Polyhedron
from ...coverage.solids.spheres import Spheres
from .sheet import Sheet

_LINK, _JOINT = "#b4bbc3", "#7d8791"
_LINK_RADIUS, _JOINT_RADIUS, _FOOT, RING_WIDTH = 0.048, 0.062, 0.095, 0.04  # m


def _polygon(corners: int) -> Any:
    """Corners (T, 2) of a regular polygon in the circle of radius 1."""
    return np.array(
        [(np.cos(t), np.sin(t)) for t in np.linspace(0, 2 * np.pi, corners, endpoint=False)]
    )


DISC, _FINE_DISC = _polygon(48), _polygon(96)
_UP = np.eye(3)[2]
_THINNEST = 1e-4  # m, of what is drawn of a polyhedron


def circle(centre: Any, axis: Any, radius: float, polygon: Any = DISC) -> Any:
    """Points (T, 3) m of a circle about the unit ``axis``."""
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    return centre + radius / np.linalg.norm(u) * (polygon @ np.stack([u, np.cross(axis, u)]))


def loft(circles: Any) -> Any:
    """Faces (N, 4, 3) m between neighbouring circles (C, T, 3)."""
    turned = np.roll(circles, -1, axis=1)
    return np.stack([circles[:-1], turned[:-1], turned[1:], circles[1:]], axis=2).reshape(-1, 4, 3)


def ball(c: Any, r: float, n: int) -> Any:
    """Circles of latitude (n, T, 3) m of the ball about ``c`` (3,) of radius ``r``."""
    return np.array(
        [
            circle(c + r * np.sin(b) * _UP, _UP, r * np.cos(b))
            for b in np.pi * np.linspace(-0.5, 0.5, n)
        ]
    )


def rod(a: Any, b: Any, radius: float) -> Any:
    """Circles (C, T, 3) m from ``a`` to ``b``, close enough together to be sorted by depth."""
    return np.array(
        [circle(p, (b - a) / np.linalg.norm(b - a), radius) for p in np.linspace(a, b, 20)]
    )


def cone(apex: Any, axis: Any, half_angle: float, range_m: float, steps: int) -> Any:
    """Faces (N, 4, 3) m of a cone's side and base, in so many steps along its side that cones which
    cross can be sorted by depth."""
    share, tangent = np.linspace(1e-3, 1, steps + 1), np.tan(half_angle)
    side = [(apex + range_m * t * axis, range_m * t * tangent) for t in share]
    base = [(apex + range_m * axis, range_m * t * tangent) for t in share[::-3]]
    return loft(np.array([circle(c, axis, r, _FINE_DISC) for c, r in side + base]))


def disc(centre: Any, axis: Any, radius: float) -> Any:
    """Faces (N, 4, 3) m of a filled disc."""
    return loft(np.array([circle(centre, axis, r, _FINE_DISC) for r in (1e-3 * radius, radius)]))


def body(robot: Robot, frames: Any) -> Any:
    """Centreline (P, 3) m of the links' bodies: joint origins, and the mount axes where links have
    them.
    """
    points = [np.zeros(3)]
    for j, T in enumerate(frames):
        ends = [m.start + t * m.axis for m in robot.mounts if m.frame == j for t in (0.0, m.length)]
        points += [T[:3, :3] @ p + T[:3, 3] for p in (np.zeros(3), *ends)]
    return np.array(
        [p for i, p in enumerate(points) if i == 0 or np.linalg.norm(p - points[i - 1]) > 1e-6]
    )


def capsule(a: Any, b: Any, radius: float) -> Any:
    """Circles (C, T, 3) m of the capsule of ``radius`` about the segment from ``a`` to ``b``, close
    together as of a rod.
    """
    length = float(np.linalg.norm(b - a))
    axis = (b - a) / length if length > 1e-9 else _UP
    bend = np.pi / 2 * np.linspace(0.02, 1, 7)
    place = np.concatenate(
        [
            -radius * np.cos(bend),
            np.linspace(0, length, 12)[1:-1],
            length + radius * np.cos(bend[::-1]),
        ]
    )
    wide = radius * np.concatenate([np.sin(bend), np.ones(10), np.sin(bend[::-1])])
    return np.array([circle(a + t * axis, axis, r) for t, r in zip(place, wide, strict=True)])


def band(robot: Robot, frames: Any, ring: Ring, width: float = RING_WIDTH) -> Any:
    """Circles (2, T, 3) m of a ring, so wide along its axis, on a robot with ``frames``
    T_base_frame (F, 4, 4).
    """
    m = robot.mount(ring.link)
    R, origin = frames[m.frame][:3, :3], frames[m.frame][:3, 3]
    ends = [m.start + (ring.position * m.length + t) * m.axis for t in (-width / 2, width / 2)]
    return np.array([circle(origin + R @ end, R @ m.axis, ring.radius) for end in ends])


def add_robot(
    sheet: Sheet,
    robot: Robot,
    frames: Any,
    setup: Setup,
    colour: dict[str, str],
    real: bool = False,
    width: float = RING_WIDTH,
) -> None:
    """Add the robot's links, joints and foot, and its rings in the colours of their links.

    Args:
        frames: T_base_frame (F, 4, 4) from ``forward``.
        real: draw the robot's bodies, if it has any, and not a stick along its joints and mounts.
        width: of a ring along its axis, m.
    """
    if real and robot.bodies:
        _add_bodies(sheet, robot, frames)
    else:
        _add_stick(sheet, robot, frames)
    for ring in setup.rings:
        sheet.surface(loft(band(robot, frames, ring, width)), colour[ring.link])


def _add_bodies(sheet: Sheet, robot: Robot, frames: Any) -> None:
    bodies = robot_capsules(robot, frames)
    for a, b, r in zip(bodies.start, bodies.end, bodies.radius, strict=True):
        sheet.surface(loft(capsule(a, b, float(r))), _LINK)


def _add_stick(sheet: Sheet, robot: Robot, frames: Any) -> None:
    line = body(robot, frames)
    for a, b in pairwise(line):
        sheet.surface(loft(rod(a, b, _LINK_RADIUS)), _LINK)
    foot = np.array(
        [
            circle(line[0] + height * _UP, _UP, r)
            for height, r in ((0, _FOOT), (0.03, _FOOT), (0.03, 0.001))
        ]
    )
    for circles in (foot, *(ball(p, _JOINT_RADIUS, 13) for p in line[1:-1])):
        sheet.surface(loft(circles), _JOINT)


def rim_of(cones: Cones, k: int, length: float) -> Any:
    """Points (_, 3) m around beam ``k`` at ``length`` m along its axis: a circle, or a square
    beam's corners.
    """
    centre, corners = cones.apex[k] + length * cones.axis[k], cones.corners_across(k, length)
    if len(corners):
        return centre + corners
    return circle(centre, cones.axis[k], float(length * np.tan(cones.half_angle[k])))


def lengths_within(cones: Cones, outer: Solid) -> Any:
    """Length (K,) m at which each cone is drawn: where its axis leaves the target for the last
    time, at most its range.
    """
    share = np.linspace(0, 1, 61)[1:]
    points = (
        cones.apex[:, None] + (share[:, None] * cones.range_m[:, None, None]) * cones.axis[:, None]
    )
    inside = outer(points.reshape(-1, 3)).reshape(points.shape[:2]) <= 0.02
    return cones.range_m * np.where(inside, share, 0.1).max(axis=1)


def faces_within(body: Polyhedron, box: Any, longest: float) -> Any:
    """Faces (N, 4, 3) m of what of a polyhedron lies in the box (2, 3) m, triangles with a corner
    twice and edges up to ``longest`` m; none where that is nothing."""
    normal = np.concatenate([np.asarray(body.normal), np.eye(3), -np.eye(3)])
    offset = np.concatenate([np.asarray(body.offset), box[1], -box[0]])
    middle = linprog(
        [0, 0, 0, -1],
        np.column_stack([normal, np.ones(len(normal))]),
        offset,
        bounds=[(None, None)] * 4,
    )
    if not middle.success or middle.x[3] < _THINNEST:
        return np.zeros((0, 4, 3))
    corners = HalfspaceIntersection(np.column_stack([normal, -offset]), middle.x[:3]).intersections
    tri = corners[ConvexHull(corners).simplices]
    while np.linalg.norm(tri - np.roll(tri, 1, axis=1), axis=2).max() > longest:
        a, b, c = np.moveaxis(tri, 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        tri = np.concatenate(
            [np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    return tri[:, [0, 1, 2, 2]]


def convex_pieces(outer: Any) -> list[Any]:
    """Point sets (_, 3) m whose convex hulls together make a target's outer solid: balls, capsules
    and a tube.
    """
    if isinstance(outer, Union):
        return convex_pieces(outer.a) + convex_pieces(outer.b)
    if isinstance(outer, Spheres):
        return [
            ball(c, r, 41).reshape(-1, 3) for c, r in zip(outer.centre, outer.radius, strict=True)
        ]
    if isinstance(outer, Capsules):
        ends = zip(outer.start, outer.end, outer.radius, strict=True)
        return [np.concatenate([ball(c, r, 21).reshape(-1, 3) for c in (a, b)]) for a, b, r in ends]
    discs = [circle(c, n, outer.radius) for c, n in zip(outer.centre, outer.normal, strict=True)]
    return [np.concatenate([discs[i], discs[i + 1]]) for i in outer.first]
