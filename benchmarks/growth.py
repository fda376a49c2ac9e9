"""Scaling of time and memory.

The soft estimator's value and gradient against sensors, poses and points; the octree against the
voxel's side. Each size runs in a process of its own.
"""

from typing import Any

import numpy as np
from common import BALL, cone_task, exponent, medians, own_process, peak_memory, say, table

WIDTH = 0.008  # m, sharpest width of the search
NOISE = 0.05  # tolerance of a fitted exponent
_PLACES = (
    ("upper_arm", 0.0),
    ("upper_arm", 1.0),
    ("forearm", 0.0),
    ("forearm", 1.0),
    ("tool", 0.0),
)
# what grows: limit of its exponent, and the arguments of ``soft`` or the voxels in 1 m
SERIES: dict[str, tuple[float, list[tuple[int, ...]]]] = {
    "sensors": (1.0, [(n, 1, 100_000) for n in (24, 48, 112, 250, 500, 1000)]),
    "poses": (1.0, [(112, n, 10_000) for n in (1, 3, 10, 30, 100)]),
    "points": (1.0, [(112, 1, n) for n in (10_000, 30_000, 100_000, 300_000, 1_000_000)]),
    "voxels per metre": (2.0, [(n,) for n in (10, 20, 40, 80, 200)]),
}


def soft_task(sensors: int, poses: int, points: int) -> tuple[Any, Any, Any]:
    """Return the soft coverage of five rings on the reference scene's links, with ``points`` points
    at each pose, their arrays and their values."""
    from place_rings.coverage.rings.ring import Ring, ring_values
    from place_rings.coverage.rings.ring_kinematics import ring_arrays
    from place_rings.coverage.soft.sampling import sample
    from place_rings.objectives.poses import Pose
    from place_rings.objectives.scene import Scene
    from place_rings.objectives.soft_coverage import SoftCoverage

    here = Scene.paper()
    swing = [here.poses[0].q + np.array([0.03 * i, 0, 0, 0, 0, 0]) for i in range(poses)]
    scene = Scene.paper(poses=tuple(map(Pose, swing)))
    counts = np.bincount(np.arange(sensors) % 5, minlength=5).tolist()
    rings = [Ring(link, at, n, 0.5) for (link, at), n in zip(_PLACES, counts, strict=True)]
    base, each = sample(here.solid(here.targets[0].target, 0), points, 0), []
    for i in range(poses):
        c, s = np.cos(0.03 * i), np.sin(0.03 * i)
        each.append(base @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T)
    v = ring_values(tuple(rings))
    coverage = SoftCoverage(scene, [(0, p) for p in range(poses)], each)
    arrays = ring_arrays(scene.robot, tuple(rings))
    return coverage, arrays, np.stack([v.position, v.tilt, v.phase])


def soft(sensors: int, poses: int, points: int) -> tuple[float, float]:
    """Return the time in seconds of one value and gradient, and the process's memory in MB."""
    coverage, *setup = soft_task(sensors, poses, points)
    return medians({"": lambda: coverage.value_and_slope(*setup, WIDTH)})[""][1], peak_memory()


def octree(voxels_per_metre: int) -> tuple[float, float]:
    """Return the time in seconds of a count on the cone task, including the ball's voxels, and the
    process's memory in MB.
    """
    from place_rings.coverage.solids.spheres import sphere
    from place_rings.coverage.voxels.octree import count, voxels

    cones, voxel = cone_task(), 1 / voxels_per_metre
    ball = sphere(np.zeros(3), BALL)
    work = {"": lambda: count(cones, voxel, within=voxels(ball, voxel))}
    return medians(work)[""][1], peak_memory()


def report(full: bool) -> list[str]:
    """Measure and return blocks of Markdown: all sizes, or the ends of each series."""
    rows = []
    for name, (limit, every) in SERIES.items():
        sizes = every if full else [every[0], every[len(every) // 2], every[-1]]
        grown = [max(size) if name == "points" else size[name == "poses"] for size in sizes]
        measured = [own_process(octree if len(size) == 1 else soft, *size) for size in sizes]
        slope = exponent(grown, [seconds for seconds, _ in measured])
        rows.append(
            [
                *(name, " / ".join(f"{n:,}" for n in grown)),
                " / ".join(f"{seconds:.4f}" for seconds, _ in measured),
                " / ".join(f"{peak:.0f}" for _, peak in measured),
                *(f"{slope:.2f}", f"{limit:g}", "yes" if slope <= limit + NOISE else "no"),
            ]
        )
        say(*rows[-1])
    intro = (
        f"The soft estimator computes value and gradient at a width of {WIDTH:g} m for V_S(0.5),"
        " the octree counts the cone task. Memory is that of a whole process with its imports;"
        " exponents are slopes of straight lines through the logarithms of the times."
    )
    columns = (
        *("what grows", "values", "seconds", "peak, MB", "exponent", "limit"),
        f"holds within {NOISE:g}",
    )
    return [intro, table(columns, rows)]
