"""Strictness for all tests: shapes checked, 64 bit where numbers are compared, no silent rank
promotion. And one cache of what JAX compiles for a session, and the emitters of XLA that compile in
half the time: its workers, and the processes that tests start, find both by the environment."""

import gc
import mmap
import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import jax
import jaxlib
import jaxtyping
import numpy as np
import pytest
from beartype import BeartypeConf, FrozenDict, beartype
from beartype.roar import BeartypeDecorHintPep3119Exception
from hypothesis import Phase, settings
from jaxtyping import install_import_hook

from .support.rooms import imported_rooms, shaped_modules
from .support.shape_checks import check_once

os.environ.pop("PYTHONUNBUFFERED", None)  # processes of users write through a buffer
if "JAX_COMPILATION_CACHE_DIR" not in os.environ:
    # gone when this process ends
    _folder = TemporaryDirectory(prefix="place-rings-jax-", ignore_cleanup_errors=True)
    _cache: dict = {"jax_compilation_cache_dir": _folder.name}
    _cache |= {
        f"jax_persistent_cache_min_{least}": -1
        for least in ("compile_time_secs", "entry_size_bytes")
    }
    for _name, _value in _cache.items():
        jax.config.update(_name, _value)
        os.environ[_name.upper()] = str(_value)


def _known_to_xla(flag: bytes) -> bool:
    """Whether the installed XLA has a flag: it ends a process that sets an unknown one."""
    for library in Path(jaxlib.__file__).parent.glob("*jax_common*"):
        with (
            library.open("rb") as file,
            mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text,
        ):
            if text.find(flag) >= 0:
                return True
    return False


_EMITTERS = "xla_cpu_use_fusion_emitters"
if "XLA_FLAGS" not in os.environ and _known_to_xla(_EMITTERS.encode()):
    # at this level it compiles in two thirds of the time, and what is compiled runs as fast
    os.environ["XLA_FLAGS"] = f"--{_EMITTERS}=false --xla_backend_optimization_level=1"

# An int is a float where a float is asked for, as PEP 484 says, and a scalar of NumPy's is what
# Python's is.
_SCALARS = FrozenDict(
    {bool: bool | np.bool_, int: int | np.integer, float: float | int | np.number}
)
# Hypothesis refuses a strategy in which the state of the module `random` changes: no draws.
_check = beartype(conf=BeartypeConf(hint_overrides=_SCALARS, is_random=False))


def _checked(function: Callable) -> Callable:
    """The function with its shapes checked; as it is where it names a protocol that cannot be asked
    for.
    """
    try:
        return _check(function)
    except BeartypeDecorHintPep3119Exception:
        return function


_checker = ModuleType("place_rings_checker")  # the hook wants its checker by an importable name
_checker.check = _checked
sys.modules[_checker.__name__] = _checker
jaxtyping.jaxtyped = check_once  # what the hook decorates with
install_import_hook(shaped_modules(), f"{_checker.__name__}.check")

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
# The same code draws the same examples, so a checkout passes or fails the same way each time.
# Without Phase.explain: it traces every line while examples shrink, which takes minutes.
settings.register_profile(
    "laws",
    deadline=None,
    derandomize=True,
    print_blob=True,
    max_examples=10,
    phases=set(Phase) - {Phase.explain},
)
# --hypothesis-profile=thorough: other examples each time, and more of them
settings.register_profile(
    "thorough",
    settings.get_profile("laws"),
    derandomize=False,
    database=settings().database,
    max_examples=200,
)
settings.load_profile("laws")


_CORE = {"coverage", "objectives", "placement", "simulation", "formats"}


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out files above the core where only the core is asked for: what they import may be
    absent.
    """
    only_core = str(config.getoption("markexpr")).startswith("core")
    test = collection_path.name.startswith("test_") and collection_path.suffix == ".py"
    return True if only_core and test and imported_rooms(collection_path) - _CORE else None


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Seek no garbage while modules are imported, nor among what they hold later."""
    gc.disable()
    yield
    gc.freeze()
    gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item], config: pytest.Config) -> None:
    """Mark tests of the core, where they are asked for: those whose file imports nothing above
    formats/, and no command.
    """
    for item in items if "core" in str(config.getoption("markexpr")) else ():
        command = "run" in getattr(item, "fixturenames", ())
        if not command and not imported_rooms(item.path) - _CORE:
            item.add_marker("core")


def pytest_runtest_teardown() -> None:
    """Commands let a closed pipe end their process, which the tests after them must survive."""
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)


@pytest.fixture(scope="module", autouse=True)
def compiled() -> Iterator[None]:
    """Let go of what JAX compiled for a file's tests, which would fill gigabytes; what others need
    again comes from the cache."""
    yield
    jax.clear_caches()


@pytest.fixture
def reference_pose() -> np.ndarray:
    """Joint angles of the reference scene, rad."""
    return np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run the command line in an empty folder: (exit code, stdout, stderr)."""
    from place_rings.cli import app as command_line

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
