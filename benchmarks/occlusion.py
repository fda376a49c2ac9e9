"""Self-occlusion: comparison with rays cast at meshes of the same bodies and of the true links.

For points of V_S(0.5) on the reference scene and every sensor whose cone contains them: is the line
of sight free? It is computed by the capsules' functions, by embree on the same capsules as meshes,
and by embree on the UR10's collision meshes (the ``[robots]`` extra). A sensor inside a mesh covers
nothing.
"""

import sys
import time
from pathlib import Path

import numpy as np
import trimesh
from place_rings.coverage.occlusion.occluders import Occluders, beams
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.soft.sampling import sample
from place_rings.objectives.scene import paper_scene

SETUPS = ("n1_16_0", "n2_16_25", "n2_16_55", "n3_16_55")
POINTS = 20_000
# meshes of frames 0 to 5; the base does not move
_LINKS = ("shoulder", "upperarm", "forearm", "wrist1", "wrist2", "wrist3")


def capsule_meshes(occluders: Occluders) -> list[trimesh.Trimesh]:
    """Return the bodies as fine meshes."""
    found = []
    for start, end, radius in zip(*occluders.bodies.arrays(), strict=True):
        ends = [trimesh.creation.icosphere(4, radius).apply_translation(c) for c in (start, end)]
        found += [
            *ends,
            trimesh.creation.cylinder(radius, segment=np.stack([start, end]), sections=256),
        ]
    return found


def link_meshes(frames: np.ndarray) -> list[trimesh.Trimesh]:
    """Return the collision meshes of the links in the base frame; empty if the data are not
    installed.
    """
    places = [
        Path(p)
        / "cmeel.prefix/share/example-robot-data/robots/ur_description/meshes/ur10/collision"
        for p in sys.path
    ]
    folder = next((p for p in places if p.exists()), None)
    if folder is None:
        return []
    meshes = [trimesh.load(folder / f"{name}.stl", force="mesh") for name in ("base", *_LINKS)]
    return [mesh.apply_transform(T) for mesh, T in zip(meshes, (np.eye(4), *frames), strict=False)]


def free(meshes: list[trimesh.Trimesh], apex: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return which points are visible from ``apex``.

    No point is visible if ``apex`` is inside a mesh.
    """
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


def report() -> list[str]:
    """Return a table of ζ under ``shadow`` by each method, pairs that agree, and times."""
    scene = paper_scene()
    q = scene.poses[0].q
    frames = forward(scene.robot.chain, q)
    occluders = Occluders(robot_capsules(scene.robot, frames))
    points = sample(scene.solid(scene.goals[0].target, 0), POINTS, 0).astype(float)
    kinds = {"capsules": capsule_meshes(occluders), "links": link_meshes(frames)}
    lines = [
        "ζ is in percent. A pair is a sensor and a point in its cone.",
        "",
        (
            "| setup | ζ ignore | ζ shadow, functions | ζ shadow, rays at capsules | pairs that"
            " agree | ζ shadow, rays at true links | pairs that agree | functions, s | rays at"
            " capsules, s |"
        ),
        "| --- " * 9 + "|",
    ]
    for name in SETUPS:
        cones = sensor_cones(scene.robot, named_setup(name), q)
        seen = beams(cones, occluders, "shadow")
        held = np.stack([cones.part(points, k) <= 0 for k in range(len(cones))])
        began = time.perf_counter()
        mine = np.stack([seen.part(points, k) <= 0 for k in range(len(cones))])
        spent = {"functions": time.perf_counter() - began}
        rays = {}
        for kind, meshes in kinds.items():
            began, rays[kind] = time.perf_counter(), np.zeros_like(held)
            for k in range(len(cones) if meshes else 0):
                rays[kind][k, held[k]] = free(meshes, cones.apex[k], points[held[k]])
            spent[kind] = time.perf_counter() - began
        cells = [name, *(f"{100 * a.any(axis=0).mean():.2f}" for a in (held, mine))]
        for kind, meshes in kinds.items():
            same = (rays[kind] == mine)[held].mean()
            cells += (
                [f"{100 * rays[kind].any(axis=0).mean():.2f}", f"{100 * same:.2f} %"]
                if meshes
                else ["–", "–"]
            )
        cells += [f"{spent['functions']:.2f}", f"{spent['capsules']:.2f}"]
        lines.append("| " + " | ".join(cells) + " |")
    return lines
