"""Temporary folders of runs, held by a lock; folders of killed runs are removed at the
next start.
"""

import fcntl
import os
import shutil
import stat
import tempfile
from contextlib import suppress
from pathlib import Path

PREFIX = "place-rings-rig-"
_NEW, _LOCK, _SIGNED = ".new-", "lock", b"a run of place-rings\n"


class RunFolder:
    """A new temporary folder, held until ``close`` or the end of this process, however it ends.

    The lock is the operating system's (flock): it ends with the process, so no process number must
    be trusted.
    """

    def __init__(self) -> None:
        sweep()
        new = Path(tempfile.mkdtemp(prefix=_NEW + PREFIX))
        self._lock = os.open(new / _LOCK, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        os.write(self._lock, _SIGNED)
        # locked before another process can look for it
        self.path = new.rename(new.with_name(new.name.removeprefix(_NEW)))

    def close(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self.path, ignore_errors=True)
        os.close(self._lock)


def sweep() -> list[Path]:
    """Remove this user's folders whose run has ended without removing them; return them."""
    removed = []
    for folder in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with suppress(OSError):
            about = folder.lstat()
            if stat.S_ISDIR(about.st_mode) and about.st_uid == os.getuid() and _dead(folder):
                shutil.rmtree(folder)
                removed.append(folder)
    return removed


def _dead(folder: Path) -> bool:
    """Whether no process holds a folder; a folder without our signed lock is not ours."""
    try:
        lock = os.open(folder / _LOCK, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
    except FileNotFoundError:
        return False
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    else:
        return os.read(lock, len(_SIGNED) + 1) == _SIGNED
    finally:
        os.close(lock)
