"""Processes among which the poses of a motion are divided.

A pose is always computed by the same process, which keeps the voxels of that pose's targets.
"""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from multiprocessing import current_process, get_context, parent_process
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
        except _NotSentError:
            self._stop()
            return tuple(map(function, range(poses)))
        except BaseException:
            self._stop()
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
                    self._send(worker, (function, some))
                    busy.append(worker)
            ready = wait(busy) if busy else []
            for worker in ready:
                busy.remove(worker)
                yield self._received(worker)

    def _send(self, worker: Connection, task: tuple[Callable[[int], Any], range]) -> None:
        try:
            worker.send(task)
        except OSError as error:
            raise self._ended() from error
        except Exception as error:  # which of them tells how the function was made
            raise _NotSentError from error

    def _received(self, worker: Connection) -> Any:
        try:
            results = worker.recv()
        except (EOFError, OSError) as error:
            raise self._ended() from error
        if isinstance(results, Exception):
            raise results
        return results

    def _ended(self) -> InputError:
        line = f"found {self.count}, one of which ended: {_NEEDS}"
        return InputError(line, "workers")

    def _start(self, count: int) -> None:
        """Start processes until there are ``count``."""
        threads = max(processors() // self.count, 1)
        context = get_context("spawn")  # the threads of libraries do not survive a fork
        while len(self._running) < count:
            try:
                here, there = context.Pipe()
                process = context.Process(target=_serve, args=(there, threads), daemon=True)
                self._running.append((process, here))
                with _interrupts_later():
                    process.start()
            except OSError as error:
                line = f"found {self.count}, of which {len(self._running)} could be started"
                raise InputError(f"{line}: {error.strerror}", "workers") from error
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
        function: sent to other processes, if it can be pickled with all that it needs.
        poses: number of poses.
        at: called with each pose that another process has computed.

    Raises:
        InputError: if a process cannot be started, or ended: memory ran out, or a script starts
            processes whenever it is imported.
    """
    active = _ACTIVE.get()
    if active is None or active.count == 1 or poses == 1 or current_process().daemon:
        return tuple(map(function, range(poses)))
    return active.each(function, poses, at)


@contextmanager
def _interrupts_later() -> Iterator[None]:
    """Hold Ctrl-C back; processes that start meanwhile never receive it, where POSIX has masks."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(asked: Connection, threads: int) -> None:
    """Compute what is asked for until the process that asks has closed the connection or ended."""
    os.environ["OMP_NUM_THREADS"] = str(threads)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        while True:
            answer = _answer(asked)
            try:
                asked.send(answer)
            except OSError:
                raise
            except Exception:
                asked.send(_NotSentError())
    except (EOFError, OSError):
        return


def _answer(asked: Connection) -> dict[int, Any] | Exception:
    """Return the results of the next task, or the error that it raised."""
    try:
        function, poses = asked.recv()
    except (EOFError, OSError):
        raise
    except Exception:
        return _NotSentError()
    try:
        return {pose: function(pose) for pose in poses}
    except Exception as error:
        return error


def _end_with_parent() -> None:
    """End this process as soon as the one that started it has ended, also within a task."""
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


class _NotSentError(Exception):
    """A task or its results cannot be pickled, or the pickle not be read in another process."""


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
