"""Studies whose processes are killed at random moments.

Run: python benchmarks kills               the section of the report
     python benchmarks/kills.py 2 2 1 80   on a small scale

The four numbers: kills of the driver, kills of workers, Ctrl-Cs, and cells of the study.
"""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from common import table
from noted import NOTES, cells
from place_rings.studies.engine import runner as engine
from place_rings.studies.engine.registry import TASKS
from place_rings.studies.engine.store import Store

_START = 6.0  # s, approximate start time of a study; some kills come earlier
_BETWEEN = 12  # largest number of cells between two kills, before a random delay
_MOMENT = 0.2  # s
CELLS = 600
_PATIENCE = 60.0  # s, timeout for the next cell, and for processes to end


@dataclass
class Damage:
    """Disturbances of a study, and their consequences."""

    kills: int = 0
    starting: int = 0  # kills before the first cell of a run was stored
    lost: int = 0  # stored cells that were missing or changed after a kill
    again: int = 0  # stored cells measured again
    wasted: int = 0  # cells measured again that were not stored yet
    gone: float = 0.0  # s, longest time that a process outlived its driver
    different: int = 0  # cells that differ from the undisturbed run


class Disturbed:
    """A study in its own folder that is disturbed at random moments given by a seed."""

    def __init__(self, folder: Path, count: int, seed: int) -> None:
        self.folder, self.count, self.rng, self.damage = (
            folder,
            count,
            np.random.default_rng(seed),
            Damage(),
        )
        self.notes, self.errors, self.before = folder / "notes", (folder / "errors").open("w+"), {}
        self.notes.touch()

    def start(self) -> subprocess.Popen:
        """Start the study's driver in its own process group, like a terminal's foreground
        process.
        """
        command = [
            sys.executable,
            str(Path(__file__).with_name("noted.py")),
            str(self.folder),
            str(self.count),
        ]
        environment = {**os.environ, NOTES: str(self.notes)}
        return subprocess.Popen(
            command, env=environment, start_new_session=True, stderr=self.errors
        )

    def kept(self) -> int:
        """Return the number of cells noted as stored."""
        return self.notes.read_text().count("kept ")

    def await_moment(self, driver: subprocess.Popen, first: bool) -> None:
        """Wait for a random moment, during the start of the driver or after some more cells."""
        more, moment = int(self.rng.integers(0 if first else 1, _BETWEEN)), self.rng.uniform()
        start, until = self.kept(), time.monotonic() + _PATIENCE
        while (
            more
            and self.kept() < start + more
            and driver.poll() is None
            and time.monotonic() < until
        ):
            time.sleep(0.002)
        time.sleep(moment * (_MOMENT if more else _START))
        self.damage.starting += first and self.kept() == start

    def strike_driver(self, how: signal.Signals) -> bool:
        """Start the driver and kill it; return False if it ended before."""
        driver = self.start()
        self.await_moment(driver, first=True)
        if driver.poll() is not None:
            return False
        family = psutil.Process(driver.pid).children(recursive=True)
        os.killpg(driver.pid, how) if how == signal.SIGINT else driver.kill()
        driver.wait(_PATIENCE)
        struck = time.monotonic()
        while any(_lives(p) for p in family):
            if time.monotonic() - struck > _PATIENCE:
                raise SystemExit("processes outlived their driver")
            time.sleep(0.01)
        self.damage.gone = max(self.damage.gone, time.monotonic() - struck)
        self.damage.kills += 1
        self.look()
        return True

    def strike_workers(self, kills: int) -> None:
        """Start the driver, kill some of its workers, and let it finish."""
        driver = self.start()
        while self.damage.kills < kills and driver.poll() is None:
            self.await_moment(driver, first=False)
            # this worker has ended: its driver ended, or another worker replaced it
            with suppress(psutil.NoSuchProcess):
                workers = [
                    p
                    for p in psutil.Process(driver.pid).children()
                    if "spawn_main" in " ".join(p.cmdline())
                ]
                if workers:
                    workers[self.rng.integers(len(workers))].kill()
                    self.damage.kills += 1
        if driver.wait(10 * _PATIENCE):
            self.errors.seek(0)
            raise SystemExit(f"the driver ended by {driver.returncode}: {self.errors.read()}")
        self.look()

    def look(self) -> None:
        """Compare the stored cells with those noted as stored, and with the earlier ones."""
        now = results(self.folder / "cells.sqlite")
        lines = [line.partition(" ") for line in self.notes.read_text().splitlines()]
        kept = {key for word, _, key in lines if word == "kept"}
        self.damage.lost += len(kept - set(now)) + sum(
            now.get(key) != result for key, result in self.before.items()
        )
        self.before = now

    def finish(self, undisturbed: dict[str, Any]) -> Damage:
        """Complete the study and return the damage."""
        seen, kept = set(), set()
        for word, _, key in (line.partition(" ") for line in self.notes.read_text().splitlines()):
            if word == "kept":
                self.damage.again += key in kept
                kept.add(key)
            else:
                self.damage.again += key in kept
                self.damage.wasted += key in seen and key not in kept
                seen.add(key)
        end = {
            key: _timeless(result)
            for key, (result, _) in results(self.folder / "cells.sqlite").items()
        }
        self.damage.different = sum(
            end.get(key) != undisturbed.get(key) for key in {*end, *undisturbed}
        )
        return self.damage


def _lives(process: psutil.Process) -> bool:
    with suppress(psutil.NoSuchProcess):
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    return False


def _timeless(result: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in result.items() if key != "seconds"}


def results(file: Path) -> dict[str, tuple[Any, float]]:
    """Return result and time of every cell in a study's file."""
    if not file.exists():
        return {}
    base = sqlite3.connect(file)
    try:
        tables = base.execute("SELECT count(*) FROM sqlite_master WHERE name = 'cells'").fetchone()[
            0
        ]
        rows = base.execute("SELECT key, result, seconds FROM cells").fetchall() if tables else []
    finally:
        base.close()
    return {key: (json.loads(result), seconds) for key, result, seconds in rows}


def undisturbed(count: int) -> dict[str, Any]:
    """Return the results by cell of a study without disturbance."""
    with (
        tempfile.TemporaryDirectory() as folder,
        Store(Path(folder) / "cells.sqlite", "kills") as store,
    ):
        found = engine.run(cells(count), TASKS, store)
    return {cell.key: _timeless(result) for cell, result in zip(cells(count), found, strict=True)}


def disturb(
    drivers: int, workers: int, interrupts: int, wanted: dict[str, Any], seed: int = 0
) -> Damage:
    """Disturb a study that often and compare it with the undisturbed results."""
    with tempfile.TemporaryDirectory() as folder:
        study = Disturbed(Path(folder), len(wanted), seed)
        for how in [signal.SIGKILL] * drivers + [signal.SIGINT] * interrupts:
            if not study.strike_driver(how):
                break
        study.strike_workers(workers)
        return study.finish(wanted)


def report() -> list[str]:
    """Return Markdown for twenty disturbances of each kind."""
    kinds = {
        "`kill -9` of the driver": (20, 0, 0),
        "`kill -9` of a worker": (0, 20, 0),
        "Ctrl-C": (0, 0, 20),
    }
    rows, wanted = [], undisturbed(CELLS)
    for name, (drivers, workers, interrupts) in kinds.items():
        d = disturb(drivers, workers, interrupts, wanted)
        gone = "" if workers else f"{d.gone:.2f}"
        print(name, d, flush=True)
        rows.append((name, d.kills, d.starting, d.lost, d.again, d.wasted, d.different, gone))
    columns = (
        "disturbance",
        "times",
        "before the first cell",
        "stored cells lost",
        "stored cells repeated",
    )
    columns += (
        "unfinished cells repeated",
        "cells that differ",
        "last process ended after, s",
    )
    intro = [
        (
            f"A study of {CELLS} cells on two workers, disturbed at random (seeded) moments and"
            " restarted until it completed. *Cells that differ* compares with an undisturbed run."
        ),
        "`python benchmarks kills`.",
        "",
    ]
    return intro + table(columns, rows)


def main() -> None:
    """Disturb a study on a small scale, which must do no damage.

    On a busy machine the study may end before the last kill.
    """
    drivers, workers, interrupts, count = map(int, sys.argv[1:])
    damage = disturb(drivers, workers, interrupts, undisturbed(count))
    print(damage)
    if damage.lost or damage.again or damage.different or not damage.kills:
        raise SystemExit("the study was damaged, or not disturbed at all")


if __name__ == "__main__":
    main()
