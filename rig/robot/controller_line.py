"""A connection to a controller, with one time limit for all, however slowly its bytes come."""

import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager


class UnreadError(Exception):
    """Raised if a controller does not state what it is asked for; the text says why."""


class ControllerLine:
    """A connection.

    Args:
        line: the connection.
        until: time at which to give up, s of the host's monotonic clock.
        wanted: what is asked for, for the error.
    """

    def __init__(self, line: socket.socket, until: float, wanted: str) -> None:
        self._line, self._until, self._wanted = line, until, wanted
        self.send = line.sendall

    def read(self, size: int) -> bytes:
        """Return the next ``size`` bytes.

        Raises:
            TimeoutError: if they are not there in time.
            ConnectionError: if the other side closes before.
        """
        data = bytearray()
        while len(data) < size:
            if (left := self._until - time.monotonic()) <= 0:
                raise TimeoutError("timed out")
            self._line.settimeout(left)
            if not (piece := self._line.recv(size - len(data))):
                raise ConnectionError(f"closed before its {self._wanted}")
            data += piece
        return bytes(data)


@contextmanager
def controller_line(
    host: str, port: int, seconds: float, wanted: str = "answer"
) -> Iterator[ControllerLine]:
    """Connect to the controller at ``host``, a name or an address, for at most ``seconds``.

    Raises:
        UnreadError: if it cannot be reached, or the block does not read what it wants.
    """
    until = time.monotonic() + seconds
    try:
        with socket.create_connection((host, port), seconds) as line:
            yield ControllerLine(line, until, wanted)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error) or "no answer"
        raise UnreadError(f"port {port}: {reason}") from error
