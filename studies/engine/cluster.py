"""Runs the cells of a study on many processes of dask.distributed: of this machine, or of a
scheduler that runs already.

The one process that has the study's file hands out batches of cells that share costly preparation.
A worker tells of each cell as soon as it is finished, so that it can be kept at once. What goes to
a worker is text: the names of tasks, which it looks up in its own table, the modules of the studies
that register them, and their arguments as JSON.

Yet dask's own messages carry Python objects: whoever reaches a scheduler can run code on all its
machines. So the local cluster listens on 127.0.0.1 only, under a certificate of its own that nobody
else has; and a scheduler that is joined must be one that is trusted.
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
from .runner import Work
from .store import Cell, Store
from .tasks import TASKS, shared

_STUDIES = f"{__package__.rpartition('.')[0]}."
_GONE = "the scheduler is gone; what is measured is kept, run again to go on"
_LOSSES = 3  # workers that a cell may take with it
_ALONE = 120.0  # s without any worker, until a study gives up
_LOOK = 1.0  # s, between looks at how many workers there are
_SPLIT = 4  # batches for each worker, at least, where there are enough cells


def _required(cells: Sequence[Cell], works: Mapping[str, Work]) -> list[Any]:
    """What a worker must have to measure these cells: by their tasks the version of the program,
    and the modules that register the tasks.
    """
    tasks = {name: works[name] for name in sorted({cell.work for cell in cells})}
    modules = {task.__module__ for task in tasks.values()}
    return [programs(tasks), sorted(name for name in modules if name.startswith(_STUDIES))]


@cache
def _own_versions(tasks: tuple[str, ...], modules: tuple[str, ...]) -> dict[str, str]:
    """On a worker: by these tasks the version of its own program; none where it lacks the task."""
    with suppress(ImportError):  # then this is another program
        for module in modules:
            import_module(module)
    return programs({name: TASKS[name] for name in tasks if name in TASKS})


def _measure(required: Sequence[Any], topic: str, keys: list[str]) -> None:
    """On a worker: measure the cells of these keys by the program required, and report each when
    it is finished.
    """
    worker = get_worker()
    versions, modules = required
    own = _own_versions(tuple(versions), tuple(modules))
    for task, version in versions.items():
        if own.get(task) != version:
            raise UserError(
                f"{worker.address}: found a worker whose {task!r} is of place-rings"
                f" {own.get(task)}, allowed: {version}, as here"
            )
    for key in keys:
        work, arguments = json.loads(key)
        start = time.perf_counter()
        result = TASKS[work](**arguments)
        worker.log_event(topic, json.dumps([key, result, time.perf_counter() - start]))


class _Study:
    """The cells still waiting, the batches they are in, and those that are out."""

    def __init__(self, client: Client, cells: Sequence[Cell], required: list[Any]) -> None:
        self.client, self.required = client, required
        self.topic = f"place-rings-{uuid.uuid4()}"
        self.waiting = {cell.key: cell for cell in cells}
        # of finished cells, as text, and of ended batches
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
        """As many batches as there are workers: one that waited behind another would be lost with
        it.
        """
        if time.monotonic() - self.looked > _LOOK:
            self.workers, self.looked = self._count(), time.monotonic()
            self.met = self.looked if self.workers else self.met
            if self.looked - self.met > _ALONE:
                raise UserError(
                    f"no workers for {_ALONE:g} s; what is measured is kept, run again to go on"
                )
        while self.batches and len(self.out) < self.workers:
            keys = self.batches.popleft()
            future = self.client.submit(_measure, self.required, self.topic, keys, pure=False)
            self.out[future] = keys
            future.add_done_callback(self.news.put)

    def ended(self, future: "Future[Any]") -> None:
        """Raise what a batch ended by; put back what a lost worker left."""
        rest = [key for key in self.out.pop(future) if key in self.waiting]
        status, error = future.status, future.exception() if future.status == "error" else None
        future.release()  # else it is measured again where its worker is lost now
        self.looked = 0.0
        if error is not None:
            if not isinstance(error, KilledWorker):
                raise error
            if not rest:
                return
            self.losses[rest[0]] += 1
            if self.losses[rest[0]] >= _LOSSES:
                raise UserError(
                    f"{rest[0]}: found to end its worker, {_LOSSES} times, allowed: cells that can"
                    " be measured"
                )
            # the one suspected now alone
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
    """The results of ``cells`` in their order, measured by the workers of ``client``; else like
    ``runner.run``.

    A cell whose worker is lost is measured again.

    Raises:
        UserError: if a cell ends its worker again and again, a worker has another program, or the
            scheduler is gone.
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
_ANSWER, _WORKER = 30.0, 30.0  # s, for a scheduler to answer, and then to have a worker
_START = 300.0  # s, for a worker to start, on a machine however busy
_GRACE = 1.0  # s, for a worker to end
_LOCAL = {
    "distributed.worker.multiprocessing-method": "spawn",  # JAX's threads do not survive a fork
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ": (
        {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")} | {"NPROC": "1"}
    ),  # XLA's name for it
    # who was lost is seen here, where it is known what was finished
    "distributed.scheduler.allowed-failures": 0,
    # a worker is started again, however long that takes
    "distributed.deploy.lost-worker-timeout": "365 days",
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    "distributed.nanny.http.routes": [],
}


@contextmanager
def here(workers: int) -> Iterator[Client]:
    """A cluster of that many processes on this machine. They end with this process, however it
    ends.
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
                for name in set(os.environ) - environment:  # set for the workers
                    del os.environ[name]


@contextmanager
def _uninterrupted() -> Iterator[list[int]]:
    """Ctrl-C is only noted, as half a cluster cannot be closed; threads and processes that start
    here never see it.
    """
    pressed: list[int] = []
    resource_tracker.ensure_running()  # else it is started below, and unblocks what is blocked
    handler = signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield pressed
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, handler)


async def _close(cluster: LocalCluster) -> None:
    """End the workers without waiting for what they still measure, which nobody wants."""
    with suppress(TimeoutError):
        await asyncio.gather(*(nanny.close(timeout=_GRACE) for nanny in cluster.workers.values()))


@contextmanager
def there(scheduler: str) -> Iterator[Client]:
    """The cluster of a scheduler that runs already.

    Raises:
        UserError: if there is none at that address, or one without workers, or without place-rings.
    """
    # what goes wrong is told in a line
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    try:
        client = Client(scheduler, timeout=_ANSWER, set_as_default=False)
    except OSError as error:
        raise UserError(
            f"--scheduler: found {scheduler}, where none answers, allowed: a running one"
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_WORKER)
        except TimeoutError as error:
            raise UserError(
                f"--scheduler: found {scheduler} without workers, allowed: a scheduler with some"
            ) from error
        _check(client)
        yield client


def _check(client: Client) -> None:
    """See that the scheduler and its workers have the program, as a message with a name that they
    lack would end them.
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
            f"--scheduler: found a process without {_NEEDED}, allowed: all with place-rings"
            " installed as here"
        )
