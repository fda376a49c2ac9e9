"""Processes that are talked to and may be gone: an error to handle, not the end of the command."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def gone_is_an_error() -> Iterator[None]:
    """Let a write to a process that is gone raise BrokenPipeError. Elsewhere it ends the command, as one whose reader had
    enough should end (``place-rings cones … | head``)."""
    before = signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGPIPE, before)
