"""Temporary folders of runs: gone with the run, and with the next one where a run was killed."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from place_rings.rig.simulated.run_folder import PREFIX, RunFolder, sweep

HOLD = """
import sys
from place_rings.rig.simulated.run_folder import RunFolder
folder = RunFolder()
print(folder.path, flush=True)
sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    return tmp_path


def held():
    """A process that holds a folder, and the folder."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    return process, Path(process.stdout.readline().strip())


def end(process):
    process.kill()
    process.communicate()


def test_a_folder_goes_with_its_run(place):
    folder = RunFolder()
    (folder.path / "ring0").touch()
    assert sweep() == []
    assert [p.name.startswith(PREFIX) for p in place.iterdir()] == [True]
    folder.close()
    assert list(place.iterdir()) == []


def test_folders_of_killed_runs_are_swept_and_those_of_living_ones_are_not(place):
    (alive, one), (dead, other) = held(), held()
    (other / "inside").mkdir()
    end(dead)
    folder = RunFolder()  # the next start
    assert one.exists()
    assert not other.exists()
    end(alive)
    assert sweep() == [one]
    folder.close()


def test_what_is_not_ours_stays(place):
    (place / f"{PREFIX}without-lock").mkdir()
    elsewhere = place / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "lock").touch()
    (place / f"{PREFIX}link").symlink_to(elsewhere)
    trap = place / f"{PREFIX}trap"
    trap.mkdir()
    (trap / "lock").symlink_to(elsewhere / "lock")
    (place / f"{PREFIX}file").touch()
    mine = place / f"{PREFIX}my-results"
    mine.mkdir()
    (mine / "lock").write_text("my own")
    before = sorted(place.rglob("*"))
    assert sweep() == []
    assert sorted(place.rglob("*")) == before
    assert os.path.exists(elsewhere / "lock")
