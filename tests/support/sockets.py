"""Servers of one client, for clients of a controller."""

import socket
from contextlib import suppress
from threading import Thread


def serve_once(talk, address="127.0.0.1", port=0):
    """Serve the first client by ``talk(line)`` in a thread of its own; return the port."""
    server = socket.create_server((address, port))

    def serve():
        with server:
            line, _ = server.accept()
            with line, suppress(OSError):
                talk(line)

    port = server.getsockname()[1]
    Thread(target=serve, daemon=True).start()
    return port
