"""The long task of a page: one job at a time, its progress, and its end in a line on the page."""

import threading
import time
from collections.abc import Callable
from functools import partial

from ..formats.errors import UserError
from . import html as words
from .control_values import set_value
from .controls import Controls
from .jobs import Job, JobStoppedError

_OFTEN = 0.1  # s, shortest interval between progress messages of a job


class LongTask:
    """The job of one page, or none.

    Args:
        controls: of the page, which show messages and progress.
        turn: lock that the jobs of all pages share.
    """

    def __init__(self, controls: Controls, turn: threading.Lock) -> None:
        self._controls, self._turn = controls, turn
        self._lock = threading.Lock()
        self._job: Job | None = None
        self._closed, self._told = False, 0.0

    def start(self, work: Callable[[Job], None]) -> None:
        """Start a job.

        Raises:
            ValueError: if a job of this page is running.
        """
        with self._lock:
            if self._job is not None and self._job.running:
                raise ValueError("a task is running: stop it first")
            self._controls.working(True)
            self._job = Job(partial(self._guarded, work), self._turn, self._progress)

    def stop(self) -> None:
        """Request the running job to stop."""
        if self._job is not None and self._job.running:
            self._job.stop()
            self.note("stopping …")

    def note(self, text: str, bad: bool = False) -> None:
        """Show a message on the page."""
        if not self._closed:  # nobody reads messages after that
            self._controls.said.content = words.note(text, bad)

    def close(self) -> None:
        """Stop the running job, as nobody looks at the page any more."""
        self._closed = True
        if self._job is not None:
            self._job.stop()

    def _guarded(self, work: Callable[[Job], None], job: Job) -> None:
        try:
            work(job)
        except JobStoppedError:
            self.note("stopped")
        except (ValueError, UserError) as error:
            self.note(str(error), True)
        except MemoryError:
            self.note("not enough memory for this count", True)
        finally:
            if not self._closed:
                self._controls.working(False)

    def _progress(self, what: str, over: float) -> None:
        if (now := time.monotonic()) - self._told > _OFTEN and not self._closed:
            self._told = now
            self.note(what + " …")
            set_value(self._controls.progress, min(max(100 * over, 0.0), 100.0))
