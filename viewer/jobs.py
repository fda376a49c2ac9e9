"""Long work of pages in threads of their own: one at a time, as each takes all processors; each can
be stopped.
"""

import threading
from collections.abc import Callable

_OFTEN = 0.2  # s, between looks at whether a waiting job is stopped


class JobStoppedError(Exception):
    """Raised in a job's thread where it was asked to stop."""


class Job:
    """Work in a thread of its own. ``turn`` is shared by all jobs: the one that holds it works, the
    others wait.
    """

    def __init__(
        self,
        work: Callable[["Job"], None],
        turn: threading.Lock,
        tell: Callable[[str, float], None],
    ) -> None:
        """Begin. ``work`` is given this job, and calls its ``tell`` from time to time; so is
        ``tell``, from its thread.
        """
        self._work, self._turn, self._tell = work, turn, tell
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True, name="place-rings job")
        self._thread.start()

    def stop(self) -> None:
        """Ask the work to end."""
        self._stop.set()

    @property
    def stopped(self) -> bool:
        """Was it asked to end?"""
        return self._stop.is_set()

    @property
    def running(self) -> bool:
        """Is there still something to do?"""
        return self._thread.is_alive()

    def join(self, seconds: float) -> None:
        """Wait for its end, so long at most."""
        self._thread.join(seconds)

    def tell(self, what: str, over: float) -> None:
        """Say what is being done and how much of it is over; JobStoppedError where it was asked to
        end.
        """
        if self.stopped:
            raise JobStoppedError
        self._tell(what, over)

    def note(self, what: str, over: float) -> None:
        """Say so where the work ends by itself when it is stopped."""
        self._tell(what, over)

    def _run(self) -> None:
        while not self._turn.acquire(timeout=_OFTEN):
            if self.stopped:
                return
            self._tell("waiting for the work of another page", 0.0)
        try:
            self._work(self)
        finally:
            self._turn.release()
