"""One thread of a page, for what must be done in order."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from typing import Any

from viser._threadpool_exceptions import print_threadpool_errors


class Worker:
    """Does one thing after the other, in a thread of its own, until it is closed."""

    def __init__(self, name: str) -> None:
        """``name``: of the thread."""
        self._pool = ThreadPoolExecutor(1, thread_name_prefix=f"place-rings {name}")

    def do(self, act: Callable[..., object], *args: Any) -> None:
        """Call ``act`` with these arguments after all that came before; return at once.

        An exception is printed, and does not stop what comes later.
        """
        with suppress(RuntimeError):  # closed
            self._pool.submit(act, *args).add_done_callback(_report)

    def close(self) -> None:
        """Drop what has not begun, and take nothing any more."""
        self._pool.shutdown(wait=False, cancel_futures=True)


def _report(done: Future[object]) -> None:
    if not done.cancelled():
        print_threadpool_errors(done)
