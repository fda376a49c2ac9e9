"""Progress of long computations: a bar in a terminal, otherwise lines on stderr."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rich.progress import BarColumn, TaskID, TextColumn, TimeElapsedColumn
from rich.progress import Progress as RichProgress

from .terminal import Terminal, say

EVERY = 10.0  # s, interval between lines on stderr


class ProgressBar(RichProgress):
    """A progress bar with a description and a field ``best``; it disappears when it ends.

    If ``console`` is no terminal there is no bar. Then the first unfinished task is reported on
    stderr every ``EVERY`` seconds, so that the log of a redirected run shows progress.
    """

    def __init__(self, console: Terminal) -> None:
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.fields[best]}", markup=False),
            TimeElapsedColumn(),
        )
        super().__init__(*columns, console=console, transient=True)
        self._plain = not console.is_terminal
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None
        self._began = time.monotonic()

    def add_task(self, description: str, *more: Any, best: str = "", **fields: Any) -> TaskID:
        """Add a task; ``best`` is shown next to its bar."""
        return super().add_task(description, *more, best=best, **fields)

    @property
    def started(self) -> bool:
        """Whether progress is shown."""
        return self._thread is not None if self._plain else self.live.is_started

    def start(self) -> None:
        """Show the bar, or start to report lines."""
        if not self._plain:
            super().start()
        elif self._thread is None:
            self._thread = threading.Thread(target=self._report, daemon=True)
            self._thread.start()

    def stop(self) -> None:
        """Remove the bar, or stop reporting lines."""
        if not self._plain:
            super().stop()
        elif self._thread is not None:
            self._ended.set()
            self._thread.join()
            self._thread = None

    def _report(self) -> None:
        while not self._ended.wait(EVERY):
            if (line := self.line()) is not None:
                say(line, error=True)

    def line(self) -> str | None:
        """Return the progress of the first unfinished task, or None if all are finished."""
        with self._lock:
            task = next((t for t in self.tasks if not t.finished), None)
        if task is None:
            return None
        count = "" if task.total is None else f"{task.completed:g} of {task.total:g}"
        seconds = f"{time.monotonic() - self._began:.0f} s"
        return ", ".join(filter(None, (task.description, count, task.fields["best"], seconds)))


@contextmanager
def late_progress(console: Terminal) -> Iterator[ProgressBar]:
    """Yield a bar that the caller starts when its work begins, so that earlier errors stand alone;
    it disappears at the end."""
    bar = ProgressBar(console)
    try:
        yield bar
    finally:
        if bar.started:
            bar.stop()
