"""The viewer's server: local by default, for its own page only, until Ctrl-C."""

import contextlib
import io
import ipaddress
import os
import re
import socket
import threading
import warnings
from collections.abc import Sequence
from functools import partial

import viser

from ..coverage.definitions.errors import UserError, shown
from .browser import closing, keep_awake
from .camera import FOV
from .connection_guard import ConnectionGuard, guarding
from .motion_page import MotionPage, MotionSession
from .options import LOOPBACK
from .page import Page
from .session import ViewerSession

_HOST = re.compile(r"([a-z0-9.-]+|\[[0-9a-f:.]+\])(:[0-9]{1,5})?", re.IGNORECASE)


def own(hosts: Sequence[str], origins: Sequence[str], given: str) -> bool:
    """Return whether a connection with these headers ``Host`` and ``Origin`` may be served.

    Only the viewer's own page is served, requested by a numeric address, as localhost, or as the
    host ``given``; of a server that listens on this machine only, the address must be local, too.
    Otherwise any web site could reach the viewer through the user's browser by another name for
    this machine.
    """
    if len(hosts) != 1 or len(origins) > 1:
        return False
    asked, host = hosts[0].lower(), _HOST.fullmatch(hosts[0].lower())
    if host is None or any(
        origin.lower() not in (f"http://{asked}", f"https://{asked}") for origin in origins
    ):
        return False
    try:
        address = ipaddress.ip_address(host[1].strip("[]"))
    except ValueError:
        return host[1] in ("localhost", given.lower())
    return address.is_loopback or not _local(given)


def _local(host: str) -> bool:
    """Return whether a server on ``host`` can be reached from this machine only."""
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def _check_address(host: str, port: int) -> None:
    """Raise UserError if the address cannot be served.

    The server itself would silently try other ports.
    """
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        with socket.socket(found[0][0], socket.SOCK_STREAM) as trial:
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            trial.bind(found[0][4])
    except (OSError, OverflowError, UnicodeError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise UserError(
            f"--host {shown(host)}, --port {port}: the page cannot be served there ({why}); give"
            " an address of this machine and a free port"
        ) from error


class Server:
    """Serves the pages of a session; a context manager that stops everything at its end."""

    def __init__(
        self,
        room: ViewerSession | MotionSession,
        host: str = LOOPBACK,
        port: int = 0,
    ) -> None:
        """Start to serve.

        Args:
            room: session to serve: setups to edit, or a motion to play.
            host: address to listen on.
            port: port to listen on; 0 for any free port.

        Raises:
            UserError: if the address cannot be served.
        """
        _check_address(host, port)
        os.environ.pop("_VISER_PORT_OVERRIDE", None)
        self.room, self._host = room, host
        self._pages: dict[int, Page | MotionPage] = {}
        self._lock, self._closed = threading.Lock(), False
        guard = ConnectionGuard(partial(own, given=host))
        self._token = guard.token
        # what is drawn for a browser that has just left needs no word in the terminal
        warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)
        with guarding(guard), contextlib.redirect_stdout(io.StringIO()):
            self._server = viser.ViserServer(host, port, label="place-rings", verbose=False)
        if port and self._server.get_port() != port:
            self._server.stop()
            raise UserError(
                f"--port: found {port}, which is taken, allowed: a free port, or 0 for any"
            )
        self._server.gui.configure_theme(
            control_width="large", show_logo=False, show_share_button=False
        )
        self._server.gui.main_panel.dock_right()
        camera = self._server.initial_camera
        position, look_at = room.start_view()
        camera.position, camera.look_at, camera.fov = tuple(position), tuple(look_at), FOV
        self._server.on_client_connect(self._came)
        self._server.on_client_disconnect(self._went)

    @property
    def port(self) -> int:
        """Port of the server."""
        return self._server.get_port()

    @property
    def url(self) -> str:
        """Address to open in a browser on this machine; without its token the server is closed."""
        host = {"0.0.0.0": LOOPBACK, "": LOOPBACK, "::": "[::1]"}.get(self._host, self._host)
        host = f"[{host}]" if ":" in host and host[0] != "[" else host
        return f"http://{host}:{self.port}/{self._token}"

    @property
    def pages(self) -> int:
        """Number of open pages."""
        return len(self._pages)

    def _came(self, client: viser.ClientHandle) -> None:
        keep_awake(client)
        room = self.room
        with closing():
            page = (
                MotionPage(client, room) if isinstance(room, MotionSession) else Page(client, room)
            )
            with self._lock:
                if not self._closed and client.client_id in self._server.get_clients():
                    self._pages[client.client_id] = page
                    return
            page.close()

    def _went(self, client: viser.ClientHandle) -> None:
        with self._lock:
            page = self._pages.pop(client.client_id, None)
        if page is not None:
            page.close()

    def __enter__(self) -> "Server":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop everything."""
        with self._lock:
            self._closed, pages = True, list(self._pages.values())
        for page in pages:
            page.close()
        with contextlib.redirect_stdout(io.StringIO()):
            self._server.stop()
