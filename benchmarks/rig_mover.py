"""Check that moves a simulated robot in its own process: start, answers, end."""

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
_SECONDS = 20.0  # s, timeout for the start and the end of a check

_HERE = str(Path(__file__).parent)
# the forkserver does not read sys.path
os.environ["PYTHONPATH"] = os.pathsep.join([_HERE, os.environ.get("PYTHONPATH", "")])
_FORKS = get_context("forkserver")  # imports once; each check still has its own process
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
        """Wait for a message about ``what``; None if the process ends or the time is over
        first.
        """
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
        """Close the input: no more answers."""
        self._answers.close()

    def send(self, number: int) -> None:
        """Send a signal."""
        assert self.process.pid is not None
        os.kill(self.process.pid, number)

    def family(self) -> list[psutil.Process]:
        """Return the process and its children."""
        check = psutil.Process(self.process.pid)
        return [check, *check.children()]

    def child(self, module: str) -> psutil.Process:
        """Return the child that runs a module."""
        return next(c for c in self.family() if module in " ".join(c.cmdline()))

    def close(self) -> None:
        """End the process if it still runs."""
        self.no_more()
        self.process.join(_SECONDS)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self._reader.join()
        self._lines.close()
