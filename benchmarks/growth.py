"""Scaling of time and memory.

The soft estimator's value and gradient against sensors, poses and points; the octree against the
voxel's side. Exponents are slopes of straight lines through the logarithms.
"""

import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from common import table

PEERS: tuple[str, ...] = ()
SENSORS = (24, 48, 112, 250, 500, 1000)
POSES = (1, 3, 10, 30, 100)
POINTS = (10_000, 30_000, 100_000, 300_000, 1_000_000)
VOXELS = (0.1, 0.05, 0.025, 0.0125, 0.005)
NOISE = 0.05  # tolerance of a fitted exponent
WIDTH = 0.008  # m, sharpest width of the search


def median_seconds(work: Callable[[], Any], runs: int = 5) -> float:
    """Return the median time of several runs after one that compiles."""
    work()
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)


def soft(sensors: int, poses: int, points: int) -> float:
    """Return the time in seconds of one value and gradient.

    Five rings are on the reference scene's links, with ``points`` points at each pose.
    """
    import jax
    import jax.numpy as jnp
    from place_rings.coverage.rings.ring import Ring, Setup
    from place_rings.coverage.rings.ring_kinematics import sensor_cones
    from place_rings.coverage.soft.estimator import soft_zeta
    from place_rings.coverage.soft.sampling import cloud, sample
    from place_rings.coverage.targets import Target, target_solid
    from place_rings.objectives.scene import paper_scene

    scene = paper_scene()
    places = [
        ("upper_arm", 0.0),
        ("upper_arm", 1.0),
        ("forearm", 0.0),
        ("forearm", 1.0),
        ("tool", 0.0),
    ]
    counts = np.bincount(np.arange(sensors) % 5, minlength=5)
    setup = Setup(
        tuple(Ring(link, at, int(n), 0.5) for (link, at), n in zip(places, counts, strict=True))
    )
    swing = [scene.poses[0].q + np.array([0.03 * i, 0, 0, 0, 0, 0]) for i in range(poses)]
    base = sample(target_solid(Target("V_S", 0.5), scene.robot, swing[0], scene.shape), points, 0)
    turned = []
    for i in range(poses):
        c, s = np.cos(0.03 * i), np.sin(0.03 * i)
        turned.append(cloud(base @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T))
    clouds = jax.tree.map(lambda *a: jnp.asarray(np.stack(a)), *turned)
    cones = [sensor_cones(scene.robot, setup, q) for q in swing]
    stacked = jax.tree.map(lambda *a: jnp.asarray(np.stack(a), jnp.float32), *cones)
    each = jax.jit(lambda c, p: jax.lax.map(lambda cp: soft_zeta(*cp, WIDTH), (c, p)))
    return median_seconds(lambda: jax.block_until_ready(each(stacked, clouds)))


def octree(voxel: float) -> float:
    """Return the time in seconds of a count on the cone task, including the ball's voxels."""
    from common import BALL, cone_task
    from place_rings.coverage.solids.spheres import sphere
    from place_rings.coverage.voxels.octree import count, voxels

    cones = cone_task()
    return median_seconds(
        lambda: count(cones, voxel, within=voxels(sphere(np.zeros(3), BALL), voxel))
    )


def peak_memory() -> float:
    """Return the peak resident memory of this process, MB (Linux)."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024


def in_a_process(call: str) -> tuple[float, float]:
    """Return the time in seconds and the peak memory in MB of a call in its own process."""
    found = subprocess.run(
        [sys.executable, __file__, call], check=True, capture_output=True, text=True
    )
    seconds, peak = map(float, found.stdout.split())
    return seconds, peak


def exponent(sizes: list[float], values: list[float]) -> float:
    """Return the slope of the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def report() -> list[str]:
    """Measure and return Markdown."""
    series: list[tuple[str, list[float], list[str], float]] = [
        ("sensors", [float(n) for n in SENSORS], [f"soft({n}, 1, 100_000)" for n in SENSORS], 1.0),
        ("poses", [float(n) for n in POSES], [f"soft(112, {n}, 10_000)" for n in POSES], 1.0),
        ("points", [float(n) for n in POINTS], [f"soft(112, 1, {n})" for n in POINTS], 1.0),
        ("voxels per metre", [1 / v for v in VOXELS], [f"octree({v})" for v in VOXELS], 2.0),
    ]
    rows, slopes = [], []
    for name, sizes, calls, most in series:
        measured = [in_a_process(call) for call in calls]
        for size, call, (seconds, peak) in zip(sizes, calls, measured, strict=True):
            rows.append([name, f"{size:g}", f"`{call}`", f"{seconds:.4f}", f"{peak:.0f}"])
            print(*rows[-1], flush=True)
        slope = exponent(sizes, [seconds for seconds, _ in measured])
        slopes.append([name, f"{slope:.2f}", f"{most:g}", "yes" if slope <= most + NOISE else "no"])
    intro = (
        f"The soft estimator computes value and gradient at a width of {WIDTH:g} m for V_S(0.5)."
        " Memory is that of the whole process, including imports."
    )
    columns = ("quantity", "value", "call", "seconds", "peak, MB")
    verdict = table(
        ("quantity", "exponent of the time", "limit", f"holds within {NOISE:g}"), slopes
    )
    return [intro, "`python benchmarks growth`.", "", *verdict, "", *table(columns, rows)]


if __name__ == "__main__":
    if len(sys.argv) > 1:
        kind, _, sizes_given = sys.argv[1].partition("(")
        sizes_of = [float(v) for v in sizes_given.rstrip(")").split(",")]
        taken = octree(sizes_of[0]) if kind == "octree" else soft(*(int(v) for v in sizes_of))
        print(taken, peak_memory())
    else:
        print(*report(), sep="\n")
