"""Faults of the rig at random moments: reports and detection times.

Run: python benchmarks rig               both sections of the page, 20 runs of each fault
     python benchmarks rig --busy        the same beside eight busy processes
     python benchmarks/rig.py 2          2 runs of each, printed
     python benchmarks/rig_moving.py 2 [busy] [WORDS]    the named faults of a moving robot
"""

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

from common import table
from loads import (
    Measured,
    code,
    joined_rows,
    loads,
    measured,
    processes_of,
    runs_of_options,
    side_by_side,
)
from rig_found import Found
from rig_ring_faults import of_rings
from rig_robot_faults import of_robot
from rig_speed import throughput

RUNS = 20
_COLUMNS = (
    *("fault", "runs", "report", "median, ms", "worst, ms"),
    *("bound, ms", "wrong joints", "records lost"),
)


def faults(runs: int, seed: int = 0) -> list[tuple[tuple, Found]]:
    """Return the rows of the table and the results of each fault; two parts run at once, as
    both mostly wait.
    """
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        parts = [pool.submit(part, runs, seed) for part in (of_robot, of_rings)]
        return [each for part in parts for each in part.result()]


def figures(runs: int) -> dict[str, Any]:
    """Measure all faults and the speed; return them as plain values."""
    found = faults(runs)
    return {
        "rows": [[str(cell) for cell in cells] for cells, _ in found],
        "closing": max(each.closing for _, each in found),
        "again": sum(each.disturbed for _, each in found),
        "speed": [[str(cell) for cell in row] for row in throughput()],
    }


def report(options: Sequence[str] = ()) -> list[str]:
    """Measure, and return both tables with the figures of both loads.

    ``--runs=N`` sets the number of runs of each fault; ``--busy`` measures beside busy processes.
    """
    runs = runs_of_options(options, RUNS)
    both = measured(f"rig {runs}", code(__file__), processes_of(options), lambda: figures(runs))
    return page(runs, *both)


def page(runs: int, quiet: Measured | None, beside: Measured | None) -> list[str]:
    """Return Markdown for the figures on a quiet machine and beside busy processes."""
    each = [m.figures if m else None for m in (quiet, beside)]
    again = side_by_side(*(f and f["again"] for f in each))
    ending = side_by_side(*(f and f"{f['closing']:.2f}" for f in each))
    intro = [
        f"{runs} runs of each fault on the simulated rig, through unmodified ur-rtde and pyserial:"
        " `python benchmarks rig` on a quiet machine, `python benchmarks rig --busy` beside eight"
        " busy processes. Where both are measured, cells state both: quiet / busy.",
        "Times run from the injection of a fault to its detection.",
        "Bounds exclude the time that a busy machine needs to wake a thread.",
        "Wrong joints: joint vectors that were returned although they were older than 80 ms,"
        " or did not match the robot's pose, of all requested ones.",
        "Records lost: records that were received but are missing in the replay. Ending a"
        f" session took at most {ending} s.",
        "Repeated runs, because the machine delayed the link beyond its bound before the"
        f" fault: {again}.",
        "",
        *loads(quiet, beside),
        "",
    ]
    rows = joined_rows([f and f["rows"] for f in each], _COLUMNS)
    speed = joined_rows([f and f["speed"] for f in each], ("what", "", "", ""))
    return [*intro, *table(_COLUMNS, rows), "", "Speed:", "", *table(("what", "", "", ""), speed)]


if __name__ == "__main__":
    for cells, _ in faults(int(sys.argv[1])):
        print(*cells, sep=" | ")
