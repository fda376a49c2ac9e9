"""What JAX compiled is found again by the next process, and the folder stays small."""

import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from place_rings.cli import compilation_cache
from place_rings.cli.compilation_cache import cache_folder, keep_compiled

_COMPILE = """
from place_rings.cli.compilation_cache import keep_compiled
keep_compiled()
import jax
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
print(jax.jit(lambda x: x * x + 1)(3.0))
"""


@pytest.fixture
def caches(monkeypatch, tmp_path) -> Path:
    """An empty folder for caches, with nothing said of JAX's."""
    for name in [name for name in os.environ if name.startswith(("JAX_COMPIL", "JAX_PERSIST"))]:
        monkeypatch.delenv(name)
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA", "HOME"):
        monkeypatch.setenv(name, str(tmp_path))
    monkeypatch.setattr(os, "environ", os.environ.copy())
    return tmp_path


@pytest.mark.slow
def test_a_second_process_adds_no_entry(caches):
    def entries() -> set[str]:
        out = subprocess.run(
            [sys.executable, "-c", _COMPILE], check=True, capture_output=True, text=True
        ).stdout
        assert out.strip() == "10.0"
        return {file.name for file in cache_folder().glob("*-cache")}

    first = entries()
    assert first
    assert entries() == first
    assert caches in cache_folder().parents


def test_the_users_own_folder_stays(caches):
    os.environ["JAX_COMPILATION_CACHE_DIR"] = "mine"
    keep_compiled()
    assert os.environ["JAX_COMPILATION_CACHE_DIR"] == "mine"


def test_the_oldest_entries_of_jax_go(caches, monkeypatch):
    monkeypatch.setattr(compilation_cache, "MOST", 1)
    cache_folder().mkdir(parents=True)
    elsewhere = caches / "thesis-cache"
    elsewhere.touch()
    for n, name in enumerate(("0-cache", "0-atime", "notes.txt", "1-cache", "1-atime")):
        (cache_folder() / name).touch()
        os.utime(cache_folder() / name, (n, n))
    (cache_folder() / "2-cache").symlink_to(elsewhere)
    keep_compiled()
    left = {file.name for file in cache_folder().iterdir()}
    assert left == {"notes.txt", "1-cache", "1-atime", "2-cache"}
    assert elsewhere.exists()


def test_nothing_goes_through_a_link(caches, monkeypatch):
    monkeypatch.setattr(compilation_cache, "MOST", 0)
    mine = caches / "mine"
    mine.mkdir()
    (mine / "a-cache").touch()
    cache_folder().parent.mkdir(parents=True)
    cache_folder().symlink_to(mine)
    keep_compiled()
    assert (mine / "a-cache").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="HOME is not the home there")
@pytest.mark.parametrize("home", ["", "relative", "/proc/nope", None])
def test_a_home_that_is_none_leaves_nothing_behind(caches, monkeypatch, home):
    def homeless() -> Path:
        raise RuntimeError("no home")

    monkeypatch.chdir(caches)
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
        os.environ.pop(name)
    if home is None:
        monkeypatch.setattr(Path, "home", homeless)
    else:
        os.environ["HOME"] = home
    keep_compiled()
    assert "JAX_COMPILATION_CACHE_DIR" not in os.environ
    assert list(caches.iterdir()) == []


@pytest.mark.skipif(sys.platform != "linux", reason="the variable of the XDG specification")
def test_a_folder_that_is_relative_or_cannot_be_written_is_ignored(caches, monkeypatch):
    monkeypatch.chdir(caches)
    os.environ["XDG_CACHE_HOME"] = "relative"
    assert caches / ".cache" in cache_folder().parents
    monkeypatch.setattr(os, "access", lambda *_: False)
    keep_compiled()
    assert "JAX_COMPILATION_CACHE_DIR" not in os.environ


def test_rejected_entries_go_without_a_word(caches):
    """github.com/jax-ml/jax, issue 38445: some versions reject every entry of a CPU."""
    shown = []
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.showwarning = lambda message, *_, **__: shown.append(str(message))
        keep_compiled()
        (cache_folder() / "jit_f-1-cache").write_bytes(b"of another version")
        text = "{} persistent compilation cache entry for 'jit_f': cpu_aot_loader: feature"
        warnings.warn(text.format("Error writing"), stacklevel=1)
        assert list(cache_folder().iterdir())
        warnings.warn(text.format("Error reading"), stacklevel=1)
        assert list(cache_folder().iterdir()) == []
        os.environ["JAX_COMPILATION_CACHE_DIR"] = str(caches)
        (caches / "mine-cache").touch()
        warnings.warn(text.format("Error reading"), stacklevel=1)
        assert (caches / "mine-cache").exists()
        warnings.warn("another", stacklevel=1)
    assert shown == ["another"]


@pytest.mark.slow
def test_an_entry_that_cannot_be_read_is_made_anew(caches):
    def run() -> str:
        done = subprocess.run(
            [sys.executable, "-c", _COMPILE], check=True, capture_output=True, text=True
        )
        return done.stdout + done.stderr

    run()
    for entry in cache_folder().glob("*-cache"):
        entry.write_bytes(b"damaged")
    assert run().strip() == "10.0"
    entries = [entry.read_bytes() for entry in cache_folder().glob("*-cache")]
    assert entries
    assert b"damaged" not in entries
