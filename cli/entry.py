"""Entry point of the command. It imports the rest itself, because that takes a second and the user
may press Ctrl-C meanwhile.
"""

import _thread
import atexit
import gc
import os
import signal
import sys
import threading
from typing import Any, NoReturn

# objects made between two runs of the garbage collector, 700 by default: what is imported stays, so
# looking through it again and again takes up to a fifth of a short command's time. A command that
# loads no JAX makes fewer.
_GARBAGE = 200_000
_SOON = 0.02  # s until Ctrl-C is raised again; the callback that lost it has ended by then


def main() -> None:
    """Run the command line."""
    gc.set_threshold(_GARBAGE, *gc.get_threshold()[1:])
    atexit.register(_end_soon)
    sys.unraisablehook = never_lost
    # XLA reports a slow compilation as an error, which says nothing to the user
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    by_default = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    try:
        if by_default:
            # an exception during the import of a library can crash it
            signal.signal(signal.SIGINT, _nothing_to_keep)
        from ..reporting.terminal import guard
        from .app import main as run

        guard()

        if by_default:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        run()
    except KeyboardInterrupt:
        _nothing_to_keep()


def _end_soon() -> None:
    """Spare the collector's last runs, which would take a tenth of a short command's time and free
    nothing that the process needs; but manifold3d reports each of its solids that is not freed."""
    if "manifold3d" not in sys.modules:
        gc.freeze()


def never_lost(dropped: Any) -> None:
    """Raise Ctrl-C again if Python drops it; a ``sys.unraisablehook``.

    Python drops every exception in a callback of the garbage collector. JAX has such a callback, in
    which a search spends a tenth of its first seconds.
    """
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
