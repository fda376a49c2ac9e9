"""The state of a page behind a lock: callbacks come from several threads."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from .page_state import PageState


class GuardedState:
    """The state of one page, which one thread at a time reads or changes."""

    def __init__(self, state: PageState) -> None:
        self._lock = threading.RLock()
        self.state = state
        """The state; for changes, and for several values of one moment, see ``held``."""

    @contextmanager
    def held(self) -> Iterator[PageState]:
        """Hold the lock, and yield the state."""
        with self._lock:
            yield self.state

    def snapshot(self) -> PageState:
        """Return a copy that later changes leave as it is."""
        with self._lock:
            histories = [history.frozen() for history in self.state.histories]
            return replace(self.state, histories=histories)
