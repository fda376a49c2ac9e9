"""Long tasks of pages in threads, one at a time; each can be stopped."""

import threading
from collections.abc import Callable

_OFTEN = 0.2  # s, interval at which a waiting job checks whether it is stopped


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
        while not self._turn.acquire(timeout=_OFTEN):
            if self.stopped:
                return
            self._tell("waiting for a task of another page", 0.0)
        try:
            self._work(self)
        finally:
            self._turn.release()
