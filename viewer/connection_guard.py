"""Which connections the viewer accepts, and which messages of a browser.

viser offers no hook for this. It starts its server with ``websockets``' ``serve``, whose hooks do
what is needed; ``guarding`` adds them to that one call.
"""

import asyncio
import hmac
import logging
import secrets
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from http import HTTPStatus
from typing import Any, Final

import msgspec
import viser
import websockets.asyncio.server as websockets_server
from viser import _messages
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

_ACCEPTED: Final = {
    kind.__name__: kind
    for kind in (
        _messages.ViewerCameraMessage,
        _messages.GuiUpdateMessage,
        _messages.CommandTriggerMessage,
        _messages.SceneNodeClickMessage,
        _messages.TransformControlsDragStartMessage,
        _messages.TransformControlsUpdateMessage,
        _messages.TransformControlsDragEndMessage,
        _messages.GetRenderResponseMessage,
        _messages.LocalStorageGetItemResponseMessage,
    )
}
_LARGEST_PICTURE = 16 * 2**20  # bytes; a noisy picture of 3840 × 2160 pixels takes less
_LONGEST_MESSAGE = 32 * 2**10  # bytes of any other message; an address may have 20 000 characters
_MESSAGES_PER_S, _BURST = 200.0, 400.0  # a page sends at most about 50 per second
_MOST_WAITING = 32  # connections without an answered request
_LONGEST_REQUEST = 32 * 2**10  # bytes
_MOST_PAGES = 32
_OPEN_TIMEOUT = 5.0  # s for a request
_CONTENT = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob:;"
    " style-src 'unsafe-inline'; img-src data: blob:; media-src data: blob:; font-src data:;"
    " worker-src data: blob:; connect-src 'self'{sockets} data: blob:;"
    " base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_one_at_a_time = threading.Lock()


class _Kind(msgspec.Struct):
    type: str


class ConnectionGuard:
    """Accepts connections of the viewer's own page that know the token of its address."""

    def __init__(self, own: Callable[[list[str], list[str]], bool]) -> None:
        """``own``: whether headers ``Host`` and ``Origin`` are those of the viewer's own page."""
        self.token = secrets.token_urlsafe(16)
        self._own = own
        self._waiting: dict[ServerConnection, None] = {}
        self._pages: set[ServerConnection] = set()

    def came(self, connection: ServerConnection) -> None:
        """Note a new connection; the oldest that still owes its request gives way."""
        self._waiting[connection] = None
        if len(self._waiting) > _MOST_WAITING:
            oldest = next(iter(self._waiting))
            del self._waiting[oldest]
            oldest.transport.abort()

    def went(self, connection: ServerConnection) -> None:
        """Forget a closed connection."""
        self._waiting.pop(connection, None)
        self._pages.discard(connection)

    def answer(
        self,
        serve_file: Callable[[ServerConnection, Request], Response | None],
        connection: ServerConnection,
        request: Request,
    ) -> Response | None:
        """Return the response to a request; None opens a websocket.

        Args:
            serve_file: viser's own answer to a request whose path has no token.
            connection: its connection.
            request: the request.
        """
        self._waiting.pop(connection, None)
        headers = request.headers
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        token, _, path = request.path.partition("?")[0].removeprefix("/").partition("/")
        known = hmac.compare_digest(token.encode("utf-8", "surrogateescape"), self.token.encode())
        sockets = ""
        response: Response | None
        if not self._own(hosts, origins) or not known:
            response = connection.respond(HTTPStatus.FORBIDDEN, "Open the address as printed.\n")
        elif len(self._pages) >= _MOST_PAGES:
            response = connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "Too many pages.\n")
        else:
            sockets = f" ws://{hosts[0]} wss://{hosts[0]}"
            response = serve_file(connection, replace(request, path=f"/{path}"))
            if response is None:
                self._pages.add(connection)
                return None
        for name, value in _safety_headers(sockets).items():
            response.headers[name] = value
        return response


def _safety_headers(sockets: str) -> dict[str, str]:
    """Return headers that keep a page to itself: no frame, no copy, nothing from elsewhere but
    the ``sockets``."""
    return {
        "Content-Security-Policy": _CONTENT.format(sockets=sockets),
        "X-Frame-Options": "DENY",
        "X-Content-Type-Options": "nosniff",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Referrer-Policy": "no-referrer",
        "Cache-Control": "no-store",
    }


class _GuardedConnection(ServerConnection):
    """A connection that passes on known messages only, and no flood of them."""

    def __init__(self, guard: ConnectionGuard, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._guard, self._due, self._asked = guard, 0.0, 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._guard.came(self)

    def data_received(self, data: bytes) -> None:
        if self.request is None:
            self._asked += len(data)
            if self._asked > _LONGEST_REQUEST:
                self.transport.abort()
                return
        super().data_received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._guard.went(self)
        super().connection_lost(exc)

    async def recv(self, decode: bool | None = None) -> Any:
        """Return the next acceptable message; all others are dropped."""
        while True:
            data = await super().recv(decode)
            now = self.loop.time()
            self._due = max(self._due, now - _BURST / _MESSAGES_PER_S) + 1 / _MESSAGES_PER_S
            if self._due > now:
                await asyncio.sleep(self._due - now)
            if acceptable(data):
                return data


def acceptable(data: str | bytes) -> bool:
    """Return whether viser may read a message: of a known kind, as long as one, and well formed.

    Of a control, a browser may change the value only.
    """
    if not isinstance(data, bytes):
        return False
    try:
        kind = _ACCEPTED[msgspec.msgpack.decode(data, type=_Kind).type]
        if len(data) > _LONGEST_MESSAGE and kind is not _messages.GetRenderResponseMessage:
            return False
        message = msgspec.msgpack.decode(data, type=kind)
    except (msgspec.MsgspecError, KeyError, RecursionError):
        return False
    return not isinstance(message, _messages.GuiUpdateMessage) or message.updates.keys() <= {
        "value"
    }


@contextmanager
def guarding(guard: ConnectionGuard) -> Iterator[None]:
    """Let a guard watch over the server that viser starts in the body.

    Raises:
        RuntimeError: if viser starts its server in another way; it has no guard.
    """
    serve, found = websockets_server.serve, []

    def guarded(handler: Any, *args: Any, **kwargs: Any) -> Any:
        if handler.__module__ != "viser.infra._infra":  # someone else's server
            return serve(handler, *args, **kwargs)
        found.append(handler)
        kwargs["process_request"] = partial(guard.answer, kwargs["process_request"])
        create = partial(_GuardedConnection, guard)
        limits = {
            "max_size": _LARGEST_PICTURE,
            "max_queue": 1,
            "open_timeout": _OPEN_TIMEOUT,
        }
        return serve(
            handler,
            *args,
            **kwargs | limits,
            logger=_logger(),
            server_header=None,
            create_connection=create,  # type: ignore[arg-type]  # documented: a wrapper may be given
        )

    with _one_at_a_time:
        try:
            websockets_server.serve = guarded  # type: ignore[assignment,misc]
            yield
        finally:
            websockets_server.serve = serve  # type: ignore[misc]
    if not found:
        raise RuntimeError(f"viser {viser.__version__} starts its server in an unknown way")


def _logger() -> logging.Logger:
    """Return a logger that is silent about clients that send no proper request."""
    logger = logging.getLogger("websockets.server").getChild("place_rings")
    if not logger.filters:
        logger.addFilter(lambda record: record.getMessage() != "opening handshake failed")
    return logger
