"""Runs that are killed at any moment: a search leaves the files of one run, and a study every
measurement that it reported.

``PLACE_RINGS_KILLS=100 pytest -m slow tests/cli/test_killed_runs.py`` kills more of them.
"""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from zlib import crc32

import numpy as np
import pytest
from place_rings.studies.engine.store import Cell, Store

pytest.importorskip("resource")  # and signals of POSIX
KILLS = int(os.environ.get("PLACE_RINGS_KILLS", "4"))
# each reports a number and what there is then
SEARCHING = """
import json, sys
from contextlib import suppress
from pathlib import Path
from zlib import crc32
from place_rings.cli.app import main
out = Path(sys.argv[1])
words = "--paper --rings 1 --sensors 4 --time 0.3 --voxel 0.1 --out".split()
for seed in range(int(sys.argv[2]), 1_000_000):
    sys.argv = ["place-rings", *words, str(out), "--seed", str(seed)]
    with suppress(SystemExit):
        main()
    there = {p.name: crc32(p.read_bytes()) for p in out.iterdir()}
    print("\\n####", json.dumps([seed, there]), flush=True)
"""
STORING = """
import json, sys
from pathlib import Path
from place_rings.studies.engine.store import Cell, Store
with Store(Path(sys.argv[1]), "test") as store:
    for i in range(int(sys.argv[2]), 1_000_000):
        store.put(Cell("work", {"n": i}), {"v": [i] * 200}, 0.1)
        print("####", json.dumps([i, None]), flush=True)
"""


def killed(code: str, path: Path, first: int, share: float) -> list[tuple[int, dict[str, int]]]:
    """Return what a process reported that was killed after its first report, and a share of the
    time until then."""
    command = [sys.executable, "-c", code, str(path), str(first)]
    started = time.monotonic()
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout is not None
        begun = next((line for line in run.stdout if line.startswith("####")), None)
        assert begun is not None
        time.sleep(share * (time.monotonic() - started))
        run.send_signal(signal.SIGKILL)
        lines = [begun, *run.stdout]
    assert run.returncode == -signal.SIGKILL
    return [json.loads(line[4:]) for line in lines if line.startswith("####") and line[-1] == "\n"]


@pytest.mark.slow
def test_a_killed_search_leaves_the_files_of_one_run(tmp_path):
    rng, first, out = np.random.default_rng(1), 0, tmp_path / "out"
    for _ in range(KILLS):
        reports = killed(SEARCHING, out, first, rng.uniform())
        names = {"proposal.toml", "placement.png", "result.json"}
        assert all(set(there) == names for _, there in reports)  # no rest of a killed run
        first, before = reports[-1]
        there = {p.name: crc32(p.read_bytes()) for p in out.iterdir() if p.name in names}
        kept = [there[name] == before[name] for name in there]
        assert all(kept) or not any(kept)
        first += 1


@pytest.mark.slow
def test_a_killed_study_has_stored_what_it_reported(tmp_path):
    rng, first, file = np.random.default_rng(2), 0, tmp_path / "cells.sqlite"
    for _ in range(5 * KILLS):
        numbers = [i for i, _ in killed(STORING, file, first, rng.uniform(0, 0.3))]
        first = numbers[-1] + 1
    assert first >= 5 * KILLS
    with Store(file, "test") as store:
        for i in range(first):
            assert store.get(Cell("work", {"n": i})) == {"v": [i] * 200}
