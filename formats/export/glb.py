"""GLB: a 3D scene with robot, obstacles, rings, sensors, their beams, and points of the targets."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from trimesh.visual.material import PBRMaterial

from ...coverage.rings.ring import Ring
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.link_bodies import attached_at, carried_at
from ...coverage.robots.robot import BASE
from ...coverage.solids.beams import Beams
from ...objectives.feasibility.ring_envelopes import envelope
from ...objectives.occlusion import setup_sight
from ..robots.meshes import Meshes
from ..robots.urdf_matching import plain_names
from .glb_animation import animated
from .palette import COVERED_ONCE, OBSTACLE, ROBOT, SENSOR, UNCOVERED, link_colours
from .placed import BASE_LINK, TCP_LINK, PlacedSetup
from .ring_bodies import envelope_mesh, hull_mesh

_CLEAR = 0.13  # opacity of beams
_BAND = 0.004  # m, radius of a ring's tube
_UNIT = (0.006, 0.008)  # m, displayed radius and length of a sensor
_SIDES = 32
_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # glTF has y up


def glb(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``scene.glb``: the node ``base_link`` is the base frame; nodes with sensor names look
    along their z axis. A node for each joint carries what moves with it; if the scene has several
    poses, an animation moves these nodes through them."""
    scene, nodes = trimesh.Scene(base_frame="world"), _nodes(placed)
    scene.graph.update(frame_to=BASE_LINK, matrix=_Y_UP)
    parents = [BASE_LINK, *nodes]
    T_base_parent = np.concatenate([np.eye(4)[None], placed.T_base_frame[:-1]])
    for name, parent, T, before in zip(
        nodes, parents, placed.T_base_frame, T_base_parent, strict=False
    ):
        scene.graph.update(frame_to=name, frame_from=parent, matrix=np.linalg.inv(before) @ T)
    for part in _parts(placed):
        _add(scene, placed, nodes, part)
    unit = trimesh.creation.cylinder(_UNIT[0], _UNIT[1], sections=16)
    unit.visual = trimesh.visual.TextureVisuals(material=_material(SENSOR))
    for s in placed.sensors:
        scene.add_geometry(
            unit,
            node_name=s.name,
            geom_name="sensor",
            parent_node_name=_node(nodes, s.frame),
            transform=s.T_frame_sensor,
        )
    _add_points(scene, placed)
    data = scene.export(file_type="glb")
    if len(placed.scene.poses) > 1:
        chain = placed.scene.robot.chain
        data = animated(data, nodes[: len(chain)], chain, placed.scene.poses)
    return {"scene.glb": data}


@dataclass(frozen=True)
class _Part:
    """A mesh of the scene."""

    name: str
    """Name of its node."""
    mesh: Any
    """The mesh in the base frame."""
    frame: int = BASE
    """Frame that carries it."""
    colour: str = ROBOT
    """Colour as ``#rrggbb``."""
    opacity: float = 1.0
    """Opacity."""


def _nodes(placed: PlacedSetup) -> tuple[str, ...]:
    """Return names of the nodes of the joints' frames, and of the TCP."""
    taken = ["world", BASE_LINK, TCP_LINK, *(s.name for s in placed.sensors)]
    return (*plain_names(placed.links, taken), TCP_LINK)


def _node(nodes: tuple[str, ...], frame: int) -> str:
    return BASE_LINK if frame == BASE else nodes[frame]


def _parts(placed: PlacedSetup) -> Iterator[_Part]:
    """Yield the meshes of the robot, its cell and its rings."""
    robot = placed.scene.robot
    yield from _robot(placed)
    for i, obstacle in enumerate(placed.scene.obstacles):
        if np.size(obstacle.body.edges):
            yield _Part(f"obstacle_{i}", hull_mesh(obstacle.body), colour=OBSTACLE)
    for i, body in enumerate(carried_at(robot, placed.T_base_frame)):
        yield _Part(f"attached_{i}", hull_mesh(body), robot.carried[i].frame)
    capsules = attached_at(robot, placed.T_base_frame)
    if placed.urdf is not None and capsules is not None:  # without a URDF they are among the bodies
        own = robot.bodies[-len(capsules) :]
        ends = zip(own, capsules.start, capsules.end, capsules.radius, strict=True)
        for i, (owner, a, b, radius) in enumerate(ends):
            yield _Part(f"attached_capsule_{i}", _capsule(a, b, float(radius)), owner.frame)
    whole = placed.scene.with_cell(placed.setup)
    cones = sensor_cones(robot, whole, placed.scene.poses[placed.pose].q)
    frames = np.array([s.frame for s in placed.sensors], int)
    colours = link_colours([mount.link for mount in robot.mounts])
    for i, group in enumerate(whole.groups):
        colour, ring = colours.get(getattr(group, "link", ""), SENSOR), isinstance(group, Ring)
        some = np.flatnonzero(whole.ring_of_sensor == i)
        frame = int(frames[some[0]])
        if ring:
            yield from _ring(placed, i, frame, colour)
        beams = trimesh.util.concatenate([_beam(cones, k) for k in some.tolist()])
        yield _Part(f"{'ring' if ring else 'sensor'}_{i}_sees", beams, frame, colour, _CLEAR)


def _rgba(colour: str, opacity: float = 1.0) -> Any:
    parts = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return np.array([*parts, round(255 * opacity)], np.uint8)


def _material(colour: str, opacity: float = 1.0) -> Any:
    clear = opacity < 1
    return PBRMaterial(
        baseColorFactor=_rgba(colour, opacity),
        metallicFactor=0.0,
        roughnessFactor=0.8,
        alphaMode="BLEND" if clear else "OPAQUE",
        doubleSided=clear,
    )


def _add(scene: Any, placed: PlacedSetup, nodes: tuple[str, ...], part: _Part) -> None:
    """Add a mesh to the node of its frame."""
    mesh = part.mesh.copy().apply_transform(np.linalg.inv(placed.at_pose(part.frame)))
    mesh.visual = trimesh.visual.TextureVisuals(material=_material(part.colour, part.opacity))
    names = {"node_name": part.name, "geom_name": part.name}
    scene.add_geometry(mesh, parent_node_name=_node(nodes, part.frame), **names)


def _robot(placed: PlacedSetup) -> Iterator[_Part]:
    """Yield meshes at the pose: those of the user's URDF if there is one, else the bodies."""
    if placed.picked is not None:
        urdf, parts = placed.picked.urdf, placed.picked.carried
        meshes = Meshes(urdf.path, placed.packages, placed.package, urdf.addresses)
        names = plain_names(c.link.name for c in parts)
        for carried, name in zip(parts, names, strict=True):
            triangles = meshes.surface(carried, "visual")
            T = placed.T_base_frame[carried.frame] if carried.frame != BASE else placed.T_base_root
            if len(triangles):
                mesh = trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles), process=True)
                yield _Part(f"body_{name}", mesh.apply_transform(T), carried.frame)
        return
    if placed.bodies is None:
        return
    own = placed.scene.robot.bodies
    names, bodies = plain_names(b.name for b in own), placed.bodies
    for body, name, a, b, radius in zip(
        own, names, bodies.start, bodies.end, bodies.radius, strict=True
    ):
        yield _Part(f"body_{name}", _capsule(a, b, float(radius)), body.frame)


def _capsule(start: Any, end: Any, radius: float) -> Any:
    length = float(np.linalg.norm(end - start))
    made = trimesh.creation.capsule(length, radius, count=[24, 24])
    made.apply_translation([0, 0, length / 2 - float(made.bounds.mean(axis=0)[2])])
    T = (
        trimesh.geometry.align_vectors([0, 0, 1], (end - start) / length)
        if length > 0
        else np.eye(4)
    )
    T[:3, 3] = start
    return made.apply_transform(T)


def _ring(placed: PlacedSetup, i: int, frame: int, colour: str) -> Iterator[_Part]:
    """Yield the band of ring ``i`` and, where rings are mounted, the bands of its envelope."""
    ring = placed.setup.rings[i]
    mount = placed.scene.robot.mount(ring.link)
    T = placed.T_base_frame[mount.frame] @ mount.T_link_ring(ring.position)
    band = trimesh.creation.torus(ring.radius, _BAND, major_sections=48, minor_sections=12)
    yield _Part(f"ring_{i}", band.apply_transform(T), frame, colour)
    if placed.scene.real:
        around = envelope_mesh(envelope(placed.scene, ring)).apply_transform(T)
        yield _Part(f"ring_{i}_envelope", around, frame, colour, _CLEAR)


def _beam(cones: Beams, k: int) -> Any:
    """Return the beam of a sensor."""
    corners, faces = cones.surface(k, _SIDES)
    if faces is None:
        return trimesh.convex.convex_hull(corners)
    return trimesh.Trimesh(corners, faces, process=False)


def _add_points(scene: Any, placed: PlacedSetup) -> None:
    """Add points of each target: covered points in one colour, uncovered points in another."""
    q = placed.scene.poses[placed.pose].q
    for n, goal in enumerate(placed.scene.targets if placed.points else ()):
        points = placed.scene.sample(goal.target, placed.pose, placed.points, 0)
        seen = np.asarray(setup_sight(placed.scene, placed.setup, q).holds(points))
        for name, some, colour in (("seen", seen, COVERED_ONCE), ("unseen", ~seen, UNCOVERED)):
            if some.any():
                colours = np.tile(_rgba(colour), (int(some.sum()), 1))
                cloud = trimesh.PointCloud(points[some], colors=colours)
                node = f"target_{n}_{name}"
                scene.add_geometry(
                    cloud, node_name=node, geom_name=node, parent_node_name=BASE_LINK
                )
