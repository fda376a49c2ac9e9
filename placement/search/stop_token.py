"""Stops a search at a deadline or on request."""

import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any


@dataclass
class StopToken:
    """Tells a search to stop, after a deadline or on request."""

    deadline: float
    """Time of the ``clock`` after which to stop, s."""
    pulled: threading.Event = field(default_factory=threading.Event)
    """Set to stop before the deadline."""
    clock: Callable[[], float] = time.monotonic
    """Returns the time in seconds."""

    def on(self) -> bool:
        """Return whether to stop."""
        return self.pulled.is_set() or self.clock() > self.deadline

    def all(
        self, threads: ThreadPoolExecutor, work: Callable[..., Any], *each: Iterable[Any]
    ) -> list[Any]:
        """Return the results of ``work`` for each set of arguments, run by ``threads``.

        Ctrl-C becomes a stop, after which ``work`` should end soon: the results are there, too.
        """
        jobs = [threads.submit(work, *one) for one in zip(*each, strict=False)]
        while True:
            try:
                return [job.result() for job in jobs]
            except KeyboardInterrupt:
                self.pulled.set()
