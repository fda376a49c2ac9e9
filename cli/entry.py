"""Where the command starts: the rest is imported under guard, as that takes a second and Ctrl-C may
come before.
"""

import _thread
import gc
import os
import signal
import sys
import threading
from typing import Any, NoReturn

# objects made between two runs of the garbage collector, 700 by default: what is imported stays, so
# looking through it again and again takes up to a fifth of a short command's time
_GARBAGE = 50_000
_SOON = 0.02  # s, until Ctrl-C is raised again: by then the callback that it was lost in is over


def main() -> None:
    """Run the command line."""
    gc.set_threshold(_GARBAGE, *gc.get_threshold()[1:])
    sys.unraisablehook = never_lost
    # XLA reports a slow compilation as an error, which says nothing to the user
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    heeded = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    try:
        if heeded:
            # an exception through a half imported library can crash it
            signal.signal(signal.SIGINT, _nothing_to_keep)
        from ..reporting.terminal import guard
        from .app import main as run

        guard()

        if heeded:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        run()
    except KeyboardInterrupt:
        _nothing_to_keep()


def never_lost(dropped: Any) -> None:
    """Raise Ctrl-C again where Python drops it, as it does with all that is raised in a callback of
    the garbage collector (JAX has one, and in it a search spends a tenth of its first seconds); a
    ``sys.unraisablehook``."""
    if isinstance(dropped.exc_value, KeyboardInterrupt):
        again = threading.Timer(_SOON, _thread.interrupt_main)
        again.daemon = True
        again.start()
    else:
        sys.__unraisablehook__(dropped)


def _nothing_to_keep(*_: object) -> NoReturn:
    sys.stderr.write("place-rings: interrupted before there was anything to keep\n")
    sys.stderr.flush()
    os._exit(130)


if __name__ == "__main__":
    main()
