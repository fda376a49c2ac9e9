"""Serve a page in a browser until Ctrl-C."""

import os
import sys
import threading
import webbrowser
from collections.abc import Callable
from typing import NoReturn

from ..reporting.terminal import Terminal, say
from .signals import gone_is_an_error

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
