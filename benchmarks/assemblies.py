"""Assemblies: drawn proposals of printed rings, placed on the robot and searched for collisions.

The draws and the judge are those of the tests; the judge reads only the files of `place-rings
export --to stl`.
"""

from typing import Any

import numpy as np
from common import on_each_core, own_process, table

ROBOTS = ("ur10", "ur5e", "ur3e", "ur10e", "panda")
EACH = {False: 2, True: 40}  # proposals of each robot; every second one has lids
# column: how proposals join, and its format
COLUMNS: dict[str, tuple[Any, str]] = {
    "rings": (sum, ".0f"),
    "parts": (sum, ".0f"),
    "largest overlap, mm³": (max, ".2f"),
    "least gap of two rings, mm": (min, ".1f"),
    "least gap to another link, mm": (min, ".1f"),
    "points within another part": (sum, ".0f"),
    "least distance from own beams, mm": (min, ".4f"),
    "least wall, mm": (min, ".2f"),
    "proposals with a file that is not watertight": (sum, ".0f"),
}


def judged(robot: str, number: int) -> list[float]:
    """Return the columns of one proposal; draws without room at their poses do not count."""
    from place_rings.formats.printing.print_files import ring_files

    from tests.formats.test_assembly import drawn_proposal
    from tests.support.assembly import judge

    rng, drawn = np.random.default_rng([number, *robot.encode()]), None
    while drawn is None:
        drawn = drawn_proposal(rng, robot, number % 2 == 1)
    scene, setup = drawn
    v = judge(scene, setup, ring_files(setup, scene, lambda *_: {})[1])
    extremes = (v.overlap, v.rings, v.bodies, v.within, v.beams, v.wall, not v.watertight)
    return [len(setup.rings), v.parts, *map(float, extremes)]


def report(full: bool) -> list[str]:
    """Judge the proposals and return blocks of Markdown."""
    tasks = [
        (own_process, judged, robot, number) for robot in ROBOTS for number in range(EACH[full])
    ]
    found, rows = on_each_core(tasks), []
    for i, robot in enumerate(ROBOTS):
        some = zip(*found[i * EACH[full] : (i + 1) * EACH[full]], strict=True)
        joined = zip(COLUMNS.values(), some, strict=True)
        rows.append([robot, EACH[full], *(format(join(v), form) for (join, form), v in joined)])
    intro = (
        "Drawn proposals of printed rings, placed on the robot by their files and searched for"
        " collisions at every pose. The draws have real mounts, 6 to 24 sensors, one to three"
        " poses, drawn bolts, fastenings and beds; every second one has lids. Points within"
        " another part lie more than 1 micrometre below its surface, of 4,000 on each part. Gaps"
        " above 50 mm are reported as 50."
    )
    return [intro, table(("robot", "proposals", *COLUMNS), rows)]
