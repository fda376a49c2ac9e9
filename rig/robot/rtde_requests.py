"""Negotiate the version of the robot's data protocol, which ur-rtde does not check."""

import socket
import struct
from contextlib import suppress

PORT, VERSION = 30004, 2
_HEAD = struct.Struct(">HB")  # size including this header, kind
_REQUEST = ord("V")
_MOST = 16  # packages before the answer, such as messages of the controller


def refusal(host: str, seconds: float) -> str:
    """Return why the controller refuses version 2 of Real-Time Data Exchange, as one line.

    Empty if it accepts, or if it cannot be reached or does not answer within ``seconds``: then the
    client that connects next tells why.
    """
    with suppress(OSError), socket.create_connection((host, PORT), seconds) as line:
        line.settimeout(seconds)
        line.sendall(_HEAD.pack(_HEAD.size + 2, _REQUEST) + struct.pack(">H", VERSION))
        for _ in range(_MOST):
            size, kind = _HEAD.unpack(_read(line, _HEAD.size))
            data = _read(line, max(size - _HEAD.size, 0))
            if kind == _REQUEST:
                return (
                    ""
                    if data[:1] == b"\1"
                    else f"its controller refuses version {VERSION} of RTDE; update its software"
                )
    return ""


def _read(line: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        if not (piece := line.recv(size - len(data))):
            raise ConnectionError("closed")
        data += piece
    return data
