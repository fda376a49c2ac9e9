"""Requests to the robot's data protocol that ur-rtde does not make, or makes too late: the version
of the protocol, and which of its inputs another client holds.
"""

import struct
from contextlib import suppress

from .controller_line import ControllerLine, UnreadError, controller_line

PORT, VERSION = 30004, 2
# inputs that ur-rtde's control interface takes (version 1.6.5); one client holds an input
INPUTS = (
    *(f"input_int_register_{i}" for i in range(8)),
    *(f"input_double_register_{i}" for i in range(18)),
)
HEAD = struct.Struct(">HB")  # size including this header, kind
_VERSION, _INPUTS = b"VI"
_MOST = 16  # packages before the answer, such as messages of the controller
_IN_USE = "IN_USE"


def refusal(host: str, seconds: float) -> str:
    """Return why the controller refuses version 2 of Real-Time Data Exchange, as one line.

    Empty if it accepts, or if it cannot be reached or does not answer within ``seconds``: then the
    client that connects next tells why.
    """
    with suppress(UnreadError), controller_line(host, PORT, seconds) as line:
        if _accepts(line) is False:
            return f"its controller refuses version {VERSION} of RTDE; update its software"
    return ""


def inputs_in_use(host: str, seconds: float) -> list[str]:
    """Return which of ``INPUTS`` another client of the controller holds. They are taken for a
    moment and nothing is written to them.

    Empty if it cannot be reached or does not answer within ``seconds``: then the client that
    connects next tells why.
    """
    with suppress(UnreadError), controller_line(host, PORT, seconds) as line:
        if _accepts(line):
            answer = _asked(line, _INPUTS, ",".join(INPUTS).encode()) or b""
            kinds = answer[1:].decode(errors="replace").strip(",").split(",")
            return [n for n, kind in zip(INPUTS, kinds, strict=False) if kind == _IN_USE]
    return []


def _accepts(line: ControllerLine) -> bool | None:
    """Return whether the controller accepts the version; None without an answer."""
    answer = _asked(line, _VERSION, struct.pack(">H", VERSION))
    return None if answer is None else answer[:1] == b"\1"


def _asked(line: ControllerLine, kind: int, data: bytes) -> bytes | None:
    """Return the answer to a request; None if there is none among the next packages."""
    line.send(HEAD.pack(HEAD.size + len(data), kind) + data)
    for _ in range(_MOST):
        size, of = HEAD.unpack(line.read(HEAD.size))
        answer = line.read(max(size - HEAD.size, 0))
        if of == kind:
            return answer
    return None
