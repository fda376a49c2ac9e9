"""Runs the cells of a study on many processes, of this machine or of several.

The one process that has the study's file hands out batches of cells that share costly preparation. A worker tells of each
cell as soon as it is finished, so that it can be kept at once. What goes to a worker is text: the names of works, which it
looks up in its own table, and their arguments as JSON.
"""

import json
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from queue import Empty, SimpleQueue
from typing import Any

from distributed import Client, Future, KilledWorker, get_worker

from ..formats.errors import UserError
from .engine import Work, program
from .store import Cell, Store
from .works import WORKS, shared

_GONE = "the scheduler is gone; what is measured is kept, run again to go on"
_LOSSES = 3  # workers that a cell may take with it
_ALONE = 120.0  # s without any worker, until a study gives up
_LOOK = 1.0  # s, between looks at how many workers there are
_SPLIT = 4  # batches for each worker, at least, where there are enough cells


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
        self.workers, self.looked, self.met = self._count(), time.monotonic(), time.monotonic()
        groups: dict[str, list[str]] = {}
        for key, cell in self.waiting.items():
            groups.setdefault(shared(cell), []).append(key)
        most = max(len(self.waiting) // (_SPLIT * max(self.workers, 1)), 1)
        self.batches = deque(keys[i : i + most] for keys in groups.values() for i in range(0, len(keys), most))

    def _count(self) -> int:
        try:
            return sum(self.client.nthreads().values())
        except OSError as error:
            raise UserError(_GONE) from error

    def hand_out(self) -> None:
        """As many batches as there are workers: one that waited behind another would be lost with it."""
        if time.monotonic() - self.looked > _LOOK:
            self.workers, self.looked = self._count(), time.monotonic()
            self.met = self.looked if self.workers else self.met
            if self.looked - self.met > _ALONE:
                raise UserError(f"no workers for {_ALONE:g} s; what is measured is kept, run again to go on")
        while self.batches and len(self.out) < self.workers:
            keys = self.batches.popleft()
            future = self.client.submit(_measure, self.asked, self.topic, keys, pure=False)
            self.out[future] = keys
            future.add_done_callback(self.news.put)

    def ended(self, future: Future) -> None:
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
                raise UserError(f"{rest[0]}: found to end its worker, {_LOSSES} times, allowed: cells that can be measured")
            self.batches.extendleft([rest[1:], rest[:1]] if rest[1:] else [rest])  # the one suspected now alone
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
