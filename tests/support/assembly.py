"""A judge of printed rings by their files alone: placed on the robot at every pose, by manifold3d.

It reads ``printing.json``, the STL files and the plates, and shares no code with what made them but
the robot's kinematics and the sensors' beams, which other tests compare with MuJoCo and with closed
forms.
"""

import io
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float
from manifold3d import Manifold, Mesh, OpType
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import carried_polyhedra, robot_capsules
from place_rings.objectives.scene import Scene

_ROUND = 32  # facets of a body
_NEAR = 50.0  # mm, largest gap that is measured
_TOUCH = 1e-3  # mm, depth to which faces that touch agree in files of 32-bit numbers


@dataclass
class Verdict:
    """What was measured on an assembly at all poses, mm and mm³."""

    overlap: float = 0.0
    """Largest volume that two parts of different rings, or a part and a body, have in common."""
    names: str = ""
    """What overlaps most."""
    rings: float = _NEAR
    """Least gap between two rings."""
    bodies: float = _NEAR
    """Least gap between a ring and a body of another link."""
    watertight: bool = True
    """Whether every file is a closed surface."""
    beams: float = _NEAR
    """Least distance, by the beams' exact functions, of a ring's surface from its own sensors'
    beams; negative inside."""
    wall: float = _NEAR
    """Least thickness that rays measure on a file, between faces parallel within 20 degrees."""
    parts: int = 0
    """Number of printed parts."""
    within: int = 0
    """Points on a part's surface that lie within another part of its ring, deeper than 1
    micrometre."""
    size: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Largest width, depth and height of a file."""


def part(data: bytes) -> tuple[Manifold, bool]:
    """Return the solid in an STL file, and whether it is watertight by trimesh."""
    mesh = trimesh.load_mesh(io.BytesIO(data), file_type="stl")
    mesh.merge_vertices()
    solid = Manifold(Mesh(np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.uint32)))
    return solid, bool(mesh.is_watertight)


def capsule(a: Float[np.ndarray, " 3"], b: Float[np.ndarray, " 3"], radius: float) -> Manifold:
    """Return a capsule, mm; its facets lie within it."""
    ball = Manifold.sphere(1000 * radius, _ROUND)
    return Manifold.batch_hull([ball.translate(tuple(1000 * v)) for v in (a, b)])


def wall(data: bytes, seed: int = 0, rays: int = 3000) -> float:
    """Return the least thickness, mm, by rays through an STL file: from points on its surface
    inwards to the first face that is parallel within 20 degrees."""
    mesh = trimesh.load_mesh(io.BytesIO(data), file_type="stl")
    points, faces = trimesh.sample.sample_surface(mesh, rays, seed=seed)
    normals = mesh.face_normals[faces]
    hits, met, triangles = mesh.ray.intersects_location(
        points - 1e-3 * normals, -normals, multiple_hits=False
    )
    opposite = np.einsum("ri,ri->r", mesh.face_normals[triangles], normals[met])
    thick = np.linalg.norm(hits - points[met], axis=1)
    return float(thick[opposite < -math.cos(math.radians(20))].min(initial=_NEAR))


def places(ring: Mapping[str, Any]) -> list[tuple[str, list[list[float]]]]:
    """Return file and matrix of every part of a ring of ``printing.json``, lids included."""
    lids = ring.get("lids") or {"file": "", "T_link_print": []}
    return [*ring["T_link_print"].items(), *((lids["file"], T) for T in lids["T_link_print"])]


def shared(
    data: Mapping[str, bytes],
    placed: Sequence[tuple[str, list[list[float]]]],
    samples: int = 4000,
) -> int:
    """Return how many points on the surface of a ring's parts lie within another of its parts, and
    more than 1 micrometre below its surface.

    They lie within by trimesh's rays; a Manifold made of a file may differ from it where triangles
    are slivers. Points on a common plane lie on either side of it by the rounding of the files, so
    their depth, the distance from the nearest triangle, decides.
    """
    meshes = []
    for file, T in placed:
        mesh = trimesh.load_mesh(io.BytesIO(data[file]), file_type="stl")
        meshes.append(mesh.apply_scale(0.001).apply_transform(np.array(T)))
    count = 0
    for one, other in itertools.permutations(meshes, 2):
        points, _ = trimesh.sample.sample_surface(one, samples, seed=0)
        near = np.all((points > other.bounds[0]) & (points < other.bounds[1]), axis=1)
        if near.any():
            # in millimetres, as the rays' tolerances are absolute
            large, here = other.copy().apply_scale(1000.0), 1000 * points[near]
            # a ray along an edge may miscount, and then the library draws another direction
            here = here[large.contains(here)]
            here = here[winding(large, here) > 0.5]
            if len(here):
                _, depth, _ = trimesh.proximity.closest_point(large, here)
                count += int((depth > _TOUCH).sum())
    return count


def winding(mesh: trimesh.Trimesh, points: Float[np.ndarray, "P 3"]) -> Float[np.ndarray, " P"]:
    """Return how many times a closed mesh surrounds each point: the solid angles of its triangles
    by 4 π, each after Van Oosterom and Strackee (1983)."""
    found = np.zeros(len(points))
    for i, point in enumerate(points):
        a, b, c = np.moveaxis(mesh.triangles - point, 1, 0)  # (T, 3) each
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        over = np.einsum("ti,ti->t", a, np.cross(b, c))
        under = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
        found[i] = np.arctan2(over, under).sum() / (2 * np.pi)
    return found


def beams_clear(scene: Scene, ring: Ring, parts: list[Manifold], samples: int = 4000) -> float:
    """Return the least value, mm, of the exact function of a ring's own beams on the surfaces of
    its parts, which are given in the base frame at the first pose, mm."""
    beams, least = sensor_cones(scene.robot, Setup((ring,)), scene.poses[0].q), _NEAR
    for part in parts:
        mesh = part.to_mesh()
        surface = trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False)
        points, _ = trimesh.sample.sample_surface(surface, samples, seed=0)
        points = np.vstack([surface.vertices, points])
        least = min(least, 1000 * float(np.min(beams(points / 1000))))
    return least


def judge(
    scene: Scene,
    setup: Setup,
    data: Mapping[str, bytes],
    points: int = 4000,
    near: float = _NEAR,
) -> Verdict:
    """Place the parts of all rings by ``printing.json`` and compare them with each other, with the
    sensors' beams, and with the robot's bodies at every pose of the scene.

    Args:
        scene: scene of the setup.
        setup: setup whose rings were printed.
        data: files by name.
        points: points on the surface of a part, and three quarters as many rays through it.
        near: largest gap that is measured, mm.
    """
    verdict, robot = Verdict(), scene.robot
    frames_of = {name: i for i, name in enumerate((*robot.chain.joints, "tcp"))}
    rings = []
    for ring in json.loads(data["printing.json"])["rings"]:
        parts = []
        for file, T in places(ring):
            solid, closed = part(data[file])
            verdict.watertight &= closed
            placed = np.array(T)
            placed[:3, 3] *= 1000
            parts.append(solid.transform(placed[:3]))
            verdict.wall = min(verdict.wall, wall(data[file], rays=3 * points // 4))
            low, high = np.reshape(solid.bounding_box(), (2, 3))
            verdict.size = tuple(np.maximum(verdict.size, high - low))
        verdict.within += shared(data, places(ring), points)
        T = forward(robot.chain, scene.poses[0].q)[frames_of[ring["frame"]]].copy()
        T[:3, 3] *= 1000
        here = [part.transform(T[:3]) for part in parts]
        beams = beams_clear(scene, setup.rings[ring["ring"]], here, points)
        verdict.beams = min(verdict.beams, beams)
        verdict.parts += len(parts)
        whole = Manifold.batch_boolean(parts, OpType.Add)
        rings.append((frames_of[ring["frame"]], whole, f"ring {ring['ring']}"))
    for pose in scene.poses:
        frames = forward(robot.chain, pose.q)
        bodies = robot_capsules(robot, frames)
        here = []
        for frame, solid, name in rings:
            T = frames[frame].copy()
            T[:3, 3] *= 1000
            here.append((frame, solid.transform(T[:3]), name))
        for (_, one, a), (_, other, b) in itertools.combinations(here, 2):
            verdict.rings = min(verdict.rings, one.min_gap(other, near))
            _note(verdict, one, other, f"{a}, {b}")
        for frame, solid, name in here:
            for i, body in enumerate(robot.bodies):
                there = capsule(bodies.start[i], bodies.end[i], float(bodies.radius[i]))
                _note(verdict, solid, there, f"{name}, {body.name}")
                own = {frame, frame - 1} if frame == len(robot.chain) else {frame}
                if body.frame not in own:
                    verdict.bodies = min(verdict.bodies, solid.min_gap(there, near))
            for one, body in zip(robot.carried, carried_polyhedra(robot, pose.q), strict=True):
                there = Manifold.hull_points(1000 * body.edges.reshape(-1, 3))
                _note(verdict, solid, there, f"{name}, {one.name}")
                verdict.bodies = min(verdict.bodies, solid.min_gap(there, near))
    return verdict


def _note(verdict: Verdict, one: Manifold, other: Manifold, names: str) -> None:
    volume = (one ^ other).volume()
    if volume > verdict.overlap:
        verdict.overlap, verdict.names = volume, names
