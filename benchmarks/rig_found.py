"""Results of a fault's runs, and its row in the table."""

import statistics
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from place_rings.rig.robot.motion import MoveRefusedError
from place_rings.rig.robot.vetting import LinkFaultError

_TRIES = 12  # attempts at a run on a machine that is too busy for a real rig's limits
WAIT = 3.0  # s, timeout for the detection of a fault
PLAIN = ("-m", "place_rings.rig.simulated")


@dataclass
class Found:
    """Results of a fault's runs."""

    outcomes: Counter = field(default_factory=Counter)
    """Number of runs by report."""
    seconds: list[float] = field(default_factory=list)
    """Detection times, s."""
    wrong: int = 0
    """Joint vectors that were returned although stale or wrong."""
    given: int = 0
    """Joint vectors that were returned."""
    lost: int = 0
    """Records that were received but are missing in the recording."""
    disturbed: int = 0
    """Runs that were repeated because the machine was too busy."""
    closing: float = 0.0
    """Longest time to end a session, s."""

    def times(self) -> tuple[str, str]:
        """Return median and maximum detection time, ms."""
        ms = [1000 * s for s in self.seconds]
        return (f"{statistics.median(ms):.0f}", f"{max(ms):.0f}") if ms else ("", "")


def until(check: Callable[[], bool]) -> bool:
    """Wait for a condition; return whether it became true in time."""
    end = time.monotonic() + WAIT
    while not check() and time.monotonic() < end:
        time.sleep(0.002)
    return check()


def row(name: str, runs: int, run: Callable[[Found], None], bound: str) -> tuple[tuple, Found]:
    """Run a fault and return its row and results.

    Runs that a busy machine disturbed are repeated, up to a dozen times each.
    """
    found = Found()
    while (done := sum(found.outcomes.values())) < runs:
        if done + found.disturbed >= _TRIES * runs:
            break
        try:
            run(found)
        except (LinkFaultError, MoveRefusedError) as error:
            found.disturbed += 1
            print("repeated:", name, error, flush=True)
    happened = "; ".join(f"{what} ({n})" for what, n in found.outcomes.most_common())
    given = f"{found.wrong} of {found.given}" if found.given else ""
    cells = (name, sum(found.outcomes.values()), happened, *found.times(), bound, given, found.lost)
    print(*cells, f"ending {found.closing:.2f} s", sep=" | ", flush=True)
    return cells, found
