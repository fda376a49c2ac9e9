"""Assemblies: drawn proposals of printed rings, placed on the robot and searched for collisions.

Each proposal has real mounts, 6 to 24 sensors of a VL53L4CD or VL53L5CX, one to three poses about
the robot's own, and its rings anywhere that the scene's rules allow. The judge reads only the files
of `place-rings export --to stl`: it places every part by `T_link_print` of `printing.json`, and
compares the parts of different rings with each other and all parts with the robot's bodies, at
every pose, by manifold3d. Gaps above 50 mm are reported as 50; watertight is trimesh's verdict on
each file. Draws without room for a ring at their poses are not counted.

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
        verdicts.append(judge(scene, data))
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
                f"{max(v.overlap for v in verdicts):.2f}",
                f"{min(v.rings for v in verdicts):.1f}",
                f"{min(v.bodies for v in verdicts):.1f}",
                "all" if all(v.watertight for v in verdicts) else "not all",
            )
        )
        print(*rows[-1], flush=True)
    columns = (
        "robot",
        "proposals",
        "rings",
        "largest overlap, mm³",
        "least gap of two rings, mm",
        "least gap to another link, mm",
        "files watertight",
    )
    lines = (__doc__ or "").partition("\n\nRun:")[0].splitlines()[2:]
    return [*lines, "", *table(columns, rows)]


if __name__ == "__main__":
    print(*report(), sep="\n")
