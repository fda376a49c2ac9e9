"""Runs the cells of a study on many processes, of this machine or of several, by dask.distributed.

The one process that has the study's file hands out batches of cells that share costly preparation. A worker tells of each
cell as soon as it is finished, so that it can be kept at once. What goes to a worker is text: the names of works, which it
looks up in its own table, and their arguments as JSON. Yet dask's own messages carry Python objects: whoever reaches a
scheduler can run code on all its machines. So the local cluster listens on 127.0.0.1 only, under a certificate of its own
that nobody else has, and a scheduler that is joined must be one that is trusted.
"""

import json
import logging
import signal
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from multiprocessing import resource_tracker
from queue import Empty, SimpleQueue
from typing import Any

import dask
from distributed import Client, Future, KilledWorker, LocalCluster, get_worker
from distributed.security import Security

from ..placement.errors import UserError
from .engine import Work, program
from .store import Cell, Store
from .works import WORKS, shared

_LOSSES = 3  # workers that a cell may take with it
_JOIN = 30.0  # s, for a scheduler to answer and to have a worker
_LOOK = 1.0  # s, between looks at how many workers there are
_SPLIT = 4  # batches for each worker, at least, where there are enough cells
_LOCAL = {
    "distributed.worker.multiprocessing-method": "spawn",  # JAX's threads do not survive a fork
    "distributed.worker.profile.enabled": False,
    "distributed.scheduler.allowed-failures": 0,  # who was lost is seen here, where it is known what was finished
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    "distributed.nanny.http.routes": [],
}


@contextmanager
def here(workers: int) -> Iterator[Client]:
    """A cluster of that many processes on this machine. They end with this process, however it ends."""
    resource_tracker.ensure_running()  # else it is started below, and unblocks what is blocked
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # Ctrl-C is this process's: workers inherit the block
    with dask.config.set(_LOCAL):
        try:
            cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                memory_limit=0,
                host="127.0.0.1",
                protocol="tls://",
                security=Security.temporary(),
                dashboard_address=None,
                scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
                death_timeout=_JOIN,
                silence_logs=logging.CRITICAL,
            )
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        with cluster, Client(cluster, set_as_default=False) as client:
            yield client


@contextmanager
def there(scheduler: str) -> Iterator[Client]:
    """The cluster of a scheduler that runs already.

    Raises:
        UserError: if there is none at that address, or one without workers.
    """
    try:
        client = Client(scheduler, timeout=_JOIN, set_as_default=False)
    except (OSError, ValueError) as error:
        allowed = "the address of a scheduler, like tcp://HOST:8786"
        raise UserError(f"--scheduler: found {scheduler}, which does not answer ({error}), allowed: {allowed}") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_JOIN)
        except TimeoutError as error:
            raise UserError(f"--scheduler: found {scheduler} without workers, allowed: a scheduler with some") from error
        yield client


@cache
def _own_program() -> str:
    return program(WORKS)


def _measure(asked: str, topic: str, keys: list[str]) -> None:
    """On a worker: measure the cells of these keys by the program asked for, and tell of each when it is finished."""
    worker = get_worker()
    if asked != _own_program():
        raise UserError(f"{worker.address}: found a worker of place-rings {_own_program()}, allowed: {asked}, as here")
    for key in keys:
        work, arguments = json.loads(key)
        start = time.perf_counter()
        result = WORKS[work](**arguments)
        worker.log_event(topic, json.dumps([key, result, time.perf_counter() - start]))


class _Study:
    """The cells still waiting, the batches they are in, and those that are out."""

    def __init__(self, client: Client, cells: Sequence[Cell], asked: str) -> None:
        self.client, self.asked, self.topic = client, asked, f"place-rings-{uuid.uuid4()}"
        self.waiting = {cell.key: cell for cell in cells}
        self.news: SimpleQueue[str | Future] = SimpleQueue()  # of finished cells, as text, and of ended batches
        self.out: dict[Future, list[str]] = {}
        self.losses: Counter[str] = Counter()
        self.workers, self.looked = self._count(), time.monotonic()
        groups: dict[str, list[str]] = {}
        for key, cell in self.waiting.items():
            groups.setdefault(shared(cell), []).append(key)
        most = max(len(self.waiting) // (_SPLIT * max(self.workers, 1)), 1)
        self.batches = deque(keys[i : i + most] for keys in groups.values() for i in range(0, len(keys), most))

    def _count(self) -> int:
        return sum(self.client.nthreads().values())

    def hand_out(self) -> None:
        """As many batches as there are workers: one that waited behind another would be lost with it."""
        if time.monotonic() - self.looked > _LOOK:
            self.workers, self.looked = self._count(), time.monotonic()
        while self.batches and len(self.out) < self.workers:
            keys = self.batches.popleft()
            future = self.client.submit(_measure, self.asked, self.topic, keys, pure=False)
            self.out[future] = keys
            future.add_done_callback(self.news.put)

    def ended(self, future: Future) -> None:
        """Raise what a batch ended by; put back what a lost worker left."""
        rest = [key for key in self.out.pop(future) if key in self.waiting]
        self.looked = 0.0
        if future.status == "error":
            error = future.exception()
            if isinstance(error, ImportError):
                raise UserError(f"{error}: found a worker without it, allowed: workers with place-rings as here") from error
            if not isinstance(error, KilledWorker):
                raise error
            if not rest:
                return
            self.losses[rest[0]] += 1
            if self.losses[rest[0]] >= _LOSSES:
                raise UserError(f"{rest[0]}: found to end its worker, {_LOSSES} times, allowed: cells that can be measured")
            self.batches.extendleft([rest[1:], rest[:1]] if rest[1:] else [rest])  # the one suspected now alone
        elif future.status != "finished":
            raise UserError("the scheduler is gone; what is measured is kept, run again to go on")
        elif rest:
            self.batches.appendleft(rest)


def run(
    client: Client,
    cells: Sequence[Cell],
    works: Mapping[str, Work],
    store: Store,
    tell: Callable[[int, int], None] = lambda done, total: None,
) -> list[Any]:
    """The results of ``cells`` in their order, measured by the workers of ``client``; else like ``engine.run``.

    A cell whose worker is lost is measured again.

    Raises:
        UserError: if a cell ends its worker again and again, a worker has another program, or the scheduler is gone.
    """
    found = {cell.key: store.get(cell) for cell in cells}
    study = _Study(client, [cell for cell in cells if found[cell.key] is None], program(works))

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
