"""Execution of a study's cells on many processes of dask.distributed, local or of a running
scheduler.

The process that holds the study's file hands out batches of cells that share costly preparation. A
worker reports each cell as soon as it is finished, so that the result is stored at once. Workers
receive text only: names of tasks, which they look up in their own table, names of the modules that
register them, and arguments as JSON.

Dask's own messages carry Python objects, however: whoever reaches a scheduler can run code on all
its machines. The local cluster therefore listens on 127.0.0.1 only, with a private certificate.
Join only a scheduler that you trust.
"""

import asyncio
import json
import logging
import os
import signal
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from multiprocessing import resource_tracker
from queue import Empty, SimpleQueue
from typing import Any

import dask
from distributed import Client, Future, KilledWorker, LocalCluster, get_worker
from distributed.security import Security

from ...formats.errors import UserError
from .digest import programs
from .registry import TASKS, shared
from .runner import Work
from .store import Cell, Store

_STUDIES = f"{__package__.rpartition('.')[0]}."
_GONE = "lost the scheduler; finished cells are kept, run again to resume"
_LOSSES = 3  # a cell is given up after it has ended this many workers
_ALONE = 120.0  # s, a study gives up after this time without workers
_LOOK = 1.0  # s, interval between checks of the number of workers
_SPLIT = 4  # at least this many batches per worker, if there are enough cells


def _required(cells: Sequence[Cell], works: Mapping[str, Work]) -> list[Any]:
    """Return the requirements on workers for these cells.

    They are the version of the program by task, and the modules that register the tasks.
    """
    tasks = {name: works[name] for name in sorted({cell.work for cell in cells})}
    modules = {task.__module__ for task in tasks.values()}
    return [programs(tasks), sorted(name for name in modules if name.startswith(_STUDIES))]


@cache
def _own_versions(tasks: tuple[str, ...], modules: tuple[str, ...]) -> dict[str, str]:
    """On a worker: return the version of its own program by task; tasks that it lacks are left
    out.
    """
    with suppress(ImportError):  # the worker runs another version of the program
        for module in modules:
            import_module(module)
    return programs({name: TASKS[name] for name in tasks if name in TASKS})


def _measure(required: Sequence[Any], topic: str, keys: list[str]) -> None:
    """On a worker: measure the cells of these keys with the required program and report each
    result.
    """
    worker = get_worker()
    versions, modules = required
    own = _own_versions(tuple(versions), tuple(modules))
    for task, version in versions.items():
        if own.get(task) != version:
            raise UserError(
                f"{worker.address}: task {task!r} is from place-rings {own.get(task)}, but this"
                f" machine has {version}; install the same version"
            )
    for key in keys:
        work, arguments = json.loads(key)
        start = time.perf_counter()
        result = TASKS[work](**arguments)
        worker.log_event(topic, json.dumps([key, result, time.perf_counter() - start]))


class _Study:
    """Waiting cells, their batches, and the batches handed out."""

    def __init__(self, client: Client, cells: Sequence[Cell], required: list[Any]) -> None:
        self.client, self.required = client, required
        self.topic = f"place-rings-{uuid.uuid4()}"
        self.waiting = {cell.key: cell for cell in cells}
        # messages: finished cells as text, and ended batches
        self.news: SimpleQueue[str | Future[Any]] = SimpleQueue()
        self.out: dict[Future[Any], list[str]] = {}
        self.losses: Counter[str] = Counter()
        self.workers, self.looked, self.met = self._count(), time.monotonic(), time.monotonic()
        groups: dict[str, list[str]] = {}
        for key, cell in self.waiting.items():
            groups.setdefault(shared(cell), []).append(key)
        most = max(len(self.waiting) // (_SPLIT * max(self.workers, 1)), 1)
        self.batches = deque(
            keys[i : i + most] for keys in groups.values() for i in range(0, len(keys), most)
        )

    def _count(self) -> int:
        try:
            return sum(self.client.nthreads().values())
        except OSError as error:
            raise UserError(_GONE) from error

    def hand_out(self) -> None:
        """Hand out as many batches as there are workers.

        A batch that waited behind another one would be lost with its worker.
        """
        if time.monotonic() - self.looked > _LOOK:
            self.workers, self.looked = self._count(), time.monotonic()
            self.met = self.looked if self.workers else self.met
            if self.looked - self.met > _ALONE:
                raise UserError(
                    f"no workers for {_ALONE:g} s; finished cells are kept, run again to resume"
                )
        while self.batches and len(self.out) < self.workers:
            keys = self.batches.popleft()
            future = self.client.submit(_measure, self.required, self.topic, keys, pure=False)
            self.out[future] = keys
            future.add_done_callback(self.news.put)

    def ended(self, future: "Future[Any]") -> None:
        """Raise a batch's exception, or put back the cells that a lost worker left."""
        rest = [key for key in self.out.pop(future) if key in self.waiting]
        status, error = future.status, future.exception() if future.status == "error" else None
        future.release()  # otherwise losing its worker now would repeat the measurement
        self.looked = 0.0
        if error is not None:
            if not isinstance(error, KilledWorker):
                raise error
            if not rest:
                return
            self.losses[rest[0]] += 1
            if self.losses[rest[0]] >= _LOSSES:
                raise UserError(
                    f"{rest[0]}: this cell ended its worker {_LOSSES} times and cannot be measured"
                )
            # the suspected cell gets a batch of its own
            self.batches.extendleft([rest[1:], rest[:1]] if rest[1:] else [rest])
        elif status != "finished":
            raise UserError(_GONE)
        elif rest:
            self.batches.appendleft(rest)


def run(
    client: Client,
    cells: Sequence[Cell],
    works: Mapping[str, Work],
    store: Store,
    tell: Callable[[int, int], None] = lambda done, total: None,
) -> list[Any]:
    """Return the results of ``cells`` in their order, measured by the workers of ``client``.

    A cell whose worker is lost is measured again.

    Args:
        client: client of the cluster.
        cells: see ``runner.run``.
        works: see ``runner.run``.
        store: see ``runner.run``.
        tell: see ``runner.run``.

    Raises:
        UserError: if a cell repeatedly ends its worker, a worker has another version of the
            program, or the scheduler is lost.
    """
    found = {cell.key: store.get(cell) for cell in cells}
    waiting = [cell for cell in cells if found[cell.key] is None]
    study = _Study(client, waiting, _required(waiting, works))

    def keep(text: str) -> None:
        key, result, seconds = json.loads(text)
        if key in study.waiting:
            store.put(study.waiting[key], result, seconds)
            found[key] = result
            del study.waiting[key]
        tell(len(found) - len(study.waiting), len(found))

    tell(len(found) - len(study.waiting), len(found))
    client.subscribe_topic(study.topic, lambda event: study.news.put(event[1]))
    try:
        while study.waiting:
            study.hand_out()
            with suppress(Empty):
                news = study.news.get(timeout=_LOOK)
                keep(news) if isinstance(news, str) else study.ended(news)
    finally:
        while not study.news.empty():
            if isinstance(news := study.news.get(), str):
                keep(news)
        client.cancel(list(study.out))
        client.unsubscribe_topic(study.topic)
    return [found[cell.key] for cell in cells]


_NEEDED = f"{__package__}.cluster"
_ANSWER, _WORKER = 30.0, 30.0  # s, timeouts for a scheduler's answer and for its first worker
_START = 300.0  # s, for a worker to start on a busy machine
_GRACE = 1.0  # s, for a worker to end
_LOCAL = {
    "distributed.worker.multiprocessing-method": "spawn",  # JAX's threads do not survive a fork
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ": (
        {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")} | {"NPROC": "1"}
    ),  # XLA's name of the option
    # this process handles losses, as it knows which cells are finished
    "distributed.scheduler.allowed-failures": 0,
    # restart a worker, however long that takes
    "distributed.deploy.lost-worker-timeout": "365 days",
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    "distributed.nanny.http.routes": [],
}


@contextmanager
def here(workers: int) -> Iterator[Client]:
    """Yield a cluster of ``workers`` local processes, which end with this process in every
    case.
    """
    environment = set(os.environ)
    with dask.config.set(_LOCAL):
        with _uninterrupted() as pressed:
            cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                memory_limit=0,
                host="127.0.0.1",
                protocol="tls://",
                security=Security.temporary(),
                dashboard_address=None,
                scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
                death_timeout=_START,
                silence_logs=logging.CRITICAL,
            )
            client = Client(cluster, set_as_default=False)
        try:
            if pressed:
                raise KeyboardInterrupt
            yield client
        finally:
            with _uninterrupted():
                cluster.sync(_close, cluster)
                client.close()
                cluster.close()
                for name in (
                    set(os.environ) - environment
                ):  # variables that were set for the workers
                    del os.environ[name]


@contextmanager
def _uninterrupted() -> Iterator[list[int]]:
    """Only record Ctrl-C, as half a cluster cannot be closed.

    Threads and processes that start in this context never receive it.
    """
    pressed: list[int] = []
    resource_tracker.ensure_running()  # started below, it would unblock the signals
    handler = signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield pressed
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, handler)


async def _close(cluster: LocalCluster) -> None:
    """End the workers without waiting for their current cells."""
    with suppress(TimeoutError):
        await asyncio.gather(*(nanny.close(timeout=_GRACE) for nanny in cluster.workers.values()))


@contextmanager
def there(scheduler: str) -> Iterator[Client]:
    """Yield the cluster of a running scheduler.

    Raises:
        UserError: if there is no scheduler at that address, or it has no workers, or no
            place-rings.
    """
    # errors are reported in one line
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    try:
        client = Client(scheduler, timeout=_ANSWER, set_as_default=False)
    except OSError as error:
        raise UserError(f"--scheduler: no scheduler answers at {scheduler}") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_WORKER)
        except TimeoutError as error:
            raise UserError(f"--scheduler: {scheduler} has no workers") from error
        _check(client)
        yield client


def _check(client: Client) -> None:
    """Check that the scheduler and its workers have the program.

    A message with a name that they lack would end them.
    """
    try:
        found = [
            client.run_on_scheduler(find_spec, _NEEDED),
            *client.run(find_spec, _NEEDED).values(),
        ]
    except ImportError:
        found = [None]
    if not all(found):
        raise UserError(
            f"--scheduler: a process lacks {_NEEDED}; install place-rings as here on all machines"
        )
