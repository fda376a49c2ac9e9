"""What came of a fault's runs, and its row in the table."""

import statistics
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from place_rings.rig.robot.motion import MoveRefusedError
from place_rings.rig.robot.vetting import LinkFaultError

WAIT = 3.0  # s, for a fault to be found
PLAIN = ("-m", "place_rings.rig.simulated")


@dataclass
class Found:
    """What came of a fault's runs. outcomes: how often what. seconds: to be found. wrong: joint
    vectors that were given though stale or untrue. lost: of what was gathered, not in the
    recording. closing: s, the longest that ending took."""

    outcomes: Counter = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)
    wrong: int = 0
    given: int = 0
    lost: int = 0
    disturbed: int = 0
    closing: float = 0.0

    def times(self) -> tuple[str, str]:
        """Median and worst, ms."""
        ms = [1000 * s for s in self.seconds]
        return (f"{statistics.median(ms):.0f}", f"{max(ms):.0f}") if ms else ("", "")


def until(check: Callable[[], bool]) -> bool:
    """Whether something comes true in time."""
    end = time.monotonic() + WAIT
    while not check() and time.monotonic() < end:
        time.sleep(0.002)
    return check()


def row(name: str, runs: int, run: Callable[[Found], None], bound: str) -> tuple[tuple, Found]:
    """The row of a fault, and what was found in so many runs; those that the machine disturbed are
    begun again.
    """
    found = Found()
    while sum(found.outcomes.values()) < runs:
        try:
            run(found)
        except (LinkFaultError, MoveRefusedError) as error:
            found.disturbed += 1
            print("begun again:", name, error, flush=True)
    happened = "; ".join(f"{what} ({n})" for what, n in found.outcomes.most_common())
    given = f"{found.wrong} of {found.given}" if found.given else ""
    cells = (name, runs, happened, *found.times(), bound, given, found.lost)
    print(*cells, f"ending {found.closing:.2f} s", sep=" | ", flush=True)
    return cells, found
