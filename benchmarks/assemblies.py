"""Assemblies: drawn proposals of printed rings, placed on the robot and searched for collisions.

Each proposal has real mounts, 6 to 24 sensors of a VL53L4CD or VL53L5CX, one to three poses about
the robot's own, M3 to M5 bolts in nuts or heat-set inserts, any bed or one of 220 or 120 mm, and
rings anywhere that the scene's rules allow. The judge reads only the files of `place-rings export
--to stl`: it places every part by `T_link_print` of `printing.json`, and compares the rings with
each other and with the robot's bodies, at every pose, by manifold3d. Of 4,000 points on each part
it counts those within another part of the same ring, by trimesh. It evaluates the exact functions
of a ring's own beams on its surface; a value above 0 means that no printed material lies in a beam.
Rays through each file measure its walls. Gaps above 50 mm are reported as 50; watertight is
trimesh's verdict on each file. Draws without room for a ring at their poses are not counted.

Run: python benchmarks assemblies            40 proposals of each robot
"""

import sys
from pathlib import Path

import numpy as np
from common import table

sys.path.insert(0, str(Path(__file__).parent.parent))

from place_rings.formats.printing.print_files import ring_files

from tests.assembly import Verdict, judge
from tests.test_assembly import drawn_proposal

ROBOTS = ("ur10", "ur5e", "ur3e", "ur10e", "panda")
PROPOSALS = 40


def judged(name: str, proposals: int) -> tuple[list[Verdict], int]:
    """Return the verdicts on ``proposals`` drawn proposals of a robot, and their rings."""
    rng, verdicts, rings = np.random.default_rng(0), list[Verdict](), 0
    while len(verdicts) < proposals:
        if (drawn := drawn_proposal(rng, name)) is None:
            continue
        scene, setup = drawn
        _, data = ring_files(setup, scene, lambda *_: {})
        verdicts.append(judge(scene, setup, data))
        rings += len(setup.rings)
    return verdicts, rings


def report(proposals: int = PROPOSALS) -> list[str]:
    """Return the table of all robots."""
    rows = []
    for name in ROBOTS:
        verdicts, rings = judged(name, proposals)
        rows.append(
            (
                name,
                len(verdicts),
                rings,
                sum(v.parts for v in verdicts),
                f"{max(v.overlap for v in verdicts):.2f}",
                f"{min(v.rings for v in verdicts):.1f}",
                f"{min(v.bodies for v in verdicts):.1f}",
                sum(v.within for v in verdicts),
                f"{min(v.beams for v in verdicts):.4f}",
                f"{min(v.wall for v in verdicts):.2f}",
                "all" if all(v.watertight for v in verdicts) else "not all",
            )
        )
        print(*rows[-1], flush=True)
    columns = (
        "robot",
        "proposals",
        "rings",
        "parts",
        "largest overlap, mm³",
        "least gap of two rings, mm",
        "least gap to another link, mm",
        "points within another part",
        "least distance from own beams, mm",
        "least wall, mm",
        "files watertight",
    )
    lines = (__doc__ or "").partition("\n\nRun:")[0].splitlines()[2:]
    return [*lines, "", *table(columns, rows)]


if __name__ == "__main__":
    print(*report(), sep="\n")
