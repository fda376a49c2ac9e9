"""Guaranteed intervals: comparison with mesh Booleans, and cost of a narrow interval.

Meshes inside and around cones and ball bound the share, too: an interval as wide as theirs is
compared with both Booleans.
"""

import math
import time
from typing import Any

import numpy as np
from common import BALL, absent, cone_task, installed, medians, say, table
from meshes import mesh_share
from place_rings.coverage.rings.ring import named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.solids.spheres import sphere
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.targets.solid import target_solid
from place_rings.coverage.voxels.certified_bounds import bracket
from place_rings.objectives.scene import Scene

SIDES = 64
SETUP = "n3_16_55"
# radius of the shell, m, and requested width, points
INTERVALS = ((0.5, 1.0), (0.5, 0.1), (1.5, 1.0), (1.5, 0.1))
FULL = (*INTERVALS, (0.5, 0.01))


def report(full: bool) -> list[str]:
    """Measure and return blocks of Markdown."""
    return ["The cone task:", against_meshes(), "The reference scene:", cost_of_width(full)]


def against_meshes() -> str:
    """Compare an interval for the cone task with the two Booleans, which it must not exceed in
    width.
    """
    columns = ("method", "share of the ball, %", "width, points", "seconds", "relative")
    if not installed("manifold3d"):
        return table(columns, [absent("manifold3d", len(columns))])
    cones, ball = cone_task(), sphere(np.zeros(3), BALL)

    def meshes() -> tuple[float, ...]:
        return tuple(mesh_share(cones, SIDES, SIDES, BALL, outside) for outside in (False, True))

    low, high = meshes()

    def interval() -> Any:
        b = bracket(ball, cones, high - low)
        return b.low, b.high

    measured = medians({"certified": interval, f"two Booleans, {SIDES} sides": meshes})
    fast, rows = measured["certified"][1], []
    for name, ((a, b), seconds) in measured.items():
        share = [f"{100 * a:.3f} … {100 * b:.3f}", f"{100 * (b - a):.3f}"]
        rows.append([name, *share, f"{seconds:.2f}", f"{seconds / fast:.2f}"])
        say(*rows[-1])
    return table(columns, rows)


def cost_of_width(full: bool) -> str:
    """Measure narrower and narrower intervals on the reference scene."""
    scene, rows = Scene.paper(), []
    q = scene.poses[0].q
    cones = sensor_cones(scene.robot, named_setup(SETUP), q)
    for radius, width in FULL if full else INTERVALS:
        solid = target_solid(Shell(radius), scene.robot, q, scene.curve)
        start = time.perf_counter()
        b = bracket(solid, cones, width / 100)
        seconds = time.perf_counter() - start
        if not b.reached or math.isnan(b.low):
            raise SystemExit(f"{SETUP}, V_S({radius}): {width} points were not reached")
        share = f"{100 * b.low:.3f} … {100 * b.high:.3f}"
        effort = f"{b.cells:,}", f"{1000 * b.smallest:.2g}", f"{seconds:.2f}"
        rows.append([SETUP, f"V_S({radius:g})", f"{width:g}", share, *effort])
        say(*rows[-1])
    columns = ("setup", "target", "requested width, points", "ζ, %", "cells")
    return table((*columns, "smallest cell, mm", "seconds"), rows)
