"""A full disk and a read-only folder: each command that writes is refused in one line, and the
files of an earlier run stay whole."""

import json
import os
import shlex
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from PIL import Image
from place_rings.cli.app import app
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.rings.ring import named_setup
from place_rings.objectives.scene import Scene
from place_rings.reporting.export_formats import FORMATS
from place_rings.viewer.page_tasks import save

from ..support.coarse_study import make_coarse

READ = """--scene --calibration --packages --detection-rates --trajectory --score --replay --joints
--readings --steps --plan --stop-times --facts --layout"""
# by option and command: words of commands that write, of which the option's path is the last
WRITING = {
    ("--out", "benchmark"): ["shell_48"],
    ("--out", "check"): ["n1_4_0 --plan-only --part coverage --trials 2 --voxel 0.1"],
    ("--out", "export"): [f"n1_4_0 --scene cell.toml --to {kind}" for kind in FORMATS],
    ("--out", "improve"): ["n1_4_0 --changes 1 --time 1 --voxel 0.1"],
    ("--out", "place"): ["--paper --rings 1 --sensors 4 --time 0.3 --voxel 0.1"],
    ("--out", "report"): ["n1_4_0 --voxel 0.1 --draws 2"],
    ("--out", "robot"): ["ur5e"],
    ("--out", "safety"): ["n1_4_0 --sensor vl53l1x --approaches 4 --paper --dossier"],
    ("--out", "schedule"): ["n1_4_0 --sensor vl53l1x"],
    ("--out", "study"): ["convergence"],
    ("--out", "view"): [],  # writes when its page saves
    ("--certificate", "verify"): ["n1_4_0 --target V_S:0.5 --rule certified --width 5"],
    ("--plot-by-pose", "verify"): ["n1_4_0 --trajectory motion.csv --voxel 0.1"],
}
FILES = {"--certificate": "proof.npz", "--plot-by-pose": "zeta.png"}
EACH = [
    (f"{command.replace('place', '')} {words} {option}".strip(), FILES.get(option, "out"))
    for (option, command), lines in WRITING.items()
    for words in lines
]
CELL = '[sensor]\nmodel = "vl53l1x"\n'
MOTION = "time_s,q0,q1,q2,q3,q4,q5\n0,0,-0.8,1,-1.8,-1.6,0\n1,0.3,-0.8,1,-1.8,-1.6,0\n"


def test_every_option_that_names_a_file_is_known():
    """A new one is read, or belongs to the commands that are tried here."""
    written = set()
    for name in [name for name in app if not name.startswith("-")] + [""]:
        for argument in (app[name] if name else app).assemble_argument_collection():
            if "Path" in str(argument.hint) and argument.name not in READ.split():
                written.add((argument.name, name or "place"))
    assert written == set(WRITING)


class Disk:
    """A small file system."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.filler = folder, folder / ".filler"

    def fill(self, left: int = 0) -> None:
        """Leave ``left`` bytes."""
        self.filler.unlink(missing_ok=True)
        there = os.statvfs(self.folder)
        with self.filler.open("wb") as file:
            os.posix_fallocate(file.fileno(), 0, max(there.f_bavail * there.f_frsize - left, 1))

    def files(self) -> dict[str, bytes]:
        """Contents of all files by name."""
        every = [p for p in self.folder.rglob("*") if p.is_file() and p != self.filler]
        return {str(p.relative_to(self.folder)): p.read_bytes() for p in every}


@pytest.fixture
def disk(tmp_path) -> Iterator[Disk]:
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=32m", "tmpfs", str(folder)]
    try:
        subprocess.run(mount, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("mounting a small file system is not allowed here")
    yield Disk(folder)
    subprocess.run(["umount", "-l", str(folder)], check=True)


def refused(folder: Path, code: int, _: str, err: str) -> None:
    """The run ended by one line that names a place in a folder."""
    lines = [line for line in err.splitlines() if line.startswith("place-rings: ")]
    assert code == 2, err
    assert err.splitlines()[-1:] == lines
    assert str(folder) in lines[0]


def whole(name: str, data: bytes, folder: Path) -> bool:
    """Whether a file can be read to its end."""
    match Path(name).suffix:
        case ".json":
            return json.loads(data) is not None
        case ".toml":
            return bool(tomllib.loads(data.decode()))
        case ".png":
            Image.open(folder / name).load()
            return True
        case ".html":
            return data.rstrip().endswith(b"</html>")
        case _:
            return bool(data)


@pytest.mark.slow
@pytest.mark.parametrize(("line", "name"), EACH, ids=[line for line, _ in EACH])
def test_a_command_that_cannot_write_keeps_what_was_there(run, disk, monkeypatch, line, name):
    make_coarse(monkeypatch)
    Path("cell.toml").write_text(CELL)
    Path("motion.csv").write_text(MOTION)
    out = disk.folder / name
    words = [*shlex.split(line), out]
    assert run(*words)[0] == 0
    before = disk.files()
    assert before
    disk.fill()
    refused(disk.folder, *run(*words))
    assert disk.files() == before

    disk.fill(left=sum(map(len, before.values())) // 2)
    code, _, err = run(*words)
    if code:  # a few files may fit
        refused(disk.folder, code, _, err)
    after = disk.files()
    assert set(after) <= set(before)
    assert all(whole(name, data, disk.folder) for name, data in after.items())

    subprocess.run(["mount", "-o", "remount,ro", str(disk.folder)], check=True)
    refused(disk.folder, *run(*words))
    assert disk.files() == after


@pytest.mark.slow
def test_the_viewers_page_that_cannot_save_keeps_what_was_there(run, disk):
    file, setup = disk.folder / "mine.toml", named_setup("n1_4_0")
    save(file, setup, Scene(), [])
    before = disk.files()
    disk.fill()
    with pytest.raises(UserError, match=str(file)):
        save(file, named_setup("n2_16_25"), Scene(), [])
    assert disk.files() == before
    subprocess.run(["mount", "-o", "remount,ro", str(disk.folder)], check=True)
    refused(disk.folder, *run("view", "n1_4_0", "--no-browser", "--out", disk.folder))
