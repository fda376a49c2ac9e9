"""The model of the arm, as the controller's dashboard server states it."""

import re
import socket
import time

from .timed_read import read_exactly

PORT = 29999
_MOST = 1 << 12  # bytes of an answer
_MODEL = re.compile(r"UR(3|5|7|8|10|12|15|16|18|20|30)(e?)", re.IGNORECASE)
_VERSION = re.compile(r"(\d+)\.\d+")
_E_SERIES = ("3", "5", "10", "16")  # sold with and without e; the dashboard leaves the e out
_FIRST_E = 5  # major version of the software of the first e-Series


class ModelUnreadError(Exception):
    """Raised if a controller does not state its model; the text says why."""


def read_model(host: str, seconds: float) -> str:
    """Return the model that the controller at ``host`` states, like ``ur10`` or ``ur10e``.

    Args:
        host: name or address.
        seconds: time limit.

    Raises:
        ModelUnreadError: if it cannot be reached, or does not state it in time.
    """
    until = time.monotonic() + seconds
    try:
        with socket.create_connection((host, PORT), seconds) as line:
            _line(line, until)  # the greeting
            model, version = (
                _asked(line, until, q) for q in ("get robot model", "PolyscopeVersion")
            )
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error) or "no answer"
        raise ModelUnreadError(f"port {PORT}: {reason}") from error
    known, software = _MODEL.fullmatch(model), _VERSION.search(version)
    if known is None or software is None:
        raise ModelUnreadError(f"port {PORT}: found {model[:40]!r} for the robot's model")
    later = known[1] in _E_SERIES and int(software[1]) >= _FIRST_E
    return f"ur{known[1]}{'e' if later or known[2] else ''}"


def _asked(line: socket.socket, until: float, question: str) -> str:
    line.sendall(f"{question}\n".encode())
    return _line(line, until)


def _line(line: socket.socket, until: float) -> str:
    data = b""
    while not data.endswith(b"\n"):
        if len(data) >= _MOST:
            raise TimeoutError("no answer in time")
        data += read_exactly(line, 1, until)
    return data.decode(errors="replace").strip()
