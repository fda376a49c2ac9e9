"""SRDF, MoveIt's description beside a URDF: the arm, its pose, and pairs of links that need no
collision check."""

import itertools
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring_envelope import Envelope
from ...coverage.robots.kinematics import forward
from ...coverage.robots.robot import BASE, Robot
from ...coverage.solids.capsules import Capsules
from .markup import document, words
from .placed import TCP_LINK, PlacedSetup
from .ring_bodies import RingBody, envelope_mesh, hull_mesh, ring_bodies
from .urdf import attached_name

_GROUP = "arm"


def srdf(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``robot.srdf`` for ``robot.urdf``.

    It excludes each ring from checks against its own link, and against what it touches in all or in
    no sampled poses. For a robot made of the chain it does the same for the links, and excludes
    links with a common joint. The links of a user's own URDF are left to the user's own SRDF.

    Raises:
        UserError: if the user's URDF lacks the robot's chain.
    """
    own, picked = placed.urdf, placed.picked
    root = ET.Element("robot", name=placed.robot_name if own is None else own.name)
    group = ET.SubElement(root, "group", name=_GROUP)
    tip = TCP_LINK if own is None else placed.links[-1]
    ET.SubElement(group, "chain", base_link=placed.carrier(BASE), tip_link=tip)
    state = ET.SubElement(root, "group_state", name="pose", group=_GROUP)
    follows = {m.joint for m in placed.scene.robot.chain.mimics}
    names = placed.joint_names if picked is None else picked.chain.joints
    for j, name in enumerate(names):
        if j not in follows:
            value = words([placed.scene.poses[placed.pose].q[j]])
            ET.SubElement(state, "joint", name=name, value=value)
    for (one, other), reason in _pairs(placed).items():
        ET.SubElement(root, "disable_collisions", link1=one, link2=other, reason=reason)
    return {"robot.srdf": document(root)}


def _pairs(placed: PlacedSetup) -> dict[tuple[str, str], str]:
    """Return pairs of links and rings by their names, each with the reason to leave it out."""
    rings = {ring.name: ring_solid(ring) for ring in ring_bodies(placed)}
    links = {str(joint): solid for joint, solid in link_solids(placed).items()}
    bare = {joint: LinkSolid(joint, ()) for joint in {r.joint for r in rings.values()}}
    links |= {str(j): solid for j, solid in bare.items() if str(j) not in links}
    pairs = dict[tuple[str, str], str]()
    for (one, other), reason in contacts(links | rings, sampled_frames(placed.scene.robot)).items():
        if one in rings or other in rings:
            for a in _names(placed, one):
                pairs |= {(a, b): reason for b in _names(placed, other)}
        elif placed.urdf is None:
            pairs[placed.carrier(int(one)), placed.carrier(int(other))] = reason
    if placed.urdf is None:
        for low, high in itertools.pairwise(sorted(map(int, links))):
            if high - low == 1:
                pairs[placed.carrier(low), placed.carrier(high)] = "Adjacent"
    return pairs


def _names(placed: PlacedSetup, solid: str) -> list[str]:
    """Return the names of the links that a solid stands for: a ring's own, or those that are fixed
    to the link which a joint moves."""
    if solid.startswith("ring_"):
        return [solid]
    joint = int(solid)
    if placed.picked is None:
        return [placed.carrier(joint)]
    robot = placed.scene.robot
    moved, last = placed.picked.carried, len(robot.chain) - 1
    there = [c.link.name for c in moved if min(c.frame, last) == joint and c.link.collision]
    own = robot.bodies[len(robot.unladen.bodies) :] if robot.unladen is not None else ()
    attached = {b.frame for b in own} | {c.frame for c in robot.carried}
    there += [attached_name(f) for f in sorted(attached) if min(f, last) == joint]
    return there


_POSES = 1000  # sampled poses
_STEP = 0.02  # m, between points of an axis
_EDGE = 0.03  # m, longest edge of the triangles whose corners stand for a surface
_SLIDE = 1.0  # m, to which a prismatic joint without limits is sampled


@dataclass(frozen=True)
class LinkPart:
    """A solid part of a link: all within ``radius`` of its points, up to ``slack``."""

    points: Float[np.ndarray, "N 3"]
    """Points, m: of the axis of a capsule, or of the surface."""
    radius: float
    """Radius of a capsule, m; 0 for surfaces."""
    slack: float
    """Largest distance of a point of the axis or the surface from ``points``, m."""
    distance: Callable[[Any], Any]
    """Distance of points (..., 3) m from the shape, or less; at most 0 inside."""
    exact: bool
    """Whether ``distance`` is the distance."""

    @property
    def is_axis(self) -> bool:
        return self.radius > 0


@dataclass(frozen=True)
class LinkSolid:
    """A link or a ring: shapes on the link that a joint moves, in that link's frame."""

    joint: int
    """Joint that moves it, or ``BASE``."""
    shapes: tuple[LinkPart, ...]
    """Its parts."""


def link_solids(placed: PlacedSetup) -> dict[int, LinkSolid]:
    """Return the links that have bodies, by the joints that move them."""
    robot, last = placed.scene.robot, len(placed.scene.robot.chain) - 1
    shapes: dict[int, list[LinkPart]] = {}
    for body in robot.bodies:
        T = robot.chain.origin[-1] if body.frame > last else np.eye(4)
        shapes.setdefault(min(body.frame, last), []).append(_capsule(body.capsule, T))
    for carried in robot.carried:
        T = robot.chain.origin[-1] if carried.frame > last else np.eye(4)
        shapes.setdefault(min(carried.frame, last), []).append(_polyhedron(carried.body, T))
    return {joint: LinkSolid(joint, tuple(some)) for joint, some in sorted(shapes.items())}


def ring_solid(ring: RingBody) -> LinkSolid:
    """Return a ring as its envelope."""
    T, points = ring.T_link_ring, _surface(envelope_mesh(ring.envelope))
    back = np.linalg.inv(T)

    def distance(p: Any) -> Any:
        return _envelope_distance(ring.envelope, p @ back[:3, :3].T + back[:3, 3])

    shape = LinkPart(points @ T[:3, :3].T + T[:3, 3], 0.0, _EDGE, distance, exact=True)
    return LinkSolid(ring.joint, (shape,))


def _envelope_distance(around: Envelope, p: Any) -> Any:
    """Return the distance (...) m of points (..., 3) m from an envelope about z."""
    along, off = p[..., 2], np.hypot(p[..., 0], p[..., 1])
    zero = np.zeros_like(off)
    each = [
        np.hypot(
            np.maximum.reduce([along - b.high, b.low - along, zero]),
            np.maximum.reduce([off - b.outer, around.bore - off, zero]),
        )
        for b in around.bands
    ]
    return np.minimum.reduce(each)


def _capsule(capsule: Capsules, T: Float[np.ndarray, "4 4"]) -> LinkPart:
    start, end = (T[:3, :3] @ np.asarray(p) + T[:3, 3] for p in (capsule.start, capsule.end))
    steps = int(np.linalg.norm(end - start) / _STEP) + 2
    points = start + np.linspace(0, 1, steps)[:, None] * (end - start)
    solid = Capsules(start, end, capsule.radius)
    return LinkPart(points, float(capsule.radius), _STEP / 2, solid.distance, exact=True)


def _polyhedron(body: Any, T: Float[np.ndarray, "4 4"]) -> LinkPart:
    points, back = _surface(hull_mesh(body)) @ T[:3, :3].T + T[:3, 3], np.linalg.inv(T)

    def distance(p: Any) -> Any:
        return body(p @ back[:3, :3].T + back[:3, 3])

    return LinkPart(points, 0.0, _EDGE, distance, exact=False)


def _surface(mesh: Any) -> Float[np.ndarray, "N 3"]:
    """Return points of a mesh such that each point of its surface is within ``_EDGE`` of one."""
    import trimesh  # slow to load

    points, _ = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, _EDGE, max_iter=20)
    return np.unique(np.round(np.asarray(points, float), 9), axis=0)


def sampled_frames(robot: Robot) -> Float[np.ndarray, "Q F 4 4"]:
    """Return the robot's frames at poses drawn within its limits, the base's last, m."""
    low = np.where(robot.chain.slides, -_SLIDE, -np.pi)
    high = -low
    if robot.limits is not None:
        low = np.where(np.isfinite(robot.limits[:, 0]), robot.limits[:, 0], low)
        high = np.where(np.isfinite(robot.limits[:, 1]), robot.limits[:, 1], high)
    q = np.random.default_rng(0).uniform(low, np.maximum(low, high), (_POSES, len(low)))
    frames = np.asarray(forward(robot.chain, robot.chain.settled(q)))
    return np.concatenate([frames, np.tile(np.eye(4), (_POSES, 1, 1, 1))], axis=1)


def contacts(
    solids: Mapping[str, LinkSolid], frames: Float[np.ndarray, "Q F 4 4"]
) -> dict[tuple[str, str], str]:
    """Return pairs of solids that need no collision check, each with its reason.

    ``Adjacent``: both are fixed to the same link. ``Never``: they are apart in all poses.
    ``Always``: they touch in all poses. Two that touch in some poses only are not among them.

    Args:
        solids: links and rings by name.
        frames: from ``sampled_frames``.
    """
    names, reasons = list(solids), dict[tuple[str, str], str]()
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            a, b = solids[one], solids[other]
            if a.joint == b.joint:
                reasons[one, other] = "Adjacent"
                continue
            T_a_b = np.linalg.inv(frames[:, a.joint]) @ frames[:, b.joint]
            apart, touching = _relation(a, b, T_a_b)
            if apart.all():
                reasons[one, other] = "Never"
            elif touching.all():
                reasons[one, other] = "Always"
    return reasons


def _relation(a: LinkSolid, b: LinkSolid, T_a_b: Float[np.ndarray, "Q 4 4"]) -> tuple[Any, Any]:
    """Return whether two solids are surely apart (Q,) and surely touch (Q,) in each pose."""
    apart, touching = np.ones(len(T_a_b), bool), np.zeros(len(T_a_b), bool)
    T_b_a = np.linalg.inv(T_a_b)
    for x in a.shapes:
        for y in b.shapes:
            if y.is_axis and not x.is_axis:
                gap = _nearest(x, y, T_a_b)
                points, solid = y, x
            else:
                gap = _nearest(y, x, T_b_a)
                points, solid = x, y
            apart &= gap > points.radius + points.slack
            touching |= gap <= (points.radius if solid.exact else 0.0)
    return apart, touching


def _nearest(
    solid: LinkPart, points: LinkPart, T_solid_points: Float[np.ndarray, "Q 4 4"]
) -> Float[np.ndarray, " Q"]:
    """Return the least distance of a shape's points from another shape in each pose, m."""
    R, t = T_solid_points[:, :3, :3], T_solid_points[:, :3, 3]
    moved = points.points @ np.swapaxes(R, 1, 2) + t[:, None]  # (Q, N, 3)
    least: np.ndarray = np.asarray(solid.distance(moved)).min(axis=1)
    return least
