"""Execution of a study's cells on the processes of a cluster.

The process that holds the study's file hands out batches of cells that share costly preparation. A
worker reports each cell as soon as it is finished, so that the result is stored at once. Workers
receive text only: names of tasks, which they look up in their own table, names of the modules that
register them, and arguments as JSON.
"""

import json
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from importlib.metadata import version
from queue import Empty, SimpleQueue
from typing import Any

from distributed import Client, Future, KilledWorker, get_worker

from ...coverage.definitions.errors import UserError
from .runner import TASKS, Work, shared
from .store import Cell, Store

_STUDIES = f"{__package__.rpartition('.')[0]}."
_GONE = "lost the scheduler; finished cells are kept, run again to resume"
_LOSSES = 3  # a cell is given up after it has ended this many workers
_ALONE = 120.0  # s, a study gives up after this time without workers
_LOOK = 1.0  # s, interval between checks of the number of workers
_SPLIT = 4  # at least this many batches per worker, if there are enough cells


def _required(cells: Sequence[Cell], works: Mapping[str, Work]) -> list[Any]:
    """Return the requirements on workers: the version, and the modules that register the tasks."""
    modules = {works[cell.work].__module__ for cell in cells}
    return [version("place-rings"), sorted(name for name in modules if name.startswith(_STUDIES))]


def _measure(required: Sequence[Any], topic: str, keys: list[str]) -> None:
    """On a worker: measure the cells of these keys with the required version and report each
    result.
    """
    worker = get_worker()
    needed, modules = required
    if (own := version("place-rings")) != needed:
        raise UserError(
            f"{worker.address}: found place-rings {own}, but this machine has {needed}; install"
            " the same version"
        )
    for module in modules:
        import_module(module)
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
        cells, works, store, tell: see ``runner.run``.

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
