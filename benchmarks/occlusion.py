"""Self-occlusion: comparison with rays cast at meshes of the same bodies and of the true links.

For points of V_S(0.5) on the reference scene and every sensor whose cone contains them: is the line
of sight free? It is computed by the capsules' functions, by embree on the same capsules as meshes,
and by embree on the UR10's collision meshes (extra ``robots``). A sensor inside a mesh covers
nothing.
"""

import sys
import time
from pathlib import Path

import numpy as np
import trimesh
from common import absent, installed, say, table
from place_rings.coverage.occlusion.occluders import Occluders, beams
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.soft.sampling import sample
from place_rings.objectives.scene import Scene

SETUPS = {False: ("n3_16_55",), True: ("n1_16_0", "n2_16_25", "n2_16_55", "n3_16_55")}
POINTS = 20_000
# meshes of the base and of frames 0 to 5
_LINKS = ("base", "shoulder", "upperarm", "forearm", "wrist1", "wrist2", "wrist3")
_MESHES = "cmeel.prefix/share/example-robot-data/robots/ur_description/meshes/ur10/collision"
_COLUMNS = (
    *("setup", "ζ, functions, %", "s", "ζ, rays at capsules, %", "s", "relative"),
    *("pairs that agree, %", "ζ, rays at true links, %", "pairs that agree, %"),
)


def capsule_meshes(occluders: Occluders) -> list[trimesh.Trimesh]:
    """Return the bodies as fine meshes."""
    found = []
    for start, end, radius in zip(*occluders.bodies.arrays(), strict=True):
        ball = trimesh.creation.icosphere(4, radius)
        found += [ball.copy().apply_translation(centre) for centre in (start, end)]
        segment = np.stack([start, end])
        found.append(trimesh.creation.cylinder(radius, segment=segment, sections=256))
    return found


def link_meshes(frames: np.ndarray) -> list[trimesh.Trimesh]:
    """Return the collision meshes of the links in the base frame; empty if the data are not
    installed.
    """
    folder = next((Path(p) / _MESHES for p in sys.path if (Path(p) / _MESHES).exists()), None)
    if folder is None:
        return []
    meshes = [trimesh.load(folder / f"{name}.stl", force="mesh") for name in _LINKS]
    return [mesh.apply_transform(T) for mesh, T in zip(meshes, (np.eye(4), *frames), strict=False)]


def free(meshes: list[trimesh.Trimesh], apex: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return which points are visible from ``apex``; none if ``apex`` is inside a mesh."""
    clear = np.ones(len(points), bool)
    way = points - apex
    for mesh in meshes:
        if mesh.is_watertight and mesh.contains(apex[None])[0]:
            return np.zeros(len(points), bool)
        where, ray, _ = mesh.ray.intersects_location(
            np.broadcast_to(apex, way.shape), way, multiple_hits=False
        )
        clear[ray] &= np.linalg.norm(where - apex, axis=1) >= np.linalg.norm(way[ray], axis=1)
    return clear


def report(full: bool) -> list[str]:
    """Return ζ under ``shadow`` by each method, the pairs that agree, and times."""
    scene = Scene.paper()
    q = scene.poses[0].q
    frames = forward(scene.robot.chain, q)
    occluders = Occluders(robot_capsules(scene.robot, frames))
    points = sample(scene.solid(scene.targets[0].target, 0), POINTS, 0).astype(float)
    kinds = {"capsules": capsule_meshes(occluders), "links": link_meshes(frames)}
    rows: list[list[str]] = []
    for name in SETUPS[full] if installed("embreex") else ():
        cones = sensor_cones(scene.robot, named_setup(name), q)
        seen = beams(cones, occluders, "shadow")
        held = np.stack([cones.part(points, k) <= 0 for k in range(len(cones))])
        began = time.perf_counter()
        mine = np.stack([seen.part(points, k) <= 0 for k in range(len(cones))])
        fast = time.perf_counter() - began
        row = [name, f"{100 * mine.any(axis=0).mean():.2f}", f"{fast:.2f}"]
        for kind, meshes in kinds.items():
            if not meshes:
                row += ["-", "-"]
                continue
            began, rays = time.perf_counter(), np.zeros_like(held)
            for k in range(len(cones)):
                rays[k, held[k]] = free(meshes, cones.apex[k], points[held[k]])
            slow = time.perf_counter() - began
            row.append(f"{100 * rays.any(axis=0).mean():.2f}")
            row += [f"{slow:.2f}", f"{slow / fast:.1f}"] * (kind == "capsules")
            row.append(f"{100 * (rays == mine)[held].mean():.2f}")
        say(*row)
        rows.append(row)
    intro = (
        f"ζ of V_S(0.5) under `shadow` by {POINTS:,} points: the bodies' functions, and rays cast"
        " by embree at meshes of the same capsules and of the true links (extra `robots`). A pair"
        " is a sensor and a point in its cone."
    )
    return [intro, table(_COLUMNS, rows or [absent("embreex", len(_COLUMNS))])]
