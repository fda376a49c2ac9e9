"""Signals that wait until the robot stands still."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def noted_signals() -> Iterator[list[Callable[[], object]]]:
    """Collect Ctrl-C and other signals that would end a check; the list holds their handlers' calls
    and grows during a motion.

    The handlers run later, because an exception could otherwise interrupt any two steps of stopping
    the robot. A signal at the very end of a motion is handled after it.
    """
    noted, before = list[Callable[[], object]](), dict[signal.Signals, Any]()
    if threading.current_thread() is threading.main_thread():
        for number in _SIGNALS:
            handler = signal.getsignal(number)
            if callable(handler):
                deed = partial(handler, number, None)
                before[number] = signal.signal(number, lambda *_, deed=deed: noted.append(deed))
    try:
        yield noted
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if noted:
        noted[0]()
