"""Guaranteed intervals: comparison with mesh Booleans, and cost of a narrow interval.

Meshes inside and around cones and ball bound the share, too: one interval is compared with both
Booleans.
"""

import math
import time
from typing import Any

import numpy as np
from common import BALL, cone_task, installed, medians, missing, table
from meshes import mesh_share
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.solids.spheres import sphere
from place_rings.coverage.targets import Target, target_solid
from place_rings.coverage.voxels.certified_bounds import bracket
from place_rings.objectives.scene import paper_scene

PEERS: tuple[str, ...] = ("manifold3d",)
WIDTHS = (1.0, 0.1, 0.01)  # points
SIDES = 64


def against_meshes() -> list[str]:
    """Compare an interval for the cone task with the two Booleans, which it must not exceed in
    width.
    """
    cones, ball = cone_task(), sphere(np.zeros(3), BALL)
    if not installed("manifold3d"):
        return [missing("manifold3d")]
    low, high = (mesh_share(cones, SIDES, SIDES, BALL, outside) for outside in (False, True))

    def meshes() -> tuple[float, float]:
        return mesh_share(cones, SIDES, SIDES, BALL), mesh_share(
            cones, SIDES, SIDES, BALL, outside=True
        )

    def interval() -> Any:
        b = bracket(ball, cones, high - low)
        return b.low, b.high

    measured = medians({"two Booleans, 64 sides": meshes, "certified": interval}, 5)
    slow = measured["two Booleans, 64 sides"][1]
    rows = [
        [
            name,
            f"{100 * a:.3f} … {100 * b:.3f}",
            f"{100 * (b - a):.3f}",
            f"{seconds:.2f}",
            f"{seconds / slow:.2f}",
        ]
        for name, ((a, b), seconds) in measured.items()
    ]
    for row in rows:
        print(*row, flush=True)
    columns = (
        "method",
        "share of the ball, %",
        "width, points",
        "seconds",
        "relative to the Booleans",
    )
    return ["The cone task:", "", *table(columns, rows), ""]


def cost_of_width() -> list[str]:
    """Measure narrower and narrower intervals on the reference scene."""
    scene, rows = paper_scene(), []
    q = scene.poses[0].q
    for name, radius in (("n3_16_55", 0.5), ("n3_16_55", 1.5)):
        solid = target_solid(Target("V_S", radius), scene.robot, q, scene.shape)
        cones = sensor_cones(scene.robot, named_setup(name), q)
        for width in WIDTHS if radius < 1 else WIDTHS[:2]:
            start = time.perf_counter()
            b = bracket(solid, cones, width / 100)
            seconds = time.perf_counter() - start
            if not b.reached or math.isnan(b.low):
                raise SystemExit(f"{name}, V_S({radius}): {width} points were not reached")
            interval = f"{100 * b.low:.3f} … {100 * b.high:.3f}"
            rows.append(
                [
                    name,
                    f"V_S({radius:g})",
                    f"{width:g}",
                    interval,
                    f"{b.cells:,}",
                    f"{1000 * b.smallest:.2g}",
                    f"{seconds:.2f}",
                ]
            )
            print(*rows[-1], flush=True)
    columns = (
        "setup",
        "target",
        "requested width, points",
        "ζ, %",
        "cells",
        "smallest cell, mm",
        "seconds",
    )
    return ["The reference scene:", "", *table(columns, rows)]


def report() -> list[str]:
    """Measure and return Markdown."""
    return ["`python benchmarks certified`.", "", *against_meshes(), *cost_of_width()]


if __name__ == "__main__":
    print(*report(), sep="\n")
