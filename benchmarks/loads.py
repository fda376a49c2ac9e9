"""Measurements on a quiet machine and beside busy processes, side by side.

``--busy`` measures beside eight busy processes, which the benchmark starts and stops itself;
without it, nothing else runs. Each measurement is kept in a file of the current folder, so that the
page shows both, if the same code made them.
"""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from place_rings.studies.engine.import_closure import ImportGraph
from place_rings.studies.engine.provenance import digests

BUSY = 8  # processes
KEPT = Path("rig_loads.jsonl")
_ONCE = ("report", "bound, ms")  # columns of one figure where both are equal
# ends with the benchmark, even if that is killed
_SPIN = "import os\nwhile os.getppid() == {}:\n    for _ in range(10**6): pass"


@dataclass(frozen=True)
class Measured:
    """A measurement under one load."""

    name: str
    """Name of the benchmark, with its settings."""
    code: str
    """Fingerprint of the code."""
    processes: int
    """Number of busy processes beside it."""
    before: float
    """Load average of the last minute before it and before these processes."""
    after: float
    """Load average of the last minute at its end."""
    figures: Any
    """What was measured, as plain values."""

    @property
    def load(self) -> str:
        """The load, as text."""
        beside = f"beside {self.processes} busy processes" if self.processes else "quiet"
        return (
            f"{beside}: load average {self.before:.1f} before, {self.after:.1f} after, on"
            f" {os.cpu_count()} cores"
        )


@contextmanager
def busy(count: int) -> Iterator[None]:
    """Keep the machine busy with ``count`` processes in this context."""
    words = [sys.executable, "-c", _SPIN.format(os.getpid())]
    spinning = [subprocess.Popen(words) for _ in range(count)]
    try:
        yield
    finally:
        for process in spinning:
            process.kill()
            process.wait()


def processes_of(options: Sequence[str]) -> int:
    """Return the number of busy processes that the options ask for: ``--busy`` or none."""
    return BUSY if "--busy" in options else 0


def runs_of_options(options: Sequence[str], default: int) -> int:
    """Return the number of runs: ``--runs=N``, or the default."""
    return int(next((o.partition("=")[2] for o in options if o.startswith("--runs=")), default))


def code(file: str) -> str:
    """Return a fingerprint of all code that ``file`` can reach."""
    files = digests([Path(file).resolve()], ImportGraph())
    return hashlib.sha256(json.dumps(files).encode()).hexdigest()[:16]


def measured(
    name: str, code: str, processes: int, measure: Callable[[], Any]
) -> tuple[Measured | None, Measured | None]:
    """Measure beside ``processes`` busy processes and keep the figures.

    Returns:
        The newest kept measurements of the same name and code: on a quiet machine, and beside busy
        processes; None where there is none.
    """
    before = os.getloadavg()[0]
    with busy(processes):
        figures = measure()
        one = Measured(name, code, processes, before, os.getloadavg()[0], figures)
    with KEPT.open("a") as file:
        file.write(json.dumps(asdict(one)) + "\n")
    kept = [Measured(**json.loads(line)) for line in KEPT.read_text().splitlines()]
    same = [m for m in kept if (m.name, m.code) == (name, code)]
    return (
        next((m for m in reversed(same) if not m.processes), None),
        next((m for m in reversed(same) if m.processes), None),
    )


def loads(quiet: Measured | None, beside: Measured | None) -> list[str]:
    """Return the lines that state the loads, and which of both figures is missing."""
    lines = [f"- {one.load}." for one in (quiet, beside) if one]
    lines += ["- quiet: not measured yet."] * (quiet is None)
    return lines + ["- beside busy processes: not measured yet (`--busy`)."] * (beside is None)


def side_by_side(quiet: Any, beside: Any, always: bool = True) -> str:
    """Return one cell for both figures, "quiet / busy"; one figure if the other is missing, or if
    they are equal and ``always`` is false.
    """
    known = [str(v) for v in (quiet, beside) if v is not None]
    return (
        known[0] if (not always and known[0] == known[-1]) or not any(known) else " / ".join(known)
    )


def joined_rows(
    tables: Sequence[list[list[str]] | None], columns: Sequence[str]
) -> list[list[str]]:
    """Return the rows of two tables as one; their first cells are the same."""
    known = next(rows for rows in tables if rows)
    pairs = zip(*(rows or [None] * len(known) for rows in tables), strict=True)
    return [
        [
            name[0],
            *(
                side_by_side(*(row and row[i] for row in pair), always=columns[i] not in _ONCE)
                for i in range(1, len(columns))
            ),
        ]
        for name, pair in zip(known, pairs, strict=True)
    ]
