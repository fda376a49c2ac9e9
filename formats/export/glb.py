"""GLB: a 3D scene with robot, obstacles, rings, sensors, their beams, and points of the targets."""

from typing import Any

import numpy as np
import trimesh
from trimesh.visual.material import PBRMaterial

from ...coverage.rings.ring import Ring
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.link_bodies import attached_at, carried_at
from ...coverage.robots.robot import BASE
from ...coverage.solids.sensor_beams import SpecialBeams
from ...objectives.feasibility.ring_envelopes import envelope
from ...objectives.occlusion import setup_sight
from ..robots.meshes import Meshes
from ..robots.urdf_matching import find_robot, plain_names
from .placed import BASE_LINK, PlacedSetup

_ROBOT, _SENSOR, _OBSTACLE = (0.72, 0.73, 0.75, 1.0), (0.1, 0.1, 0.12, 1.0), (0.79, 0.71, 0.55, 1.0)
# Okabe and Ito (2008): distinguishable with colour-vision deficiency.
_RINGS = (
    (0.0, 0.45, 0.7),
    (0.9, 0.62, 0.0),
    (0.0, 0.62, 0.45),
    (0.8, 0.47, 0.65),
    (0.34, 0.71, 0.91),
    (0.84, 0.37, 0.0),
)
_SEEN, _UNSEEN = (0.0, 0.62, 0.45, 1.0), (0.84, 0.1, 0.1, 1.0)
_CLEAR = 0.13  # opacity of beams
_BAND = 0.004  # m, radius of a ring's tube
_UNIT = (0.006, 0.008)  # m, displayed radius and length of a sensor
_SIDES = 32
_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # glTF has y up


def glb(placed: PlacedSetup) -> dict[str, bytes]:
    """Return ``scene.glb``: the node ``base_link`` is the base frame; nodes with sensor names look
    along their z axis."""
    scene = trimesh.Scene(base_frame="world")
    scene.graph.update(frame_to=BASE_LINK, matrix=_Y_UP)
    for name, mesh in _robot(placed):
        _add(scene, name, mesh, _ROBOT)
    for i, obstacle in enumerate(placed.scene.obstacles):
        corners = np.asarray(obstacle.body.edges).reshape(-1, 3)
        if len(corners):
            _add(scene, f"obstacle_{i}", trimesh.convex.convex_hull(corners), _OBSTACLE)
    for i, body in enumerate(carried_at(placed.scene.robot, placed.T_base_frame)):
        corners = np.asarray(body.edges).reshape(-1, 3)
        _add(scene, f"attached_{i}", trimesh.convex.convex_hull(corners), _ROBOT)
    capsules = attached_at(placed.scene.robot, placed.T_base_frame)
    if placed.urdf is not None and capsules is not None:  # without a URDF they are among the bodies
        ends = zip(capsules.start, capsules.end, capsules.radius, strict=True)
        for i, (a, b, radius) in enumerate(ends):
            _add(scene, f"attached_capsule_{i}", _capsule(a, b, float(radius)), _ROBOT)
    unit = trimesh.creation.cylinder(_UNIT[0], _UNIT[1], sections=16)
    unit.visual = trimesh.visual.TextureVisuals(material=_material(_SENSOR))
    for s in placed.sensors:
        T = placed.at_pose(s.frame) @ s.T_frame_sensor
        scene.add_geometry(
            unit, node_name=s.name, geom_name="sensor", parent_node_name=BASE_LINK, transform=T
        )
    whole = placed.scene.with_cell(placed.setup)
    cones = sensor_cones(placed.scene.robot, whole, placed.scene.poses[placed.pose].q)
    for i, group in enumerate(whole.groups):
        colour = _RINGS[i % len(_RINGS)]
        ring = isinstance(group, Ring)
        if ring:
            _add(scene, f"ring_{i}", _band(placed, i), (*colour, 1.0))
        if ring and placed.scene.real:
            _add(scene, f"ring_{i}_envelope", _envelope(placed, i), (*colour, _CLEAR))
        some = np.flatnonzero(whole.ring_of_sensor == i)
        _add(
            scene,
            f"{'ring' if ring else 'sensor'}_{i}_sees",
            trimesh.util.concatenate([_beam(cones, k) for k in some.tolist()]),
            (*colour, _CLEAR),
        )
    _add_points(scene, placed)
    return {"scene.glb": scene.export(file_type="glb")}


def _material(colour: tuple[float, ...]) -> Any:
    shown = np.round(255 * np.array(colour)).astype(np.uint8)
    clear = colour[3] < 1
    return PBRMaterial(
        baseColorFactor=shown,
        metallicFactor=0.0,
        roughnessFactor=0.8,
        alphaMode="BLEND" if clear else "OPAQUE",
        doubleSided=clear,
    )


def _add(scene: Any, name: str, mesh: Any, colour: tuple[float, ...]) -> None:
    mesh.visual = trimesh.visual.TextureVisuals(material=_material(colour))
    scene.add_geometry(mesh, node_name=name, geom_name=name, parent_node_name=BASE_LINK)


def _robot(placed: PlacedSetup) -> list[tuple[str, Any]]:
    """Return meshes at the pose: those of the user's URDF if there is one, else the bodies."""
    if placed.urdf is not None:
        meshes, picked = (
            Meshes(placed.urdf.path, placed.packages, placed.package, placed.urdf.addresses),
            find_robot(placed.urdf, placed.scene.robot),
        )
        names = plain_names(c.link.name for c in picked.carried)
        parts = []
        for carried, name in zip(picked.carried, names, strict=True):
            triangles = meshes.surface(carried, "visual")
            T = placed.T_base_frame[carried.frame] if carried.frame != BASE else placed.T_base_root
            if len(triangles):
                mesh = trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles), process=True)
                parts.append((f"body_{name}", mesh.apply_transform(T)))
        return parts
    if placed.bodies is None:
        return []
    names = plain_names(b.name for b in placed.scene.robot.bodies)
    ends = zip(names, placed.bodies.start, placed.bodies.end, placed.bodies.radius, strict=True)
    return [(f"body_{name}", _capsule(a, b, float(radius))) for name, a, b, radius in ends]


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


def _band(placed: PlacedSetup, i: int) -> Any:
    ring, robot = placed.setup.rings[i], placed.scene.robot
    mount = robot.mount(ring.link)
    T = placed.T_base_frame[mount.frame] @ mount.T_link_ring(ring.position)
    made = trimesh.creation.torus(ring.radius, _BAND, major_sections=48, minor_sections=12)
    return made.apply_transform(T)


def _envelope(placed: PlacedSetup, i: int) -> Any:
    """Return the bands of the envelope of ring ``i`` in the base frame, as one mesh."""
    ring, mount = placed.setup.rings[i], placed.scene.robot.mount(placed.setup.rings[i].link)
    around, solids = envelope(placed.scene, ring), []
    for band in around.bands:
        tall, middle = band.high - band.low, (band.high + band.low) / 2
        solid = trimesh.creation.annulus(around.bore, band.outer, tall, sections=_SIDES)
        solids.append(solid.apply_translation([0.0, 0.0, middle]))
    T = placed.T_base_frame[mount.frame] @ mount.T_link_ring(ring.position)
    made: Any = trimesh.util.concatenate(solids)
    return made.apply_transform(T)


def _beam(cones: Any, k: int) -> Any:
    """Return the beam of a sensor: the hull of its apex and the rim of its base, for a dome also of
    its cap, or the sector of a fan."""
    half, height, axis = cones.half_angle[k], cones.range_m[k], cones.axis[k]
    if isinstance(cones, SpecialBeams) and (cones.dome[k] or cones.half_thickness[k] > 0):
        return _dome(cones, k) if cones.dome[k] else _fan(cones, k)
    rim = cones.corners_across(k, height)
    if len(rim) == 0:
        x = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        x = x / np.linalg.norm(x)
        turn = np.linspace(0, 2 * np.pi, _SIDES, endpoint=False)[:, None]
        rim = height * np.tan(half) * (np.cos(turn) * x + np.sin(turn) * np.cross(axis, x))
    return trimesh.convex.convex_hull(
        cones.apex[k] + np.vstack([np.zeros((1, 3)), height * axis + rim])
    )


def _dome(cones: SpecialBeams, k: int) -> Any:
    """Return a dome: the hull of its apex and of circles on its cap."""
    turn = np.linspace(0, 2 * np.pi, _SIDES, endpoint=False)
    polar = np.linspace(0, float(cones.half_angle[k]), _SIDES // 4)[:, None]
    x, y = np.asarray(cones.up[k]), np.cross(cones.up[k], cones.axis[k])
    across = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y  # (T, 3)
    cap = np.sin(polar)[..., None] * across + np.cos(polar)[..., None] * np.asarray(cones.axis[k])
    points = cones.range_m[k] * cap.reshape(-1, 3)
    return trimesh.convex.convex_hull(cones.apex[k] + np.vstack([np.zeros((1, 3)), points]))


def _fan(cones: SpecialBeams, k: int) -> Any:
    """Return a fan as two sectors, one on each side of its plane."""
    half, up = float(cones.half_angle[k]), np.asarray(cones.up[k])
    turn = np.linspace(-half, half, 2 * _SIDES)[:, None]
    axis, side = np.asarray(cones.axis[k]), np.cross(up, cones.axis[k])
    arc = cones.range_m[k] * (np.cos(turn) * axis + np.sin(turn) * side)
    sector = np.asarray(cones.apex[k]) + np.vstack([np.zeros((1, 3)), arc])
    thick = float(cones.half_thickness[k]) * up
    i = np.arange(1, len(sector) - 1)
    faces = np.stack([np.zeros_like(i), i, i + 1], axis=1)
    both = np.vstack([sector - thick, sector + thick])
    return trimesh.Trimesh(both, np.vstack([faces[:, ::-1], faces + len(sector)]), process=False)


def _add_points(scene: Any, placed: PlacedSetup) -> None:
    """Add points of each target: covered points in one colour, uncovered points in another."""
    q = placed.scene.poses[placed.pose].q
    for n, goal in enumerate(placed.scene.goals if placed.points else ()):
        points = placed.scene.sample(goal.target, placed.pose, placed.points, 0)
        seen = np.asarray(setup_sight(placed.scene, placed.setup, q).holds(points))
        for name, some, colour in (("seen", seen, _SEEN), ("unseen", ~seen, _UNSEEN)):
            if some.any():
                colours = np.tile(
                    np.round(255 * np.array(colour)).astype(np.uint8), (int(some.sum()), 1)
                )
                cloud = trimesh.PointCloud(points[some], colors=colours)
                node = f"target_{n}_{name}"
                scene.add_geometry(
                    cloud, node_name=node, geom_name=node, parent_node_name=BASE_LINK
                )
