"""Stops a search at a deadline or on request."""

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from typing import Any

_POLL = 0.2  # s between two looks at the clock while jobs run
_GRACE = 1.0  # s that running jobs have to end after a stop


class CutShortError(Exception):
    """A stop came before a result."""


@dataclass
class StopToken:
    """Tells every local search to stop, after a deadline or on request."""

    deadline: float
    """Time of the ``clock`` after which to stop, s."""
    pulled: threading.Event = field(default_factory=threading.Event)
    """Set to stop before the deadline."""
    clock: Callable[[], float] = time.monotonic
    """Returns the time in seconds."""

    def on(self) -> bool:
        """Return whether to stop."""
        return self.pulled.is_set() or self.clock() > self.deadline

    def ended(self, jobs: Iterable[Future[Any]]) -> Iterator[set[Future[Any]]]:
        """Yield the jobs that ended, from time to time, until all have.

        After a stop, jobs that have not begun are cancelled and the others have ``_GRACE`` s left.
        A job that takes longer, such as a compilation, which nothing can interrupt, is left to
        itself. Ctrl-C becomes a stop.
        """
        waiting, since = set(jobs), float("inf")
        while waiting and time.monotonic() - since < _GRACE:
            try:
                done, waiting = wait(waiting, timeout=_POLL, return_when=FIRST_COMPLETED)
            except KeyboardInterrupt:
                self.pulled.set()
                continue
            yield {job for job in done if not job.cancelled()}
            if self.on() and since == float("inf"):
                since = time.monotonic()
                for job in waiting:
                    job.cancel()

    def result(self, job: Future[Any]) -> Any:
        """Return the result of a job.

        Raises:
            CutShortError: if a stop came first.
        """
        for _ in self.ended([job]):
            pass
        if not job.done() or job.cancelled():
            raise CutShortError
        return job.result()
