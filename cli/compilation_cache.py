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
_ENTRY = "-cache"  # the end of an entry's name
_LEAST_SECONDS = "0.1"  # of compiling: what is quicker is not worth a file


def keep_compiled() -> None:
    """Tell JAX, which is not loaded yet, where to keep what it compiles, unless the user did so."""
    if "JAX_COMPILATION_CACHE_DIR" in os.environ:
        return
    with suppress(OSError, RuntimeError):  # no home, no rights: everything is compiled anew
        folder = cache_folder()
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK | os.X_OK):
            return  # JAX would warn at every program
        _drop_oldest(folder)
        os.environ["JAX_COMPILATION_CACHE_DIR"] = str(folder)
        os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", _LEAST_SECONDS)


def cache_folder() -> Path:
    """The folder for this processor, by the conventions of the operating system.

    Raises:
        RuntimeError: if the user has no home.
    """
    match sys.platform:
        case "win32":
            caches = _stated("LOCALAPPDATA") or _home() / "AppData" / "Local"
        case "darwin":
            caches = _home() / "Library" / "Caches"
        case _:
            caches = _stated("XDG_CACHE_HOME") or _home() / ".cache"
    abilities = f"{platform.machine()} {_abilities()}".encode()
    return caches / "place-rings" / f"jax-{zlib.crc32(abilities):08x}"


def _stated(variable: str) -> Path | None:
    """The folder that the environment names; None for a relative one, which the XDG Base Directory
    Specification wants ignored.
    """
    folder = Path(os.environ.get(variable, ""))
    return folder if folder.is_absolute() else None


def _home() -> Path:
    """The user's home; RuntimeError where the environment has an empty or a relative one."""
    if sys.platform != "win32" and not Path(os.environ.get("HOME", "/")).is_absolute():
        raise RuntimeError("HOME is no absolute path")
    return Path.home()


def _abilities() -> str:
    """What the processor can do, in a line."""
    with suppress(OSError), Path("/proc/cpuinfo").open() as file:
        for line in file:
            if line.startswith(("flags", "Features")):
                return line
    return platform.processor()


def _drop_oldest(folder: Path) -> None:
    """Let ``folder`` hold ``MOST`` of JAX's entries at most, those that were written last. Nothing
    else is deleted, and nothing through a symbolic link.
    """
    if folder.is_symlink() or folder.parent.is_symlink():
        return
    entries = []
    for entry in os.scandir(folder):
        if entry.name.endswith(_ENTRY) and entry.is_file(follow_symlinks=False):
            with suppress(FileNotFoundError):  # another process drops it too
                entries.append((entry.stat(follow_symlinks=False).st_mtime, entry.path))
    for _, path in sorted(entries)[: max(len(entries) - MOST, 0)]:
        for name in (path, path.removesuffix(_ENTRY) + "-atime"):  # beside it: when it was read
            Path(name).unlink(missing_ok=True)
