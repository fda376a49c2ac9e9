"""Signals of the operating system that a check turns into errors, so that it ends properly."""

import os
import signal
import stat
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn

from ..reporting.terminal import Terminal, say


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


_PATIENCE = 0.5  # s, time for the server to close its pages


def serve_page(url: str, close: Callable[[], None], browser: bool, console: Terminal) -> NoReturn:
    """Serve a page until Ctrl-C, then end the process; a browser that goes away does not end it."""
    with gone_is_an_error():
        try:
            say(f"{url}  (press Ctrl-C to stop)")
            if browser:
                webbrowser.open(url)
            threading.Event().wait()
        except KeyboardInterrupt:
            pass
        finally:
            ending = threading.Thread(target=close, daemon=True)
            ending.start()
            ending.join(_PATIENCE)
            console.print("closed")
            sys.stdout.flush()
            # running tasks have nothing to save: a proposal is written completely or not at all
            os._exit(0)
