"""A judge of printed rings by their files alone: placed on the robot at every pose, by manifold3d.

It reads ``printing.json`` and the STL files, and shares no code with what made them but the robot's
kinematics, which other tests compare with MuJoCo.
"""

import io
import itertools
import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Float
from manifold3d import Manifold, Mesh
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import carried_polyhedra, robot_capsules
from place_rings.objectives.scene import CoreScene

_ROUND = 32  # facets of a body
_NEAR = 50.0  # mm, largest gap that is measured


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


def judge(scene: CoreScene, data: Mapping[str, bytes]) -> Verdict:
    """Place the parts of all rings by ``printing.json`` and compare them with each other and with
    the robot's bodies at every pose of the scene."""
    verdict, robot = Verdict(), scene.robot
    frames_of = {name: i for i, name in enumerate((*robot.chain.joints, "tcp"))}
    rings = []
    for ring in json.loads(data["printing.json"])["rings"]:
        halves = []
        for file, T in ring["T_link_print"].items():
            solid, closed = part(data[file])
            verdict.watertight &= closed
            placed = np.array(T)
            placed[:3, 3] *= 1000
            halves.append(solid.transform(placed[:3]))
        rings.append((frames_of[ring["frame"]], halves[0] + halves[1], f"ring {ring['ring']}"))
    for pose in scene.poses:
        frames = forward(robot.chain, pose.q)
        bodies = robot_capsules(robot, frames)
        here = []
        for frame, solid, name in rings:
            T = frames[frame].copy()
            T[:3, 3] *= 1000
            here.append((frame, solid.transform(T[:3]), name))
        for (_, one, a), (_, other, b) in itertools.combinations(here, 2):
            verdict.rings = min(verdict.rings, one.min_gap(other, _NEAR))
            _note(verdict, one, other, f"{a}, {b}")
        for frame, solid, name in here:
            for i, body in enumerate(robot.bodies):
                there = capsule(bodies.start[i], bodies.end[i], float(bodies.radius[i]))
                _note(verdict, solid, there, f"{name}, {body.name}")
                own = {frame, frame - 1} if frame == len(robot.chain) else {frame}
                if body.frame not in own:
                    verdict.bodies = min(verdict.bodies, solid.min_gap(there, _NEAR))
            for one, body in zip(robot.carried, carried_polyhedra(robot, pose.q), strict=True):
                there = Manifold.hull_points(1000 * body.edges.reshape(-1, 3))
                _note(verdict, solid, there, f"{name}, {one.name}")
                verdict.bodies = min(verdict.bodies, solid.min_gap(there, _NEAR))
    return verdict


def _note(verdict: Verdict, one: Manifold, other: Manifold, names: str) -> None:
    volume = (one ^ other).volume()
    if volume > verdict.overlap:
        verdict.overlap, verdict.names = volume, names
