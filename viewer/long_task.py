"""Long tasks of pages in threads, one at a time: each can be stopped, and shows its progress and
its end in a line on its page."""

import threading
import time
from collections.abc import Callable
from functools import partial

from ..coverage.definitions.errors import UserError
from . import html as words
from .browser import set_value
from .controls import Controls

_WAITING = 0.2  # s, interval at which a waiting job checks whether it is stopped
_OFTEN = 0.1  # s, shortest interval between progress messages of a job


class JobStoppedError(Exception):
    """Raised in a job's thread after a request to stop."""


class Job:
    """A task in its own thread. All jobs share ``turn``: the job that holds it works, the
    others wait.
    """

    def __init__(
        self,
        work: Callable[["Job"], None],
        turn: threading.Lock,
        tell: Callable[[str, float], None],
    ) -> None:
        """Start the job.

        Args:
            work: receives this job and calls its ``tell`` from time to time.
            turn: lock that all jobs share.
            tell: receives progress from the job's thread: a text and the completed share.
        """
        self._work, self._turn, self._tell = work, turn, tell
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True, name="place-rings job")
        self._thread.start()

    def stop(self) -> None:
        """Request the job to stop."""
        self._stop.set()

    @property
    def stopped(self) -> bool:
        """Whether the job was requested to stop."""
        return self._stop.is_set()

    @property
    def running(self) -> bool:
        """Whether the job has not ended yet."""
        return self._thread.is_alive()

    def join(self, seconds: float) -> None:
        """Wait at most ``seconds`` for the end of the job."""
        self._thread.join(seconds)

    def tell(self, what: str, over: float) -> None:
        """Report progress.

        Args:
            what: the current step.
            over: completed share in [0, 1].

        Raises:
            JobStoppedError: if the job was requested to stop.
        """
        if self.stopped:
            raise JobStoppedError
        self._tell(what, over)

    def note(self, what: str, over: float) -> None:
        """Report progress of work that checks ``stopped`` itself."""
        self._tell(what, over)

    def _run(self) -> None:
        while not self._turn.acquire(timeout=_WAITING):
            if self.stopped:
                return
            self._tell("waiting for a task of another page", 0.0)
        try:
            self._work(self)
        finally:
            self._turn.release()


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
