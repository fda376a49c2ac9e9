"""Processes among which the poses of a motion are divided.

A pose is always computed by the same process, which keeps the voxels of that pose's targets.
"""

import os
import signal
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from functools import lru_cache
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar
from uuid import uuid4

from ..coverage.definitions.errors import InputError
from ..coverage.processors import processors
from ..coverage.targets.target import Target
from ..coverage.voxels.voxel_set import VoxelSet
from .pose_subset import MANY

_TASK = 4  # poses of one task: few, as progress is told after each
_NEEDS = "each needs memory, and a script must call them under if __name__ == '__main__'"

T = TypeVar("T")


class PoseWorkers:
    """A number of processes, which compute the poses asked for by ``each_pose`` within a ``with``
    block; they start when they are first needed, and end with the block.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self._running = list[tuple[Any, Connection]]()

    @classmethod
    def of_motion(cls, poses: int, count: int | None = None) -> "PoseWorkers":
        """Return ``count`` processes, by default one on each processor for a motion of more than
        ``MANY`` poses."""
        return cls(count or (processors() if poses > MANY else 1))

    def __enter__(self) -> "PoseWorkers":
        self._before = _ACTIVE.set(self)
        return self

    def __exit__(self, *error: object) -> None:
        _ACTIVE.reset(self._before)
        self._stop()

    def each(
        self, function: Callable[[int], T], poses: int, at: Callable[[int], None]
    ) -> tuple[T, ...]:
        """See ``each_pose``."""
        results = dict[int, T]()
        try:
            self._start(min(self.count, poses))
            for some in self._finished(function, poses):
                for pose in some:
                    at(pose)
                results |= some
        except BaseException as error:
            self._stop()
            if isinstance(error, EOFError | OSError):
                line = f"found {self.count}, one of which ended: {_NEEDS}"
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


_ACTIVE: ContextVar[PoseWorkers | None] = ContextVar("pose workers", default=None)


def active_workers() -> int:
    """Return the number of processes among which poses are divided here."""
    active = _ACTIVE.get()
    return 1 if active is None else active.count


def each_pose(
    function: Callable[[int], T], poses: int, at: Callable[[int], None] = lambda _: None
) -> tuple[T, ...]:
    """Return ``function`` of each pose from 0 to ``poses`` - 1, by the active ``PoseWorkers``.

    Args:
        function: can be pickled with all that it needs.
        poses: number of poses.
        at: called with each pose that another process has computed.

    Raises:
        InputError: if a process ended: memory ran out, or a script starts processes whenever it is
            imported.
    """
    active = _ACTIVE.get()
    if active is None or active.count == 1 or poses == 1:
        return tuple(map(function, range(poses)))
    return active.each(function, poses, at)


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
