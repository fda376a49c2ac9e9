"""Strictness for all tests: shapes checked, 64 bit where numbers are compared, no silent rank promotion. And one cache of
what JAX compiles for a session: its workers, and the processes that tests start, find it by the environment."""

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import jax
import numpy as np
import pytest
from beartype import BeartypeConf, beartype
from hypothesis import settings
from jaxtyping import install_import_hook

if "JAX_COMPILATION_CACHE_DIR" not in os.environ:
    _folder = TemporaryDirectory(prefix="place-rings-jax-", ignore_cleanup_errors=True)  # gone when this process ends
    _cache: dict = {"jax_compilation_cache_dir": _folder.name}
    _cache |= {f"jax_persistent_cache_min_{least}": -1 for least in ("compile_time_secs", "entry_size_bytes")}
    for _name, _value in _cache.items():
        jax.config.update(_name, _value)
        os.environ[_name.upper()] = str(_value)

# An int is a float where a float is asked for, as PEP 484 says. The hook wants its checker by an importable name.
_checker = ModuleType("place_rings_checker")
_checker.check = beartype(conf=BeartypeConf(is_pep484_tower=True))
sys.modules[_checker.__name__] = _checker
_STUDIES = (
    f"place_rings.studies.{name}" for name in ("human", "walk", "objects", "distance", "approach", "moments", "detection")
)
_PLACEMENT = (f"place_rings.placement.{name}" for name in ("search", "finalists", "subset", "files.record"))
_RIG = (
    f"place_rings.rig.{name}"
    for name in (
        *("mount", "sensing", "self_check", "simulated_cell.world"),
        *("listening.gathering", "poses.clear", "recording.clocks", "rings.protocol", "robot.state", "robot.vetting"),
        *("rod.check", "rod.plan", "rod.rod"),
    )
)
_SHAPED = (  # the others name no shapes to check
    f"place_rings.{room}.{file.stem}"
    for room in ("coverage", "objectives")
    for file in (Path(__file__).parent.parent / room).glob("*.py")
    if "from jaxtyping import" in file.read_text()
)
install_import_hook([*_SHAPED, *_PLACEMENT, *_STUDIES, *_RIG], f"{_checker.__name__}.check")

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
settings.register_profile("laws", deadline=None, print_blob=True, max_examples=15)
settings.register_profile("thorough", settings.get_profile("laws"), max_examples=200)  # --hypothesis-profile=thorough
settings.load_profile("laws")


@pytest.fixture
def reference_pose() -> np.ndarray:
    """Joint angles of the reference scene, rad."""
    return np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run the command line in an empty folder: (exit code, stdout, stderr)."""
    from place_rings.cli import main as command_line

    monkeypatch.chdir(tmp_path)

    def call(*args):
        monkeypatch.setattr(sys, "argv", ["place-rings", *map(str, args)])
        monkeypatch.setattr("signal.signal", lambda *_: None)
        code = 0
        try:
            command_line.main()
        except SystemExit as stop:
            code = stop.code or 0
        return code, *capsys.readouterr()

    return call
