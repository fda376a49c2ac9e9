"""Exact count: comparison with dense counts, random points, rays and meshes.

The octree counts the voxels of a ball of 1 m in 112 cones of 11 degrees half angle and 1 m; dense
counts test every voxel against every cone. The verifier counts a setup of the paper, random points
estimate the same.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import assemblies
import growth
import jax
import jax.numpy as jnp
import numpy as np
import occlusion
import trimesh
from common import BALL, HALF_ANGLE, RANGE, absent, cone_task, installed, medians, say, table
from meshes import mesh_share
from monte_carlo import estimate
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.spheres import sphere
from place_rings.coverage.voxels.octree import count, voxels
from place_rings.objectives.scene import Scene
from place_rings.objectives.verify import Verifier

VOXELS = {False: (0.025, 0.0125), True: (0.05, 0.025, 0.0125)}  # m, without and with --full
OPEN3D_FINEST = 0.025  # m
SETUPS = {False: ("n3_16_55",), True: ("n1_16_0", "n2_16_25", "n2_16_55", "n3_16_55")}
POINTS = 100_000
VOXEL_ERROR = 0.001  # share, largest error of a count with voxels of 1 cm


def report(full: bool) -> list[str]:
    """Measure and return blocks of Markdown."""
    return [
        *against_dense_counts(full),
        *against_random_points(full),
        *occlusion.report(full),
        *growth.report(full),
        *assemblies.report(full),
    ]


def against_dense_counts(full: bool) -> list[str]:
    """Compare the octree with counts of every voxel, and with a mesh Boolean."""
    cones, rows = cone_task(), []
    single, double = dense_jax(cones, 32), dense_jax(cones, 64)
    for voxel in VOXELS[full]:
        works: dict[str, Callable[[], Any]] = {
            "octree": lambda v=voxel: octree(cones, v),
            "dense NumPy": lambda v=voxel: dense(cones, v),
            "dense JAX, 32 bit": lambda v=voxel: single(v),
            "dense JAX, 64 bit": lambda v=voxel: double(v),
        }
        if installed("open3d") and voxel >= OPEN3D_FINEST:
            works["Open3D occupancy, 64 sides"] = lambda v=voxel: by_open3d(cones, v)
        measured = medians(works)
        truth, fast = measured["octree"]
        if measured["dense NumPy"][0] != truth:
            raise SystemExit(f"{voxel} m: octree {truth}, dense {measured['dense NumPy'][0]}")
        for name, (found, seconds) in measured.items():
            shares = [f"{found[0]:,}", f"{100 * found[1] / found[0]:.3f}"]
            rows.append([f"{100 * voxel:g}", name, *shares, f"{seconds:.3f}", seconds / fast])
    if installed("manifold3d"):
        share, seconds = medians({"": lambda: mesh_share(cones, 64, 128, BALL)}, 3)[""]
        mesh = "manifold3d Boolean, 64 sides"
        rows.append(["-", mesh, "-", f"{100 * share:.3f}", f"{seconds:.3f}", seconds / fast])
    rows = [[*row[:-1], f"{row[-1]:.1f}"] for row in rows]
    columns = ("voxel, cm", "method", "voxels", "in a cone, %", "seconds", "relative to the octree")
    missing = [absent(p, len(columns)) for p in ("open3d", "manifold3d") if not installed(p)]
    for row in (*rows, *missing):
        say(*row)
    intro = (
        "Voxels of a ball of 1 m in 112 cones of 11° half angle and 1 m. Times include finding the"
        " ball's voxels. The octree and dense NumPy count the same integers."
    )
    return [intro, table(columns, [*rows, *missing])]


def against_random_points(full: bool) -> list[str]:
    """Compare the exact count of a setup with random points tested in plain NumPy."""
    rows = []
    for name in SETUPS[full]:
        setup = named_setup(name)
        for mode in ("ignore", "shadow"):
            scene = replace(Scene.paper(), occlusion=mode)
            target = scene.targets[0].target
            works: dict[str, Callable[[], Any]] = {
                "exact": lambda s=scene, t=target, u=setup: Verifier(s).verify(u, t).zeta,
                "points": lambda s=scene, u=setup: estimate(s, u, POINTS, 0),
            }
            measured = medians(works, 3)
            (zeta, fast), ((drawn, half), slow) = measured["exact"], measured["points"]
            if abs(zeta - drawn) > 2 * half + VOXEL_ERROR:
                raise SystemExit(f"{name}, {mode}: counted {zeta}, random points {drawn} ± {half}")
            rows.append(
                [
                    *(name, mode, f"{100 * zeta:.2f}", f"{fast:.2f}"),
                    *(f"{100 * drawn:.2f} ± {100 * half:.2f}", f"{slow:.2f}", f"{slow / fast:.1f}"),
                ]
            )
            say(*rows[-1])
    columns = ("setup", "occlusion", "count, %", "s", "random points, %", "s", "relative")
    intro = (
        f"ζ of V_S(0.5): the exact count (voxels of 1 cm) and {POINTS:,} random points in plain"
        " NumPy with their 95 % interval, each from the scene to the answer."
    )
    return [intro, table(columns, rows)]


def octree(cones: Cones, voxel: float) -> tuple[int, int]:
    """Return the number of voxels in the ball, and of those in a cone, by the octree."""
    ball = voxels(sphere(np.zeros(3), BALL), voxel)
    return len(ball), count(cones, voxel, within=ball)


def lattice(voxel: float) -> np.ndarray:
    """Return centres (N, 3) m of the voxels in the ball."""
    n = math.ceil(BALL / voxel)
    line = (np.arange(-n, n) + 0.5) * voxel
    p = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    return p[(p * p).sum(axis=1) <= BALL**2]


def dense(cones: Cones, voxel: float) -> tuple[int, int]:
    """Return the same numbers: every centre is tested against every cone, one after the other."""
    p = lattice(voxel)
    seen = np.zeros(len(p), bool)
    slope = math.cos(HALF_ANGLE) ** 2
    for apex, axis in zip(cones.apex, cones.axis, strict=True):
        v = p - apex
        depth = v @ axis
        seen |= (depth >= 0) & (depth <= RANGE) & (depth * depth >= slope * (v * v).sum(axis=1))
    return len(p), int(seen.sum())


def dense_jax(cones: Cones, bits: int) -> Callable[[float], tuple[int, int]]:
    """Return the same count by JAX: one fused loop over pairs on all cores.

    Only 64 bit guarantees the same integer.
    """
    dtype = np.dtype(f"float{bits}")
    apex, axis = (a.astype(dtype) for a in (cones.apex, cones.axis))
    slope = math.cos(HALF_ANGLE) ** 2

    @jax.jit
    def tally(line: Any) -> Any:
        x, y, z = (a.reshape(-1) for a in jnp.meshgrid(line, line, line, indexing="ij"))
        inside = x * x + y * y + z * z <= BALL**2
        vx, vy, vz = (c[:, None] - apex[None, :, i] for i, c in enumerate((x, y, z)))
        depth = vx * axis[None, :, 0] + vy * axis[None, :, 1] + vz * axis[None, :, 2]
        square = vx * vx + vy * vy + vz * vz
        seen = ((depth >= 0) & (depth <= RANGE) & (depth * depth >= slope * square)).any(axis=1)
        return inside.sum(), (inside & seen).sum()

    def work(voxel: float) -> tuple[int, int]:
        n = math.ceil(BALL / voxel)
        with jax.enable_x64(bits == 64):
            total, seen = tally(((np.arange(-n, n) + 0.5) * voxel).astype(dtype))
            return int(total), int(seen)

    return work


def by_open3d(cones: Cones, voxel: float) -> tuple[int, int]:
    """Return the same count by Open3D's occupancy of 64-sided cones.

    Each cone is a scene of its own, as overlapping meshes confuse its parity.
    """
    import open3d  # noqa: TID251 a peer

    p = lattice(voxel)
    query, seen = open3d.core.Tensor(p.astype(np.float32)), np.zeros(len(p), bool)
    for apex, axis in zip(cones.apex, cones.axis, strict=True):
        T = trimesh.geometry.align_vectors([0, 0, 1], -axis)
        T[:3, 3] = apex + RANGE * axis  # the centre of the base
        mesh = trimesh.creation.cone(RANGE * math.tan(HALF_ANGLE), RANGE, sections=64, transform=T)
        scene = open3d.t.geometry.RaycastingScene()
        scene.add_triangles(
            open3d.core.Tensor(mesh.vertices.astype(np.float32)),
            open3d.core.Tensor(mesh.faces.astype(np.uint32)),
        )
        seen |= scene.compute_occupancy(query).numpy() > 0
    return len(p), int(seen.sum())
