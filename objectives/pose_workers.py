"""Processes among which the poses of a motion are divided.

A pose is always computed by the same process, which keeps the voxels of that pose's targets.
"""

import os
import signal
from collections.abc import Callable, Iterator
from functools import lru_cache
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar
from uuid import uuid4

from ..coverage.definitions.errors import InputError
from ..coverage.processors import processors
from ..coverage.targets.target import Target
from ..coverage.voxels.voxel_set import VoxelSet

_TASK = 4  # poses of one task: few, as progress is told after each

T = TypeVar("T")


class PoseWorkers:
    """A number of processes, started by the first use within a ``with`` block and ended by the
    outermost one. Outside of one, and for a single process, poses are computed here.
    """

    def __init__(self, count: int = 1) -> None:
        self.count = count
        self._depth, self._running = 0, list[tuple[Any, Connection]]()

    def __enter__(self) -> "PoseWorkers":
        self._depth += 1
        return self

    def __exit__(self, *error: object) -> None:
        self._depth -= 1
        if self._depth == 0:
            self._stop()

    def each(
        self,
        function: Callable[[int], T],
        poses: int,
        at: Callable[[int], None] = lambda _: None,
    ) -> tuple[T, ...]:
        """Return ``function`` of each pose from 0 to ``poses`` - 1.

        Args:
            function: can be pickled with all that it needs.
            poses: number of poses.
            at: called with the number of finished poses, if other processes compute them.

        Raises:
            InputError: if a process ended, as it does when memory runs out.
        """
        if self.count == 1 or self._depth == 0 or poses == 1:
            return tuple(map(function, range(poses)))
        self._start(min(self.count, poses))
        results = dict[int, T]()
        try:
            for some in self._finished(function, poses):
                at(len(results))
                results |= some
        except BaseException as error:
            self._stop()
            if isinstance(error, EOFError | OSError):
                line = f"found {self.count}, one of which ended; fewer need less memory"
                raise InputError(line, "workers") from error
            raise
        return tuple(results[i] for i in range(poses))

    def _finished(self, function: Callable[[int], T], poses: int) -> Iterator[dict[int, T]]:
        """Yield the results of each task by their poses."""
        ready: Any = [worker for _, worker in self._running]
        each = [range(number, poses, len(ready)) for number in range(len(ready))]
        tasks = {
            worker: iter([own[i : i + _TASK] for i in range(0, len(own), _TASK)])
            for worker, own in zip(ready, each, strict=True)
        }
        busy = list[Any]()
        while ready:
            for worker in ready:
                if (some := next(tasks[worker], None)) is not None:
                    worker.send((function, some))
                    busy.append(worker)
            ready = wait(busy) if busy else []
            for worker in ready:
                busy.remove(worker)
                results = worker.recv()
                if isinstance(results, Exception):
                    raise results
                yield results

    def _start(self, count: int) -> None:
        """Start processes until there are ``count``."""
        threads = max(processors() // self.count, 1)
        context = get_context("spawn")  # the threads of libraries do not survive a fork
        while len(self._running) < count:
            here, there = context.Pipe()
            process = context.Process(target=_serve, args=(there, threads), daemon=True)
            self._running.append((process, here))
            process.start()
            there.close()  # so that reading fails once the process has ended

    def _stop(self) -> None:
        while self._running:
            process, connection = self._running.pop()
            connection.close()
            if process.pid is not None:
                process.terminate()
                process.join()


ALONE = PoseWorkers()
"""This process alone."""


def _serve(asked: Connection, threads: int) -> None:
    """Compute what is asked for, until the process that asks has closed the connection or ended;
    Ctrl-C is left to it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ["OMP_NUM_THREADS"] = str(threads)
    try:
        while True:
            function, poses = asked.recv()
            try:
                asked.send({pose: function(pose) for pose in poses})
            except Exception as error:
                asked.send(error)
    except (EOFError, OSError):
        return


class KeptVoxels(dict[tuple[Target, int], VoxelSet]):
    """Voxels of targets at poses, the same for all verifiers that share them.

    Sent to another process, it becomes the one that the process itself has filled for them.
    """

    def __init__(self, token: str = "") -> None:
        super().__init__()
        self.token = token or uuid4().hex
        """Identifies the verifiers that share the voxels."""

    def __reduce__(self) -> tuple[Any, ...]:
        return _kept_here, (self.token,)


@lru_cache(1)
def _kept_here(token: str) -> KeptVoxels:
    """Return the voxels that this process keeps, of the verifiers asked for last."""
    return KeptVoxels(token)
