"""Keep what JAX compiled for the next run, in the user's cache folder.

Compiling the soft objective takes about as long as a small search. JAX names an entry by the
program, the shapes and its own version. The folder's name adds the features of the processor,
because a home folder may serve several machines. No result is kept.

JAX may reject an entry, some versions every one of a CPU (github.com/jax-ml/jax, issue 38445). It
compiles again then, but does not replace the entry. So all entries are deleted, which says nothing
that the user could act on.
"""

import os
import platform
import re
import sys
import warnings
import zlib
from contextlib import suppress
from pathlib import Path
from typing import Any

MOST = 500  # entries of about 0.1 MB each
_ENTRY = "-cache"  # the end of an entry's name
_LEAST_SECONDS = "0.1"  # compile time from which an entry is kept
_FAILED = re.compile(r"Error (reading|writing) persistent compilation cache entry")


def keep_compiled() -> None:
    """Set JAX's cache folder, unless the user has set one; JAX is not loaded yet.

    From then on, no warning shows that JAX cannot use an entry.
    """
    _renew_rejected()
    if "JAX_COMPILATION_CACHE_DIR" in os.environ:
        return
    with suppress(OSError, RuntimeError):  # no home or no rights: nothing is cached
        folder = cache_folder()
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK | os.X_OK):
            return  # JAX would warn for every program
        _drop_oldest(folder, MOST)
        os.environ["JAX_COMPILATION_CACHE_DIR"] = str(folder)
        os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", _LEAST_SECONDS)


def cache_folder() -> Path:
    """Return the folder for this processor, by the conventions of the operating system.

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
    """Return the folder that the environment states; None for a relative one, which the XDG Base
    Directory Specification ignores.
    """
    folder = Path(os.environ.get(variable, ""))
    return folder if folder.is_absolute() else None


def _home() -> Path:
    """Return the user's home; raise RuntimeError if the environment has an empty or relative
    one.
    """
    if sys.platform != "win32" and not Path(os.environ.get("HOME", "/")).is_absolute():
        raise RuntimeError("HOME is not an absolute path")
    return Path.home()


def _abilities() -> str:
    """Return the features of the processor in one line."""
    with suppress(OSError), Path("/proc/cpuinfo").open() as file:
        for line in file:
            if line.startswith(("flags", "Features")):
                return line
    return platform.processor()


def _renew_rejected() -> None:
    """Delete all entries in place of a warning that one cannot be read."""
    show = warnings.showwarning

    def shown(message: Warning | str, *about: Any, **more: Any) -> None:
        match _FAILED.match(str(message)):
            case None:
                show(message, *about, **more)
            case failed if failed[1] == "reading":
                with suppress(OSError, RuntimeError):
                    own = cache_folder()
                    if os.environ.get("JAX_COMPILATION_CACHE_DIR") == str(own):
                        _drop_oldest(own, 0)

    warnings.showwarning = shown


def _drop_oldest(folder: Path, most: int) -> None:
    """Delete the oldest of JAX's entries until ``most`` are left.

    Nothing else is deleted, and nothing through a symbolic link.
    """
    if folder.is_symlink() or folder.parent.is_symlink():
        return
    entries = []
    for entry in os.scandir(folder):
        if entry.name.endswith(_ENTRY) and entry.is_file(follow_symlinks=False):
            with suppress(FileNotFoundError):  # another process deleted it
                entries.append((entry.stat(follow_symlinks=False).st_mtime, entry.path))
    for _, path in sorted(entries)[: max(len(entries) - most, 0)]:
        for name in (path, path.removesuffix(_ENTRY) + "-atime"):  # "-atime": when it was read
            Path(name).unlink(missing_ok=True)
