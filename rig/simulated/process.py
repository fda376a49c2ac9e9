"""Start a simulated rig in a process of its own, with a temporary folder, and send it commands.

Folders are held by a lock; those of killed runs are removed at the next start.
"""

import fcntl
import json
import os
import secrets
import select
import shutil
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..closing import Closing

_START = 120.0  # s to start Python and compile, on a busy machine
_ANSWER = 20.0  # s
PREFIX = "place-rings-rig-"
_NEW, _LOCK, _SIGNED = ".new-", "lock", b"a run of place-rings\n"


class SimulationError(Exception):
    """The simulated rig did not follow a command."""


def command(
    rings: int = 5,
    sensors: int = 16,
    rate: float = 15.0,
    seed: int = 0,
    encoding: str = "place-rings",
) -> list[str]:
    """Return the command, before and after folder and address, of a simulated rig in the simplest
    environment.
    """
    return [str(rings), str(sensors), str(rate), str(seed), encoding]


class SimulatedRig(Closing):
    """Process of a simulated rig, which ends with this object or with the process that holds it.

    Args:
        words: of the command that serves it, before and after folder and address.
    """

    def __init__(self, words: tuple[Sequence[str], Sequence[str]] | None = None) -> None:
        before, after = words or (("-m", __package__), command())
        a, b, c = secrets.randbelow(254) + 1, secrets.randbelow(256), secrets.randbelow(254) + 1
        # random: parallel rigs cannot share the robot's fixed ports
        self.address = f"127.{a}.{b}.{c}"
        self._folder = RunFolder()
        self.folder = self._folder.path
        self._errors = (self.folder / "errors").open("w+")
        self._process = subprocess.Popen(
            [sys.executable, *before, str(self.folder), self.address, *after],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            bufsize=0,
        )
        self._left = b""
        try:
            self._answer(_START)
        except SimulationError:
            self.close()
            raise

    def ring(self, number: int) -> str:
        """Return the port of a ring."""
        return str(self.folder / f"ring{number}")

    def do(self, do: str, **more: Any) -> dict[str, Any]:
        """Send a command; return its answer, with the ``time`` in s of the host's monotonic clock
        at which it was executed.
        """
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"do": do, **more}).encode() + b"\n")
        return self._answer(_ANSWER)

    def kill(self) -> None:
        """Kill the process at once, as by ``kill -9``."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """End the process and remove its folder."""
        if self._process.stdin:
            self._process.stdin.close()
        try:
            self._process.wait(_ANSWER)
        except subprocess.TimeoutExpired:
            self.kill()
        if self._process.stdout:
            self._process.stdout.close()
        self._errors.close()
        self._folder.close()

    def _answer(self, seconds: float) -> dict[str, Any]:
        pipe, until = self._process.stdout, time.monotonic() + seconds
        assert pipe is not None
        while b"\n" not in self._left:
            ready = select.select([pipe], [], [], max(until - time.monotonic(), 0))[0]
            data = os.read(pipe.fileno(), 1 << 16) if ready else b""
            if not data:
                self._errors.seek(0)
                raise SimulationError(
                    f"the simulated rig did not answer: {self._errors.read()[-2000:]}"
                )
            self._left += data
        line, _, self._left = self._left.partition(b"\n")
        answer: dict[str, Any] = json.loads(line)
        return answer


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
