"""Signals of the operating system that a check turns into errors, so that it ends properly."""

import os
import signal
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn


@contextmanager
def gone_is_an_error() -> Iterator[None]:
    """Let a write to a process that has ended raise BrokenPipeError.

    Otherwise such a write ends the command, as it should in ``place-rings cones … | head``.
    """
    before = signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGPIPE, before)


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """Let SIGTERM and SIGHUP act like Ctrl-C, unless they are ignored already (as by ``nohup``)."""
    by_default = [
        n for n in (signal.SIGTERM, signal.SIGHUP) if signal.getsignal(n) is signal.SIG_DFL
    ]
    for number in by_default:
        signal.signal(number, _end)
    try:
        yield
    finally:
        for number in by_default:
            signal.signal(number, signal.SIG_DFL)


def _end(number: int, frame: Any) -> NoReturn:
    if number == signal.SIGHUP:
        _let_go_of_the_terminal()
    raise KeyboardInterrupt(f"ended by {signal.Signals(number).name}")


def _let_go_of_the_terminal() -> None:
    """Redirect the output for a closed terminal to the null device; writes to it would fail."""
    for standard in range(3):
        if os.isatty(standard):
            continue  # the terminal is still open
        with suppress(OSError):
            if stat.S_ISCHR(os.fstat(standard).st_mode):
                nowhere = os.open(os.devnull, os.O_RDWR)
                os.dup2(nowhere, standard)
                os.close(nowhere)
