"""Files of one run: never beside those of another, whatever ends the run."""

import errno
import os
import signal
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings import InputError, export
from place_rings.coverage.definitions.errors import UserError
from place_rings.formats import writing
from place_rings.formats.writing import made_folder, output_files, write_text

pytest.importorskip("resource")  # and forks and signals of POSIX

NAMES = ("proposal.toml", "result.json", "picture.png")
files = st.lists(st.sampled_from([*NAMES, "table.csv", "sub/mesh.stl"]), unique=True, min_size=1)


def write(folder: Path, run: str, names=NAMES, keep: bool = True) -> None:
    with output_files(folder, *NAMES, keep=keep) as new:
        for name in names:
            (new / name).parent.mkdir(exist_ok=True)
            write_text(new / name, run)


def content(folder: Path) -> dict[str, str]:
    """Contents of the visible files by name."""
    return {
        str(p.relative_to(folder)): p.read_text()
        for p in folder.rglob("*")
        if p.is_file() and not any(part.startswith(".") for part in p.relative_to(folder).parts)
    }


@given(first=files, second=files)
def test_a_second_run_leaves_only_its_own_files_and_those_that_no_run_of_its_kind_writes(
    tmp_path_factory, first, second
):
    folder = tmp_path_factory.mktemp("out")
    (folder / "notes.txt").write_text("mine")
    write(folder, "old", first)
    write(folder, "new", second)
    kept = {name: "old" for name in first if name not in (*second, *NAMES)}
    assert content(folder) == {"notes.txt": "mine", **kept, **dict.fromkeys(second, "new")}
    assert not [p for p in folder.iterdir() if p.name.startswith(".")]


class Full:
    """A disk that is full from the n-th write on; ``os.fsync`` is where a write ends."""

    def __init__(self, n: int, error: int = errno.ENOSPC) -> None:
        self.n, self.error, self.fsync = n, error, os.fsync

    def __call__(self, handle) -> None:
        self.n -= stat.S_ISREG(os.fstat(handle).st_mode)
        if self.n <= 0:
            raise OSError(self.error, os.strerror(self.error))
        self.fsync(handle)


@pytest.mark.parametrize("keep", [True, False])
@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO])
@pytest.mark.parametrize("n", [1, 2, 3])
def test_a_full_disk_keeps_what_was_written_first(tmp_path, monkeypatch, n, error, keep):
    write(tmp_path, "old")
    with monkeypatch.context() as patched:
        patched.setattr(writing.os, "fsync", Full(n, error))
        with pytest.raises(UserError) as refused:
            write(tmp_path, "new", keep=keep)
    assert str(refused.value).startswith(str(tmp_path / NAMES[n - 1]))
    if n == 1 or not keep:
        assert content(tmp_path) == dict.fromkeys(NAMES, "old")
    else:
        assert content(tmp_path) == dict.fromkeys(NAMES[: n - 1], "new")
    assert len(content(tmp_path)) == len(list(tmp_path.iterdir()))


def limited(folder: Path, size: int) -> subprocess.CompletedProcess[str]:
    """Place rings where no file may become larger than ``size`` bytes."""
    begin = (  # JAX forbids a fork in this process
        f"import resource, runpy; resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}));"
        "runpy.run_module('place_rings.cli.entry', run_name='__main__', alter_sys=True)"
    )
    return subprocess.run(
        [sys.executable, "-c", begin, *PLACE, "--out", str(folder)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PLACE_RINGS_CACHE": "", "JAX_ENABLE_COMPILATION_CACHE": "false"},
    )


PLACE = ("--rings", "1", "--sensors", "4", "--time", "1", "--voxel", "0.1")


@pytest.mark.slow
def test_the_proposal_survives_where_the_picture_does_not_fit(tmp_path):
    done = limited(tmp_path, 100_000)  # above the texts, below the picture
    assert done.returncode == 2, done.stderr
    assert "placement.png" in done.stderr
    assert (tmp_path / "proposal.toml").is_file()
    assert not (tmp_path / "placement.png").exists()


PRELUDE = f"""
import contextlib, os, signal, sys, time
from pathlib import Path
from place_rings.formats.writing import made_folder, output_files, write_text
NAMES, OUT = {NAMES!r}, Path(sys.argv[1])
def write(folder, run):
    with output_files(folder, *NAMES, keep=True) as new:
        for name in NAMES:
            write_text(new / name, run)
"""
ENDING = """
replace, left = Path.replace, [0]
def ending(self, target):
    left[0] -= 1
    if left[0] == 0:
        os._exit(9)
    return replace(self, target)
Path.replace = ending
for n in range(1, 20):
    write(OUT / str(n), "old")
    if os.fork() == 0:
        left[0] = n
        write(OUT / str(n), "new")
        os._exit(0)
    os.wait()
"""


def script(text: str, folder: Path) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run([sys.executable, "-c", PRELUDE + text, str(folder)], check=True)


def test_a_run_that_ends_at_any_move_leaves_no_mixture(tmp_path):
    """A process ends at once in its n-th rename, as if killed."""
    script(ENDING, tmp_path)
    ends = []
    for folder in sorted(tmp_path.iterdir(), key=lambda p: int(p.name)):
        found = content(folder)
        assert len(set(found.values())) == 1
        assert "proposal.toml" in found
        ends.append(found["proposal.toml"])
        write(folder, "next")
        assert content(folder) == dict.fromkeys(NAMES, "next")
        assert len(list(folder.iterdir())) == len(NAMES)  # and what was left is gone
    assert ends == sorted(ends, reverse=True)  # old, and from some rename on new
    assert set(ends) == {"old", "new"}


AGAIN = """
print("ready", flush=True)
for i in range(10_000):
    write(OUT, str(i))
"""


@pytest.mark.slow
@settings(max_examples=15)
@given(after=st.floats(0, 0.08))
def test_a_killed_process_leaves_the_files_of_one_run(tmp_path_factory, after):
    folder = tmp_path_factory.mktemp("out")
    command = [sys.executable, "-c", PRELUDE + AGAIN, str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as run:
        assert run.stdout is not None
        assert run.stdout.readline()
        time.sleep(after)
        run.send_signal(signal.SIGKILL)
    assert len(set(content(folder).values())) <= 1
    write(folder, "next")
    assert content(folder) == dict.fromkeys(NAMES, "next")


def test_ctrl_c_between_two_moves_completes_them(tmp_path, monkeypatch):
    write(tmp_path, "old")
    replace, calls = Path.replace, []

    def interrupted(self, target):
        found = replace(self, target)
        if not self.name.startswith(".place-rings-") or self.name.startswith(writing._UNFINISHED):
            calls.append(self)
            if len(calls) == 2:
                raise KeyboardInterrupt
        return found

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path, "new")
    assert content(tmp_path) == dict.fromkeys(NAMES, "new")


@pytest.mark.parametrize("name", [*NAMES, "sub/mesh.stl"])
@pytest.mark.parametrize("there", [True, False])
def test_a_link_in_the_place_of_a_file_is_refused(tmp_path, name, there):
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    out.mkdir()
    elsewhere.mkdir()
    target = elsewhere / Path(name).name
    if there:
        target.write_text("not mine")
    link = out / Path(name).parts[0]
    link.symlink_to(elsewhere if "/" in name else target)
    with pytest.raises(UserError, match=r"^" + str(link)):
        write(out, "new", [*NAMES, "sub/mesh.stl"])
    assert content(elsewhere) == ({target.name: "not mine"} if there else {})
    assert link.is_symlink()


def test_a_folder_in_the_place_of_a_file_is_refused_before_the_work(tmp_path):
    (tmp_path / "picture.png").mkdir()
    with pytest.raises(UserError, match=r"picture\.png"), output_files(tmp_path, *NAMES):
        pytest.fail("the work has begun")
    assert len(list(tmp_path.iterdir())) == 1


def test_one_run_at_a_time(tmp_path):
    with made_folder(tmp_path / "new") as out:
        with output_files(out, *NAMES) as new:  # the same run
            write_text(new / NAMES[0], "mine")
        refused = []

        def other() -> None:
            with pytest.raises(UserError) as error, output_files(out, *NAMES):
                pytest.fail("two runs write")
            refused.append(str(error.value))

        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
        assert str(out) in refused[0]
        assert out.is_dir()
    write(out, "next")
    assert content(out) == dict.fromkeys(NAMES, "next")


@pytest.mark.slow
def test_a_second_command_into_a_folder_in_use_is_refused(tmp_path):
    command = [sys.executable, "-m", "place_rings.cli.entry", *PLACE, "--out", str(tmp_path)]
    with made_folder(tmp_path):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert str(tmp_path) in done.stderr
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


CHILD = """
with made_folder(OUT):
    child = os.fork()
    if child == 0:
        time.sleep(60)
        os._exit(0)
try:
    write(OUT, "next")
finally:
    os.kill(child, signal.SIGKILL)
"""


def test_a_lock_ends_with_its_run_and_not_with_a_forked_child(tmp_path):
    script(CHILD, tmp_path)
    assert content(tmp_path) == dict.fromkeys(NAMES, "next")


def test_an_error_removes_new_folders_only(tmp_path):
    for out in (tmp_path / "a" / "b", tmp_path):
        with pytest.raises(ValueError, match="no"), output_files(out, *NAMES):
            raise ValueError("no")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664])
def test_a_rewritten_file_keeps_its_mode(tmp_path, mode):
    write(tmp_path, "old")
    (tmp_path / NAMES[1]).chmod(mode)
    write(tmp_path, "new")
    assert (tmp_path / NAMES[1]).stat().st_mode & 0o777 == mode


def test_an_export_does_not_follow_links_out_of_its_folder(tmp_path):
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    elsewhere.mkdir()
    written = export("n1_8_0", to="firmware", folder=out)
    inner = next(p for p in written if p.parent != out)
    for p in sorted(out.rglob("*"), reverse=True):
        p.rmdir() if p.is_dir() else p.unlink()
    (out / inner.relative_to(out).parts[0]).symlink_to(elsewhere)
    with pytest.raises(InputError):
        export("n1_8_0", to="firmware", folder=out)
    assert list(elsewhere.iterdir()) == []
    assert len(list(out.iterdir())) == 1


def test_a_folder_that_may_be_written_but_not_read_is_used(tmp_path, monkeypatch):
    """As a drop box of mode 300; faked, because the superuser can read any."""
    real = os.open

    def opened(path, flags, *more, **others):
        if os.fspath(path) == os.fspath(tmp_path) and not flags & os.O_ACCMODE:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        return real(path, flags, *more, **others)

    with monkeypatch.context() as patched:
        patched.setattr(writing.os, "open", opened)
        write(tmp_path, "new")
    assert content(tmp_path) == dict.fromkeys(NAMES, "new")
