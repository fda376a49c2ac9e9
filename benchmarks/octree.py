"""The octree against a dense NumPy count: 112 cones and a ball, the same integers, how many times faster.

Run: python benchmarks/octree.py        writes results/octree.md
"""

import math
import os
import platform
import statistics
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from place_rings.coverage.octree import count, voxels
from place_rings.coverage.solids import Cones, sphere

CONES, HALF_ANGLE, RANGE, BALL = 112, math.radians(11), 1.0, 1.0
VOXELS = (0.05, 0.025, 0.0125)
RUNS = 3


def task() -> Cones:
    """Cones spread over a sphere of 1.6 m by the golden angle, each aimed near its centre."""
    rng = np.random.default_rng(0)
    i = np.arange(CONES)
    z = 1 - (2 * i + 1) / CONES
    azimuth, r = i * math.pi * (3 - math.sqrt(5)), np.sqrt(1 - z * z)
    apex = 1.6 * np.column_stack([r * np.cos(azimuth), r * np.sin(azimuth), z])
    aim = -apex / np.linalg.norm(apex, axis=1, keepdims=True) + 0.15 * rng.normal(size=(CONES, 3))
    axis = aim / np.linalg.norm(aim, axis=1, keepdims=True)
    return Cones(apex, axis, np.full(CONES, HALF_ANGLE), np.full(CONES, RANGE))


def dense(cones: Cones, voxel: float) -> tuple[int, int]:
    """Voxels of the ball, and those in a cone: every centre against every cone, one cone after the other."""
    n = math.ceil(BALL / voxel)
    line = (np.arange(-n, n) + 0.5) * voxel
    p = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    p = p[(p * p).sum(axis=1) <= BALL**2]
    seen = np.zeros(len(p), bool)
    slope = math.cos(HALF_ANGLE) ** 2
    for apex, axis in zip(cones.apex, cones.axis, strict=True):
        v = p - apex
        depth = v @ axis
        seen |= (depth >= 0) & (depth <= RANGE) & (depth * depth >= slope * (v * v).sum(axis=1))
    return len(p), int(seen.sum())


def octree(cones: Cones, voxel: float) -> tuple[int, int]:
    """The same two numbers by the octree."""
    ball = voxels(sphere(np.zeros(3), BALL), voxel)
    return len(ball), count(cones, voxel, within=ball)


def mesh_boolean(cones: Cones) -> float | None:
    """Share of the ball's volume in 64-sided cones, by manifold3d; None where it is not installed."""
    try:
        from manifold3d import Manifold
    except ImportError:
        return None
    ball = Manifold.sphere(BALL, 128)
    solids = []
    for apex, axis in zip(cones.apex, cones.axis, strict=True):
        across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        across /= np.linalg.norm(across)
        frame = np.column_stack([across, np.cross(axis, across), axis, apex])
        solids.append(Manifold.cylinder(RANGE, 0.0, RANGE * math.tan(HALF_ANGLE), 64).transform(frame))
    return (Manifold.batch_boolean(solids, _add()) ^ ball).volume() / ball.volume()


def _add() -> object:
    from manifold3d import OpType

    return OpType.Add


def timed(work: Callable[[], Any], runs: int) -> tuple[Any, float]:
    """What ``work`` returns, and the median of its seconds."""
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - start)
    return result, statistics.median(seconds)


def main() -> None:
    """Measure, print and write the table."""
    cones = task()
    octree(cones, 0.1)
    lines = [
        "# The octree against a dense NumPy count",
        "",
        "Command: `python benchmarks/octree.py`. The share of a ball's voxels (radius 1 m, rule `centre`) in 112 cones",
        f"of 11° half angle and 1 m. Medians, target voxels counted in. {platform.machine()}, {os.cpu_count()} cores,",
        f"Python {platform.python_version()}, NumPy {version('numpy')}.",
        "",
        "| voxel, cm | voxels in the ball | in a cone | dense, s | octree, s | times faster |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for voxel in VOXELS:
        truth, slow = timed(lambda voxel=voxel: dense(cones, voxel), RUNS)
        found, fast = timed(lambda voxel=voxel: octree(cones, voxel), RUNS + 2)
        if found != truth:
            raise SystemExit(f"at {voxel} m the octree counts {found}, the dense count is {truth}")
        lines.append(f"| {100 * voxel:g} | {truth[0]:,} | {truth[1]:,} | {slow:.2f} | {fast:.3f} | {slow / fast:.0f} |")
        print(lines[-1], flush=True)
    share, seconds = timed(lambda: mesh_boolean(cones), RUNS)
    if share is None:
        lines += ["", "manifold3d is not installed (the `[bench]` extra): no mesh Boolean beside it."]
    else:
        lines += ["", f"A mesh Boolean of the same solids, 64-sided (manifold3d {version('manifold3d')}): a volume share of"]
        lines += [f"{share:.4f} in {seconds:.2f} s; the finest count above has {found[1] / found[0]:.4f}."]
    print(*lines[-2:], sep="\n")
    Path(__file__).parent.parent.joinpath("results", "octree.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
