"""What JAX compiled is kept for the next run, in the user's folder for caches.

The soft objective compiles for about as long as a small search runs. JAX names an entry by the
program, the shapes and its own version; the folder's name adds the processor's abilities, as a home
may serve several machines. No result is kept.
"""

import os
import platform
import sys
import zlib
from contextlib import suppress
from pathlib import Path

MOST = 500  # entries, of about 0.1 MB
_LEAST_SECONDS = "0.1"  # of compiling: what is quicker is not worth a file


def keep_compiled() -> None:
    """Tell JAX, which is not loaded yet, where to keep what it compiles, unless the user did so."""
    if "JAX_COMPILATION_CACHE_DIR" in os.environ:
        return
    with suppress(OSError, RuntimeError):  # no home, no rights: everything is compiled anew
        folder = cache_folder()
        _drop_oldest(folder)
        os.environ["JAX_COMPILATION_CACHE_DIR"] = str(folder)
        os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", _LEAST_SECONDS)


def cache_folder() -> Path:
    """The folder for this processor, by the conventions of the operating system."""
    home = Path.home()
    match sys.platform:
        case "win32":
            caches = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
        case "darwin":
            caches = home / "Library" / "Caches"
        case _:
            caches = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    abilities = f"{platform.machine()} {_abilities()}".encode()
    return caches / "place-rings" / f"jax-{zlib.crc32(abilities):08x}"


def _abilities() -> str:
    """What the processor can do, in a line."""
    with suppress(OSError), Path("/proc/cpuinfo").open() as file:
        for line in file:
            if line.startswith(("flags", "Features")):
                return line
    return platform.processor()


def _drop_oldest(folder: Path) -> None:
    """Let ``folder`` hold ``MOST`` entries at most, those that were written last."""
    if folder.is_dir():
        files = [entry for entry in os.scandir(folder) if entry.is_file()]
        if len(files) > MOST:
            for entry in sorted(files, key=lambda entry: entry.stat().st_mtime)[:-MOST]:
                Path(entry.path).unlink(missing_ok=True)
