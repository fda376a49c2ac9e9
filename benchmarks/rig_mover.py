"""A check that moves a simulated robot, as a process of its own: started, told to go on, ended."""

import json
import os
import time
from multiprocessing import get_context
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import Any

import psutil
from place_rings.rig.simulated.process import SimulatedRig

RINGS = 2
_SECONDS = 20.0  # s, that a check may take to start, or to end

_HERE = str(Path(__file__).parent)
# the forkserver reads no sys.path
os.environ["PYTHONPATH"] = os.pathsep.join([_HERE, os.environ.get("PYTHONPATH", "")])
_FORKS = get_context("forkserver")  # imports once; each check is a process of its own all the same
_FORKS.set_forkserver_preload(["rig_mover_victim"])


class Victim:
    """A check that moves the robot of ``rig``."""

    def __init__(self, rig: SimulatedRig) -> None:
        from rig_mover_victim import work

        (answers, self._answers), (self._lines, lines) = _FORKS.Pipe(False), _FORKS.Pipe(False)
        self.process = _FORKS.Process(
            target=work, args=(rig.address, [rig.ring(i) for i in range(RINGS)], answers, lines)
        )
        self.process.start()
        answers.close()
        lines.close()
        self._said: Queue[dict[str, Any]] = Queue()
        self._reader = Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        with os.fdopen(os.dup(self._lines.fileno())) as lines:
            for line in lines:
                self._said.put(json.loads(line))

    def wait(self, what: str, seconds: float = _SECONDS) -> dict[str, Any] | None:
        """What it says of ``what``, once it does; None if it ends before, or does not in time."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            try:
                said = self._said.get(timeout=min(left, 0.1))
            except Empty:
                if (
                    not self.process.is_alive()
                    and not self._reader.is_alive()
                    and self._said.empty()
                ):
                    return None
                continue
            if said["what"] == what:
                return said
            if said["what"] == "ended":
                return None
        return None

    def go(self) -> None:
        """Answer the question between two motions."""
        os.write(self._answers.fileno(), b"\n")

    def no_more(self) -> None:
        """Answer nothing any more: the end of its input."""
        self._answers.close()

    def send(self, number: int) -> None:
        """Send it a signal."""
        assert self.process.pid is not None
        os.kill(self.process.pid, number)

    def family(self) -> list[psutil.Process]:
        """It, and the processes that it has."""
        check = psutil.Process(self.process.pid)
        return [check, *check.children()]

    def child(self, module: str) -> psutil.Process:
        """Its process that runs a module."""
        return next(c for c in self.family() if module in " ".join(c.cmdline()))

    def close(self) -> None:
        """End it, if it has not ended."""
        self.no_more()
        self.process.join(_SECONDS)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self._reader.join()
        self._lines.close()
