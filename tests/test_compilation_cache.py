"""What JAX compiled is found again by the next process, and the folder stays small."""

import os
import subprocess
import sys
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


def test_the_oldest_entries_go(caches, monkeypatch):
    monkeypatch.setattr(compilation_cache, "MOST", 3)
    cache_folder().mkdir(parents=True)
    for n in range(5):
        file = cache_folder() / f"{n}-cache"
        file.touch()
        os.utime(file, (n, n))
    keep_compiled()
    assert {file.name for file in cache_folder().iterdir()} == {"2-cache", "3-cache", "4-cache"}


def test_without_a_home_everything_is_compiled_anew(caches, monkeypatch):
    def homeless() -> Path:
        raise RuntimeError("no home")

    monkeypatch.setattr(Path, "home", homeless)
    keep_compiled()
    assert "JAX_COMPILATION_CACHE_DIR" not in os.environ
