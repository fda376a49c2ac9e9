"""Meshes of a setup on its robot in its cell, each with the frame that carries it, for formats that
show surfaces."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh

from ...coverage.rings.ring import Ring
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.link_bodies import attached_at, carried_at
from ...coverage.robots.robot import BASE
from ...coverage.solids.beams import Beams
from ...objectives.feasibility.ring_envelopes import envelope
from ..robots.meshes import Meshes
from ..robots.urdf_matching import plain_names
from .palette import OBSTACLE, ROBOT, SENSOR, link_colours
from .placed import BASE_LINK, TCP_LINK, PlacedSetup
from .ring_bodies import envelope_mesh, hull_mesh

CLEAR = 0.13  # opacity of beams and of rings' envelopes
_BAND = 0.004  # m, radius of a ring's tube
_SIDES = 32


@dataclass(frozen=True)
class ScenePart:
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
    solid: bool = False
    """Whether other bodies touch it."""

    def on_frame(self, placed: PlacedSetup) -> Any:
        """Return the mesh in the frame that carries it."""
        return self.mesh.copy().apply_transform(np.linalg.inv(placed.at_pose(self.frame)))


def node_names(placed: PlacedSetup) -> tuple[str, ...]:
    """Return ASCII names of the nodes of the joints' frames, and of the TCP."""
    taken = ["world", BASE_LINK, TCP_LINK, *(s.name for s in placed.sensors)]
    return (*plain_names(placed.links, taken), TCP_LINK)


def scene_parts(placed: PlacedSetup) -> Iterator[ScenePart]:
    """Yield the meshes of the robot, its cell and its rings."""
    robot = placed.scene.robot
    yield from _robot(placed)
    for i, obstacle in enumerate(placed.scene.obstacles):
        if np.size(obstacle.body.edges):
            mesh = hull_mesh(obstacle.body)
            yield ScenePart(f"obstacle_{i}", mesh, colour=OBSTACLE, solid=True)
    for i, body in enumerate(carried_at(robot, placed.T_base_frame)):
        yield ScenePart(f"attached_{i}", hull_mesh(body), robot.carried[i].frame, solid=True)
    capsules = attached_at(robot, placed.T_base_frame)
    if placed.urdf is not None and capsules is not None:  # without a URDF they are among the bodies
        own = robot.bodies[-len(capsules) :]
        ends = zip(own, capsules.start, capsules.end, capsules.radius, strict=True)
        for i, (owner, a, b, radius) in enumerate(ends):
            yield ScenePart(f"attached_capsule_{i}", _capsule(a, b, float(radius)), owner.frame)
    whole = placed.whole
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
        yield ScenePart(f"{'ring' if ring else 'sensor'}_{i}_sees", beams, frame, colour, CLEAR)


def _robot(placed: PlacedSetup) -> Iterator[ScenePart]:
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
                yield ScenePart(f"body_{name}", mesh.apply_transform(T), carried.frame)
        return
    if placed.bodies is None:
        return
    own = placed.scene.robot.bodies
    names, bodies = plain_names(b.name for b in own), placed.bodies
    for body, name, a, b, radius in zip(
        own, names, bodies.start, bodies.end, bodies.radius, strict=True
    ):
        yield ScenePart(f"body_{name}", _capsule(a, b, float(radius)), body.frame)


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


def _ring(placed: PlacedSetup, i: int, frame: int, colour: str) -> Iterator[ScenePart]:
    """Yield the band of ring ``i`` and, where rings are mounted, the bands of its envelope."""
    ring = placed.setup.rings[i]
    mount = placed.scene.robot.mount(ring.link)
    T = placed.T_base_frame[mount.frame] @ mount.T_link_ring(ring.position)
    band = trimesh.creation.torus(ring.radius, _BAND, major_sections=48, minor_sections=12)
    yield ScenePart(f"ring_{i}", band.apply_transform(T), frame, colour)
    if placed.scene.real:
        around = envelope_mesh(envelope(placed.scene, ring)).apply_transform(T)
        yield ScenePart(f"ring_{i}_envelope", around, frame, colour, CLEAR, solid=True)


def _beam(cones: Beams, k: int) -> Any:
    """Return the beam of a sensor."""
    corners, faces = cones.surface(k, _SIDES)
    if faces is None:
        return trimesh.convex.convex_hull(corners)
    return trimesh.Trimesh(corners, faces, process=False)
