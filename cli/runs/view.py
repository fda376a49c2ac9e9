"""Show a setup in a browser: serve the page until Ctrl-C."""

import os
import sys
import threading
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

from place_rings._validation import ResolvedSetup
from place_rings._views import view as serve

from ...formats.robots.urdf_options import UrdfOptions
from ...reporting.terminal import Terminal, say
from ...viewer.server import LOOPBACK
from ..signals import gone_is_an_error

_PATIENCE = 0.5  # s, time for the server to close its pages


def view(
    subject: ResolvedSetup,
    compare: ResolvedSetup | None,
    urdf: Path | None,
    reading: UrdfOptions,
    out: Path | None,
    host: str,
    port: int,
    browser: bool,
) -> None:
    """Serve the page until Ctrl-C."""
    console = Terminal(stderr=True)
    with console.status("drawing points"):
        page = serve(
            subject,
            compare=compare,
            folder=out,
            urdf=urdf,
            packages=reading.packages,
            package=reading.package,
            host=host,
            port=port,
            browser=False,  # it is opened once its address is printed
            wait=False,
        )
    if host not in (LOOPBACK, "localhost", "::1"):
        console.print(
            f"Warning: anyone who can reach {host} and knows the address below can use this page;"
            " it is not encrypted.",
            highlight=False,
        )
    serve_page(page.url, page.close, browser, console)


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
