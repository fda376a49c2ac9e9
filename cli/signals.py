"""Signals of the operating system that a check turns into errors, so that it ends in order."""

import os
import signal
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn


@contextmanager
def gone_is_an_error() -> Iterator[None]:
    """Let a write to a process that is gone raise BrokenPipeError. Elsewhere it ends the command,
    as one whose reader had enough should end (``place-rings cones … | head``)."""
    before = signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGPIPE, before)


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """Let SIGTERM and SIGHUP end what runs as Ctrl-C does, where nobody has decided otherwise (as
    ``nohup`` does).
    """
    heeded = [n for n in (signal.SIGTERM, signal.SIGHUP) if signal.getsignal(n) is signal.SIG_DFL]
    for number in heeded:
        signal.signal(number, _end)
    try:
        yield
    finally:
        for number in heeded:
            signal.signal(number, signal.SIG_DFL)


def _end(number: int, frame: Any) -> NoReturn:
    if number == signal.SIGHUP:
        _let_go_of_the_terminal()
    raise KeyboardInterrupt(f"ended by {signal.Signals(number).name}")


def _let_go_of_the_terminal() -> None:
    """Write to nowhere what would go to a terminal that is gone: every write to it would fail."""
    for standard in range(3):
        if os.isatty(standard):
            continue  # it is still there
        with suppress(OSError):
            if stat.S_ISCHR(os.fstat(standard).st_mode):
                nowhere = os.open(os.devnull, os.O_RDWR)
                os.dup2(nowhere, standard)
                os.close(nowhere)
