"""Faults of the rig at random moments: reports and detection times.

Run: python benchmarks rig               the section of the report, 20 runs of each
     python benchmarks/rig.py 2          2 runs of each, printed
     python benchmarks/rig_moving.py 2 [busy] [WORDS]    the named faults of a moving robot
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
    """Return the rows of the table and the results of each fault; two parts run at once, as
    both mostly wait.
    """
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        parts = [pool.submit(part, runs, seed) for part in (of_robot, of_rings)]
        return [each for part in parts for each in part.result()]


def report(runs: int = RUNS) -> list[str]:
    """Return both tables."""
    columns = (
        "fault",
        "runs",
        "report",
        "median, ms",
        "worst, ms",
        "bound, ms",
        "wrong joints",
        "records lost",
    )
    intro = [
        (
            f"{runs} runs of each fault on the simulated rig, through unmodified ur-rtde and"
            " pyserial: `python benchmarks rig`."
        ),
        "Times run from the injection of a fault to its detection.",
        "Bounds exclude the time that a busy machine needs to wake a thread (MEAN).",
        (
            "Wrong joints: joint vectors that were returned although they were older than 80 ms,"
            " or did not match the robot's pose, of all requested ones."
        ),
        (
            "Records lost: records that were received but are missing in the replay. Ending a"
            " session took at most ENDING s."
        ),
        (
            "Repeated runs, because the machine delayed the link beyond its bound before the"
            " fault: AGAIN."
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
