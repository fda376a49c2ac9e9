"""The model of the arm, as the controller's dashboard server states it."""

import re

from .controller_line import ControllerLine, UnreadError, controller_line

PORT = 29999
_MOST = 1 << 12  # bytes of an answer
_MODEL = re.compile(r"UR(3|5|7|8|10|12|15|16|18|20|30)(e?)", re.IGNORECASE)
_VERSION = re.compile(r"(\d+)\.\d+")
_E_SERIES = ("3", "5", "10", "16")  # sold with and without e; the dashboard leaves the e out
_FIRST_E = 5  # major version of the software of the first e-Series


def read_model(host: str, seconds: float) -> str:
    """Return the model that the controller at ``host`` states, like ``ur10`` or ``ur10e``.

    Args:
        host: name or address.
        seconds: time limit.

    Raises:
        UnreadError: if it cannot be reached, or does not state it in time.
    """
    with controller_line(host, PORT, seconds) as line:
        _answer(line)  # the greeting
        model, version = (_answer(line, q) for q in ("get robot model", "PolyscopeVersion"))
    known, software = _MODEL.fullmatch(model), _VERSION.search(version)
    if known is None or software is None:
        raise UnreadError(f"port {PORT}: found {model[:40]!r} for the robot's model")
    later = known[1] in _E_SERIES and int(software[1]) >= _FIRST_E
    return f"ur{known[1]}{'e' if later or known[2] else ''}"


def _answer(line: ControllerLine, question: str = "") -> str:
    if question:
        line.send(f"{question}\n".encode())
    data = b""
    while not data.endswith(b"\n"):
        if len(data) >= _MOST:
            raise TimeoutError("no answer in time")
        data += line.read(1)
    return data.decode(errors="replace").strip()
