"""The rig's faults, each at random moments: what happens, and how soon it is found.

Run: python benchmarks rig               the section of the report, 20 runs of each
     python benchmarks/rig.py 2          2 runs of each, printed
     python benchmarks/rig_moving.py 2 [busy] [WORDS]    those while the robot moves that WORDS name
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from common import table
from rig_found import Found
from rig_ring_faults import of_rings
from rig_robot_faults import of_robot
from rig_speed import throughput

RUNS = 20


def faults(runs: int, seed: int = 0) -> list[tuple[tuple, Found]]:
    """Rows of the table, and what was found: two parts at once, as each mostly waits."""
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        parts = [pool.submit(part, runs, seed) for part in (of_robot, of_rings)]
        return [each for part in parts for each in part.result()]


def report(runs: int = RUNS) -> list[str]:
    """Both tables."""
    columns = (
        "fault",
        "runs",
        "what happens",
        "median, ms",
        "worst, ms",
        "bound, ms",
        "joints given wrong",
        "records lost",
    )
    intro = [
        (
            f"{runs} runs of each, on the simulated rig, through unmodified ur-rtde and pyserial:"
            " `python benchmarks rig`."
        ),
        "Times are from the fault's doing to its finding.",
        "Bounds are without what a busy machine takes to wake a thread (MEAN).",
        (
            "Joints given wrong: vectors that were handed out older than 80 ms, or not where the"
            " robot stood, of all asked for."
        ),
        (
            "Records lost: of what was gathered, not in the recording's replay. Ending a session"
            " took at most ENDING s."
        ),
        (
            "Runs begun again, as the machine kept the link waiting beyond its bound before"
            " anything was done: AGAIN."
        ),
        "",
    ]
    found = faults(runs)
    rows, ending = [cells for cells, _ in found], max(each.closing for _, each in found)
    again = str(sum(each.disturbed for _, each in found))
    load = f"mean load here: {os.getloadavg()[2]:.1f} on {os.cpu_count()} cores"
    head = [
        line.replace("MEAN", load).replace("ENDING", f"{ending:.2f}").replace("AGAIN", again)
        for line in intro
    ]
    speed = ["", "Speed:", "", *table(("what", "", "", ""), throughput())]
    return [*head, *table(columns, rows), *speed]


if __name__ == "__main__":
    print("\n".join(report(int(sys.argv[1]))))
