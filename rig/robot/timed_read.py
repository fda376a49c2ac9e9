"""Reading from a controller within one time limit for all, however slowly its bytes come."""

import socket
import time


def read_exactly(line: socket.socket, size: int, until: float, wanted: str = "answer") -> bytes:
    """Return the next ``size`` bytes of a connection.

    Args:
        line: the connection.
        size: number of bytes.
        until: time at which to give up, s of the host's monotonic clock.
        wanted: what the bytes belong to, for the error.

    Raises:
        TimeoutError: if they are not there in time.
        ConnectionError: if the other side closes before.
    """
    data = bytearray()
    while len(data) < size:
        if (left := until - time.monotonic()) <= 0:
            raise TimeoutError("timed out")
        line.settimeout(left)
        if not (piece := line.recv(size - len(data))):
            raise ConnectionError(f"closed before its {wanted}")
        data += piece
    return bytes(data)
