"""Assemblies: drawn proposals of printed rings, placed on the robot and searched for collisions.

Each proposal has real mounts, 6 to 24 sensors of a VL53L4CD or VL53L5CX, one to three poses about
the robot's own, M3 to M5 bolts in nuts or heat-set inserts, any bed or one of 220 or 120 mm, lids
or none, and rings anywhere that the scene's rules allow. The judge reads only the files of
`place-rings export --to stl`: it places every part by `T_link_print` of `printing.json`, and
compares the rings with each other and with the robot's bodies, at every pose, by manifold3d. Of
4,000 points on each part it counts those more than 1 micrometre below the surface of another part
of the same ring, by trimesh; within that depth faces that touch agree in the files. It evaluates
the exact functions of a ring's own beams on its surface; a value above 0 means that no printed
material lies in a beam. Rays through each file measure its walls. Gaps above 50 mm are reported as
50; watertight is trimesh's verdict on each file. Draws without room for a ring at their poses are
not counted.

Run: python benchmarks assemblies            40 proposals of each robot; can be resumed
     python benchmarks assemblies --runs=0   from existing measurements
     python benchmarks/assemblies.py --quick  two proposals of one robot
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from cell_runs import ONE, answer, measured
from common import table

sys.path.insert(0, str(Path(__file__).parent.parent))

from place_rings.formats.printing.print_files import ring_files
from place_rings.studies.engine.digest import digest
from place_rings.studies.engine.store import Cell

from tests.assembly import judge
from tests.test_assembly import drawn_proposal

ROBOTS = ("ur10", "ur5e", "ur3e", "ur10e", "panda")
PROPOSALS, EACH = 40, 10  # of each robot; of a cell
ROOT = Path(__file__).parent.parent
JUDGES = [ROOT / "tests" / name for name in ("assembly.py", "test_assembly.py")]
FOLDER = ROOT / "results" / "assemblies"
COLUMNS = {  # column by name of a value: its text, how to join cells, and its format
    "proposals": ("proposals", sum, ".0f"),
    "lids": ("with lids", sum, ".0f"),
    "rings": ("rings", sum, ".0f"),
    "parts": ("parts", sum, ".0f"),
    "overlap": ("largest overlap, mm³", max, ".2f"),
    "ring_gap": ("least gap of two rings, mm", min, ".1f"),
    "body_gap": ("least gap to another link, mm", min, ".1f"),
    "within": ("points within another part", sum, ".0f"),
    "beams": ("least distance from own beams, mm", min, ".4f"),
    "wall": ("least wall, mm", min, ".2f"),
    "open": ("files not watertight", sum, ".0f"),
}


def measure(robot: str, proposals: int, seed: int, of: str = "") -> dict[str, Any]:
    """Judge drawn proposals of a robot, every second one with lids; return the extreme values."""
    start, rng = time.process_time(), np.random.default_rng([seed, *robot.encode()])
    verdicts, lids, rings = [], 0, 0
    while len(verdicts) < proposals:
        cover = len(verdicts) % 2 == 1
        if (drawn := drawn_proposal(rng, robot, cover)) is None:
            continue
        scene, setup = drawn
        _, data = ring_files(setup, scene, lambda *_: {})
        verdicts.append(judge(scene, setup, data))
        lids, rings = lids + cover, rings + len(setup.rings)
    return {
        "proposals": len(verdicts),
        "lids": lids,
        "rings": rings,
        "parts": sum(v.parts for v in verdicts),
        "overlap": max(v.overlap for v in verdicts),
        "ring_gap": min(v.rings for v in verdicts),
        "body_gap": min(v.bodies for v in verdicts),
        "within": sum(v.within for v in verdicts),
        "beams": min(v.beams for v in verdicts),
        "wall": min(v.wall for v in verdicts),
        "open": sum(not v.watertight for v in verdicts),
        "seconds": round(time.process_time() - start, 1),
    }


def report(arguments: Sequence[str] = ()) -> list[str]:
    """Judge the missing proposals and return the table of all robots."""
    parser = argparse.ArgumentParser(formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("--runs", type=int, default=10**6, help="largest number of new cells")
    parser.add_argument("--quick", action="store_true", help="one robot, no files")
    given = parser.parse_args(list(arguments))
    of = " ".join(digest(file) for file in (Path(__file__), *JUDGES))
    robots, each = (ROBOTS[:1], 2) if given.quick else (ROBOTS, EACH)
    seeds = range(1 if given.quick else PROPOSALS // EACH)
    cells = [
        Cell("assemblies", {"robot": r, "proposals": each, "seed": i, "of": of})
        for r in robots
        for i in seeds
    ]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) if given.quick else FOLDER
        results = measured(Path(__file__), folder, cells, given.runs)
    rows = []
    for robot in robots:
        if some := [result for cell, result in results if cell.arguments["robot"] == robot]:
            joined = ((join(r[k] for r in some), form) for k, (_, join, form) in COLUMNS.items())
            rows.append((robot, *(format(value, form) for value, form in joined)))
    lines = (__doc__ or "").partition("\n\nRun:")[0].splitlines()[2:]
    heads = ("robot", *(head for head, _, _ in COLUMNS.values()))
    seconds = sum(result["seconds"] for _, result in results)
    return [*lines, "", *table(heads, rows), "", f"All took {seconds:.0f} processor seconds."]


if __name__ == "__main__":
    if sys.argv[1:2] == [ONE]:
        answer(measure, sys.argv[1:])
    else:
        print(*report(sys.argv[1:]), sep="\n")
