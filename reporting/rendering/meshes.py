"""Meshes of solids: circles, balls, rods, capsules, cones, rings and hulls."""

import itertools
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.arrays import cross
from ...coverage.rings.ring import Ring
from ...coverage.robots.near_volume import GrownPolyhedron
from ...coverage.robots.robot import Robot
from ...coverage.solids.base import Difference, Intersection, Solid, Union
from ...coverage.solids.beams import Beams
from ...coverage.solids.capsules import Capsules
from ...coverage.solids.polyhedra import Polyhedra, Polyhedron
from ...coverage.solids.spheres import Spheres
from ...coverage.solids.swept_tube import Tube
from ...objectives.feasibility.ring_envelopes import envelope
from ...objectives.scene import Scene
from .surface import Surface

_RING_WIDTH = 0.04  # m
_MOST_PLANES = 30  # of a polyhedron whose edges are drawn; others are drawn as their box


def _polygon(corners: int) -> Any:
    """Return the corners (T, 2) of a regular polygon in the circle of radius 1."""
    return np.array(
        [(np.cos(t), np.sin(t)) for t in np.linspace(0, 2 * np.pi, corners, endpoint=False)]
    )


DISC, FINE_DISC = _polygon(48), _polygon(96)
_UP = np.eye(3)[2]
_FLAT = 0.98  # least cosine of the angle between faces that make no edge
_THINNEST = 1e-4  # m, thinner parts of a polyhedron are not drawn


def circle(centre: Any, axis: Any, radius: float, polygon: Any = DISC) -> Any:
    """Return points (T, 3) m of a circle about the unit vector ``axis``."""
    return circles(np.asarray(centre)[None], axis, radius, polygon)[0]


def circles(centre: Any, axis: Any, radius: Any, polygon: Any = DISC) -> Any:
    """Return points (C, T, 3) m of circles about one unit vector ``axis``.

    Args:
        centre: centres (C, 3) m.
        axis: their axis.
        radius: their radii, m: one number or (C,).
        polygon: points (T, 2) of a circle of radius 1.
    """
    u = cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    wide = radius / np.linalg.norm(u) * np.ones(len(centre))
    return centre[:, None] + wide[:, None, None] * (polygon @ np.stack([u, cross(axis, u)]))


def tube(circles: Float[np.ndarray, "C T 3"]) -> Surface:
    """Return the smoothly shaded surface between consecutive circles, which share their vertices.

    Triangles turn anti-clockwise as seen from outside if the circles are ordered along their axes.
    """
    c, t = circles.shape[:2]
    i, j = np.meshgrid(np.arange(c - 1), np.arange(t), indexing="ij")
    a, b = i * t + j, i * t + (j + 1) % t
    faces = np.stack([np.stack([a, b, b + t], -1), np.stack([a, b + t, a + t], -1)], axis=2)
    return circles.reshape(-1, 3), faces.reshape(-1, 3)


def loops(circles: Float[np.ndarray, "C T 3"]) -> Float[np.ndarray, "E 2 3"]:
    """Return the edges of closed lines."""
    return np.stack([circles, np.roll(circles, -1, axis=1)], axis=2).reshape(-1, 2, 3)


def joined(some: list[Surface]) -> Surface:
    """Join several surfaces into one."""
    first = np.cumsum([0, *(len(v) for v, _ in some)])
    if not some:
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    return np.concatenate([v for v, _ in some]), np.concatenate(
        [f + n for (_, f), n in zip(some, first, strict=False)]
    )


def closed(circles: Float[np.ndarray, "C T 3"]) -> Surface:
    """Return the surface between consecutive circles, with each end closed at its centre."""
    low, high = (np.broadcast_to(c.mean(axis=0), (1, *c.shape)) for c in (circles[0], circles[-1]))
    return tube(np.concatenate([low, circles, high]))


def ball(c: Any, r: float, n: int) -> Any:
    """Return circles of latitude (n, T, 3) m of the ball of radius ``r`` m about ``c`` (3,) m."""
    b = np.pi * np.linspace(-0.5, 0.5, n)
    return circles(c + (r * np.sin(b))[:, None] * _UP, _UP, r * np.cos(b))


def rod(a: Any, b: Any, radius: float) -> Any:
    """Return evenly spaced circles (C, T, 3) m from ``a`` to ``b``."""
    return circles(np.linspace(a, b, 20), (b - a) / np.linalg.norm(b - a), radius)


def cone(apex: Any, axis: Any, half_angle: float, range_m: float) -> Surface:
    """Return the side and the base of a cone, with a crease between them."""
    base, wide = apex + range_m * axis, range_m * np.tan(half_angle)
    near, rim, middle = (
        circle(c, axis, r, FINE_DISC)
        for c, r in ((apex, 1e-3 * wide), (base, wide), (base, 1e-3 * wide))
    )
    return joined([tube(np.stack([near, rim])), tube(np.stack([rim, middle]))])


def body(robot: Robot, frames: Any) -> Any:
    """Return the centreline (P, 3) m of the links' bodies.

    It connects joint origins, and follows the mount axes of links that have them.
    """
    points = [np.zeros(3)]
    for j, T in enumerate(frames):
        ends = [m.start + t * m.axis for m in robot.mounts if m.frame == j for t in (0.0, m.length)]
        points += [T[:3, :3] @ p + T[:3, 3] for p in (np.zeros(3), *ends)]
    return np.array(
        [p for i, p in enumerate(points) if i == 0 or np.linalg.norm(p - points[i - 1]) > 1e-6]
    )


def capsule(a: Any, b: Any, radius: float) -> Any:
    """Return circles (C, T, 3) m of the capsule of ``radius`` m about the segment from ``a`` to
    ``b``.
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
    return circles(a + place[:, None] * axis, axis, wide)


def capsule_surfaces(
    capsules: Capsules, surface: Callable[[Any], Surface] = closed
) -> list[Surface]:
    """Return the surface of each capsule, by default with its ends closed."""
    each = zip(capsules.start, capsules.end, capsules.radius, strict=True)
    return [surface(capsule(a, b, float(r))) for a, b, r in each]


def band(scene: Scene, frames: Any, ring: Ring) -> Any:
    """Return the two edge circles (2, T, 3) m of a ring, through its sensors.

    A real ring is drawn from one end of its envelope to the other, any other one 4 cm wide.

    Args:
        scene: scene of the ring.
        frames: T_base_frame (F, 4, 4).
        ring: ring to draw.
    """
    m, sides = scene.robot.mount(ring.link), (-_RING_WIDTH / 2, _RING_WIDTH / 2)
    if scene.real:
        around = envelope(scene, ring)
        sides = around.low, around.high
    R, origin = frames[m.frame][:3, :3], frames[m.frame][:3, 3]
    ends = [m.start + (ring.position * m.length + t) * m.axis for t in sides]
    return circles(np.array([origin + R @ end for end in ends]), R @ m.axis, ring.radius)


def rim_of(cones: Beams, k: int, length: float) -> Any:
    """Return points (_, 3) m around beam ``k`` at ``length`` m along its axis.

    They form a circle, or the corners of a square beam.
    """
    centre, corners = cones.apex[k] + length * cones.axis[k], cones.corners_across(k, length)
    if len(corners):
        return centre + corners
    return circle(centre, cones.axis[k], float(length * np.tan(cones.half_angle[k])))


def lengths_within(cones: Beams, outer: Solid) -> Any:
    """Return the length (K,) m at which each cone is drawn.

    It ends where its axis leaves the target for the last time, but not beyond its range.
    """
    share = np.linspace(0, 1, 61)[1:]
    points = (
        cones.apex[:, None] + (share[:, None] * cones.range_m[:, None, None]) * cones.axis[:, None]
    )
    inside = outer(points.reshape(-1, 3)).reshape(points.shape[:2]) <= 0.02
    return cones.range_m * np.where(inside, share, 0.1).max(axis=1)


def faces_of(body: Polyhedron) -> Any:
    """Return triangles (N, 3, 3) m of a bounded polyhedron."""
    from scipy.spatial import ConvexHull

    corners = np.asarray(body.edges).reshape(-1, 3)
    return corners[ConvexHull(corners).simplices]


def faces_within(body: Polyhedron, box: Any) -> Any:
    """Return triangles (N, 3, 3) m of the part of a polyhedron inside the box (2, 3) m; may be
    empty.
    """
    from scipy.optimize import linprog
    from scipy.spatial import ConvexHull, HalfspaceIntersection

    normal = np.concatenate([np.asarray(body.normal), np.eye(3), -np.eye(3)])
    offset = np.concatenate([np.asarray(body.offset), box[1], -box[0]])
    middle = linprog(
        [0, 0, 0, -1],
        np.column_stack([normal, np.ones(len(normal))]),
        offset,
        bounds=[(None, None)] * 4,
    )
    if not middle.success or middle.x[3] < _THINNEST:
        return np.zeros((0, 3, 3))
    corners = HalfspaceIntersection(np.column_stack([normal, -offset]), middle.x[:3]).intersections
    return corners[ConvexHull(corners).simplices]


def polyhedra_edges(bodies: Polyhedra) -> Float[np.ndarray, "E 2 3"]:
    """Return the edges (E, 2, 3) m of polyhedra inside their box.

    An edge joins two corners that lie on the same two planes.
    """
    low, high = bodies.bounds()
    edges = []
    for normal, offset in zip(np.asarray(bodies.normal), np.asarray(bodies.offset), strict=True):
        real = np.linalg.norm(normal, axis=1) > 0
        planes = np.concatenate([normal[real], np.eye(3), -np.eye(3)])
        offsets = np.concatenate([offset[real], high, -low])
        if len(planes) > _MOST_PLANES:
            planes, offsets = planes[-6:], offsets[-6:]
        three = np.array(list(itertools.combinations(range(len(planes)), 3)))
        three = three[np.abs(np.linalg.det(planes[three])) > 1e-6]
        corners = np.linalg.solve(planes[three], offsets[three][..., None])[..., 0]
        corners = corners[(corners @ planes.T <= offsets + 1e-7).all(axis=1)]
        corners = np.unique(np.round(corners, 7), axis=0)
        on = np.abs(corners @ planes.T - offsets) <= 1e-6  # (C, M)
        one, other = np.triu_indices(len(corners), 1)
        shared = (on[one] & on[other]).sum(axis=1) >= 2
        edges.append(np.stack([corners[one[shared]], corners[other[shared]]], axis=1))
    return np.concatenate(edges)


def box_corners(box: Any) -> Any:
    """Return the eight corners (8, 3) m of an axis-aligned box (2, 3) m."""
    return np.array(list(itertools.product(*np.asarray(box).T)))


def convex_pieces(outer: Any) -> list[Any]:
    """Return point sets (_, 3) m whose convex hulls together form a target's outer solid.

    They are balls, capsules, tubes and grown polyhedra; other solids, and parts that an
    intersection or a difference cuts, are contained in the boxes that are returned for them.
    """
    if isinstance(outer, GrownPolyhedron):
        corners = np.unique(np.round(np.concatenate([outer.a.start, outer.a.end]), 9), axis=0)
        return [np.concatenate([ball(c, outer.a.radius[0], 21).reshape(-1, 3) for c in corners])]
    if isinstance(outer, Union):
        return convex_pieces(outer.a) + convex_pieces(outer.b)
    if isinstance(outer, Difference | Intersection):
        return convex_pieces(outer.a)
    if not isinstance(outer, Spheres | Capsules | Tube):
        return [box_corners(outer.bounds())]
    if isinstance(outer, Spheres):
        return [
            ball(c, r, 41).reshape(-1, 3) for c, r in zip(outer.centre, outer.radius, strict=True)
        ]
    if isinstance(outer, Capsules):
        ends = zip(outer.start, outer.end, outer.radius, strict=True)
        return [np.concatenate([ball(c, r, 21).reshape(-1, 3) for c in (a, b)]) for a, b, r in ends]
    discs = [circle(c, n, outer.radius) for c, n in zip(outer.centre, outer.normal, strict=True)]
    return [np.concatenate([discs[i], discs[i + 1]]) for i in outer.first]


def sharp_edges(faces: Float[np.ndarray, "N 3 3"]) -> Float[np.ndarray, "E 2 3"]:
    """Return the edges (E, 2, 3) m of a closed convex surface of triangles at which it bends."""
    sides: dict[tuple[bytes, bytes], list[int]] = defaultdict(list)
    ends: dict[tuple[bytes, bytes], np.ndarray] = {}
    middle = faces.reshape(-1, 3).mean(axis=0) if len(faces) else np.zeros(3)
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    normal *= np.where(((faces.mean(axis=1) - middle) * normal).sum(axis=1) < 0, -1, 1)[:, None]
    for i, corners in enumerate(np.round(faces, 7) + 0.0):
        for a, b in ((0, 1), (1, 2), (2, 0)):
            keys = corners[a].tobytes(), corners[b].tobytes()
            key = min(keys), max(keys)
            sides[key].append(i)
            ends[key] = corners[[a, b]]
    sharp = [ends[key] for key, two in sides.items() if (normal[two] @ normal[two].T).min() < _FLAT]
    return np.array(sharp).reshape(-1, 2, 3)
