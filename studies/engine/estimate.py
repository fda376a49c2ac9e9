"""How long a study will take, from a rehearsal in which nothing is measured.

A rehearsal gives a study results of the right form and lists the cells that it would measure. Each
is expected to take the mean time of its kind in the study's file, or else the time that the kind
took on the reference machine, scaled by a calibration of this one. While the study runs, the time
of its finished cells replaces that scale.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any
from zlib import crc32

from .runner import TASKS
from .store import Cell, Measure, Store

# seconds of a cell on the reference machine, an idle core of an x86-64 server, by its kind: that
# of its task, or of its rule where the task counts voxels
_SECONDS = {
    "place": 20.0,
    "short place": 9.0,
    "zeta sampled": 0.1,
    "zeta centre": 0.1,
    "zeta certified": 0.5,
    "zeta touch": 0.1,
    "unseeing sensors": 0.5,
    "share of points": 0.5,
    "benchmark score": 3.0,
    "bound": 240.0,
    "upper bound": 135.0,
    "minimum distance": 2.0,
    "unseen approach": 20.0,
    "random rings": 0.5,
    "twin trials": 2.0,
    "twin walk": 2.0,
    "twin spheres": 6.0,
}
_CALIBRATED = 0.033  # s, processor time of the calibration's count on that machine
_SURE = 0.05  # share of a study after which its own pace counts
_CALIBRATION = Cell(
    "zeta",
    {
        "scene": {},
        "setup": "n2_16_25",
        "target": "V_S",
        "radius": 0.5,
        "rule": "centre",
        "voxel": 0.005,
    },
)


def kind(cell: Cell) -> str:
    """Return what has the same expected time as a cell."""
    if cell.work == "zeta":
        return f"zeta {cell.arguments.get('rule')}"
    return "short place" if cell.arguments.get("short") else cell.work


def calibration() -> float:
    """Return how many times as long as the reference machine this one takes for a count."""
    from . import tasks  # noqa: F401  (registers the task)

    spent = []
    for _ in range(4):  # the first one loads modules and draws voxels
        began = time.process_time()
        TASKS[_CALIBRATION.work](**_CALIBRATION.arguments)
        spent.append(time.process_time() - began)
    return max(min(spent) / _CALIBRATED, 0.1)


def rehearsed(measure: Callable[[Measure], Any]) -> list[list[Cell]]:
    """Return the cells of each call that a study makes; ``measure`` runs it with a function that
    measures cells under a heading."""
    calls, targets = list[list[Cell]](), list[tuple[Any, Any]]()

    def run(heading: str, cells: list[Cell]) -> list[Any]:
        calls.append(list(cells))
        return [_example(cell, targets) for cell in cells]

    measure(run)
    return calls


def _example(cell: Cell, targets: list[tuple[Any, Any]]) -> Any:
    """Return a result of the form of a cell's. Setups lie on a front of the first two targets."""
    drawn = crc32(cell.key.encode()) / 2**32
    rings = [{"link": "forearm", "position": drawn, "count": 8, "tilt_deg": 0.0, "radius": 0.1}]
    if cell.work == "zeta":
        target = cell.arguments["target"], cell.arguments["radius"]
        if target not in targets:
            targets.append(target)
        percent = 100 * crc32(repr(cell.arguments["setup"]).encode()) / 2**32
        percent = percent if target == targets[0] else 100 - percent
        shares = {f"{key}_percent": percent for key in ("zeta", "low", "high")}
        return shares | {"target": 1, "covered": 1, "seconds": 0.0}
    spent = {"processor_seconds": 0.0, "wall_seconds": 0.0}
    return {
        "place": rings,
        "place in time": {"rings": rings, "finished": True, **spent},
        "unseeing sensors": 0,
        "share of points": 0.0,
        "bound": {
            **{f"{name}_percent": 0.0 for name in ("greedy", "chosen")},
            **{f"{name}_bound_percent": 0.0 for name in ("integer", "linear")},
            **{"optimal": True, "rings": 0, "groups": 0},
        },
        "upper bound": {
            **{f"{name}_percent": 0.0 for name in ("bound", "volume", "prices")},
            "seconds": 0.0,
        },
        "benchmark score": {
            **{"sensors": 1, "rings": 1, "broken": []},
            **dict.fromkeys(("percent", "low_percent", "high_percent"), 0.0),
        },
        "minimum distance": {},
        "unseen approach": [],
        "random rings": rings,
        "twin trials": {
            **dict.fromkeys(("predicted_percent", "best_percent", "any_percent"), 0.0),
            **{"places": 1, "noticed": 0, "several_zones": False, "bins": []},
        },
        "twin spheres": {
            **dict.fromkeys(("low_mm", "high_mm"), 0.0),
            **dict.fromkeys(("reports", "places", "met"), 0),
        },
        "twin walk": {
            **{"predicted_percent": 0.0, "moments": 1, "noticed": 0, "several_zones": False}
        },
    }[cell.work]


@dataclass
class Estimate:
    """Expected time of a study, which its progress corrects."""

    calls: Sequence[float]
    """Expected processor seconds of each call's cells, without those that are stored."""
    cells: int
    """Number of cells to measure."""
    workers: int
    """Number of processes."""
    cost: Callable[[Cell], float]
    """Expected processor seconds of a cell; 0 for one that is stored."""
    _done: float = field(default=0.0, init=False)  # expected seconds of the calls before this one
    _call: int = field(default=-1, init=False)
    _here: float = field(default=0.0, init=False)  # expected seconds of this call
    _part: float = field(default=0.0, init=False)  # finished share of it
    _stored: int = field(default=0, init=False)
    _began: float = field(default_factory=lambda: time.monotonic(), init=False)

    @classmethod
    def of(
        cls, calls: Sequence[Sequence[Cell]], store: Store, workers: int, scale: float
    ) -> "Estimate":
        """Return the estimate for the calls of a rehearsal.

        Args:
            calls: cells of each call.
            store: holds finished cells, and the times of others.
            workers: number of processes.
            scale: result of ``calibration``.
        """
        known = store.means(kind)

        def cost(cell: Cell) -> float:
            if store.get(cell) is not None:
                return 0.0
            if cell.work == "place in time":  # limited in processor seconds on every machine
                return float(cell.arguments["seconds"])
            return known.get(kind(cell), _SECONDS[kind(cell)] * scale)

        first = {cell.key: i for i, cells in reversed([*enumerate(calls)]) for cell in cells}
        costs = {cell.key: cost(cell) for cells in calls for cell in cells}
        sums = [0.0] * len(calls)
        for key, i in first.items():
            sums[i] += costs[key]
        return cls(sums, sum(one > 0 for one in costs.values()), workers, cost)

    @property
    def seconds(self) -> float:
        """Expected time of the study, s."""
        return sum(self.calls) / self.workers

    def begin(self, cells: Sequence[Cell]) -> None:
        """Begin the next call."""
        self._done += self._here
        costs = [self.cost(cell) for cell in cells]
        self._call, self._here, self._part = self._call + 1, sum(costs), 0.0
        self._stored = sum(cost == 0 for cost in costs)

    def at(self, done: int, total: int) -> None:
        """Take the number of finished cells of the call, and of all."""
        self._part = max(done - self._stored, 0) / max(total - self._stored, 1)

    @property
    def left(self) -> float:
        """Expected time that is left, s."""
        done = self._done + self._part * self._here
        rest = (1 - self._part) * self._here + sum(self.calls[self._call + 1 :])
        own = done > _SURE * (done + rest)
        pace = (time.monotonic() - self._began) / done if own else 1 / self.workers
        return rest * pace
