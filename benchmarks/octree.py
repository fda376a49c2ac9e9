"""Octree: comparison with dense counts and meshes.

The share of a ball's voxels (radius 1 m, rule `centre`) in 112 cones of 11 degrees half angle and 1
m.
"""

import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from common import BALL, HALF_ANGLE, RANGE, cone_task, installed, medians, missing, table
from meshes import cone_mesh, mesh_share
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.solids.spheres import sphere
from place_rings.coverage.voxels.octree import count, voxels

PEERS: tuple[str, ...] = ("open3d", "manifold3d")
VOXELS = (0.05, 0.025, 0.0125)
RUNS = 5
SLOWEST = {
    0.025: 40,
    0.0125: 100,
}  # required speed relative to dense NumPy; the report names a miss
SLOWEST_JAX = 5


def lattice(voxel: float) -> np.ndarray:
    """Return centres (N, 3) m of the voxels in the ball."""
    n = math.ceil(BALL / voxel)
    line = (np.arange(-n, n) + 0.5) * voxel
    p = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    return p[(p * p).sum(axis=1) <= BALL**2]


def dense(cones: Cones, voxel: float) -> tuple[int, int]:
    """Return the number of voxels in the ball, and of those in a cone.

    Every centre is tested against every cone, one cone after the other.
    """
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
        corners, triangles = cone_mesh(apex, axis, RANGE, RANGE * math.tan(HALF_ANGLE), 64)
        scene = open3d.t.geometry.RaycastingScene()
        scene.add_triangles(
            open3d.core.Tensor(corners.astype(np.float32)),
            open3d.core.Tensor(triangles.astype(np.uint32)),
        )
        seen |= scene.compute_occupancy(query).numpy() > 0
    return len(p), int(seen.sum())


def octree(cones: Cones, voxel: float) -> tuple[int, int]:
    """Return the same two numbers by the octree."""
    ball = voxels(sphere(np.zeros(3), BALL), voxel)
    return len(ball), count(cones, voxel, within=ball)


def report() -> list[str]:
    """Measure and return Markdown."""
    cones, rows, notes = cone_task(), [], []
    single, double = dense_jax(cones, 32), dense_jax(cones, 64)
    for voxel in VOXELS:
        works: dict[str, Callable[[], Any]] = {
            "octree": lambda v=voxel: octree(cones, v),
            "dense NumPy": lambda v=voxel: dense(cones, v),
            "dense JAX, 32 bit": lambda v=voxel: single(v),
            "dense JAX, 64 bit": lambda v=voxel: double(v),
        }
        if installed("open3d") and voxel >= 0.025:
            works["Open3D occupancy, 64 sides"] = lambda v=voxel: by_open3d(cones, v)
        measured = medians(works, RUNS)
        truth, fast = measured["octree"]
        if measured["dense NumPy"][0] != truth:
            raise SystemExit(
                f"at {voxel} m the octree counts {truth}, the dense count is"
                f" {measured['dense NumPy'][0]}"
            )
        for name, (found, seconds) in measured.items():
            rows.append(
                [
                    f"{100 * voxel:g}",
                    name,
                    *(f"{n:,}" for n in found),
                    f"{seconds:.3f}",
                    f"{seconds / fast:.1f}",
                ]
            )
            print(*rows[-1], flush=True)
        for name, least in (
            ("dense NumPy", SLOWEST.get(voxel, 0)),
            *((f"dense JAX, {b} bit", SLOWEST_JAX * (voxel < 0.02)) for b in (32, 64)),
        ):
            if measured[name][1] < least * fast:
                notes.append(
                    f"Too slow at {100 * voxel:g} cm: {measured[name][1] / fast:.1f} times the"
                    f" speed of {name}, required: {least}."
                )
    if installed("manifold3d"):
        share, seconds = medians({"mesh": lambda: mesh_share(cones, 64, 128, 1.0)}, 3)["mesh"]
        notes.append(
            f"A mesh Boolean of the same solids (manifold3d, 64 sides) takes {seconds:.2f} s and"
            f" gives a share of {share:.4f}; the finest count gives {truth[1] / truth[0]:.4f}."
        )
    notes += [missing(peer) for peer in PEERS if not installed(peer)]
    columns = (
        "voxel, cm",
        "method",
        "in the ball",
        "in a cone",
        "seconds",
        "time relative to the octree",
    )
    intro = (
        "Voxels of a ball of 1 m that lie in 112 cones of 11° half angle and 1 m. Times"
        " include finding the ball's voxels."
    )
    return [intro, "`python benchmarks octree`.", "", *table(columns, rows), "", *notes]


if __name__ == "__main__":
    print(*report(), sep="\n")
