"""Calibrated kinematics of a controller of Universal Robots, from its primary interface.

A controller sends packages on this port to each client. The first of its states holds what
rtde_receive does not offer: the Denavit-Hartenberg parameters of this arm, in full and not as
differences.
"""

import struct
from collections.abc import Iterator

import numpy as np

from ...coverage.robots.calibration import DhTable
from .controller_line import ControllerLine, UnreadError, controller_line

PORT = 30001
HEAD = struct.Struct(">iB")  # size including this header, kind; of packages and of their parts
STATE, KINEMATICS = 16, 5
INFO = struct.Struct(">6I24dI")  # checksums, theta, a, d, alpha, status of the calibration
_MOST = 1 << 20  # bytes of a package
_MOST_BYTES = 8 << 20  # in all; a controller sends some 100 kB a second
_LINEARISED = 2  # status of a calibration
_FARTHEST = 1e5  # rad or m


def packed(table: DhTable) -> bytes:
    """Return the part of a state package with an arm's kinematics, without its header."""
    return INFO.pack(*range(6), *table.theta, *table.a, *table.d, *table.alpha, _LINEARISED)


def unpacked(data: bytes) -> DhTable:
    """Return the kinematics in the part of a state package, without its header.

    Raises:
        UnreadError: if they cannot be true.
    """
    if len(data) < INFO.size:
        raise UnreadError(f"its kinematics have {len(data)} bytes, not {INFO.size}")
    rows = np.array(INFO.unpack(data[: INFO.size])[6:30]).reshape(4, 6)
    if not (np.abs(rows) <= _FARTHEST).all():
        raise UnreadError("its kinematics are no finite numbers")
    return DhTable(*rows)


def read_kinematics(host: str, seconds: float) -> DhTable:
    """Return the kinematics that the controller at ``host`` states; nothing is sent.

    Args:
        host: name or address.
        seconds: time limit.

    Raises:
        UnreadError: if it cannot be reached, or does not state it in time.
    """
    with controller_line(host, PORT, seconds, "kinematics") as line:
        states = (data for kind, data in _packages(line) if kind == STATE)
        parts = (part for data in states for part in _parts(data))
        return next(unpacked(data) for kind, data in parts if kind == KINEMATICS)


def _packages(line: ControllerLine) -> Iterator[tuple[int, bytes]]:
    left = _MOST_BYTES
    while True:
        size, kind = HEAD.unpack(line.read(HEAD.size))
        if not HEAD.size <= size <= _MOST:
            raise UnreadError(f"port {PORT}: a package of {size} bytes")
        left -= size
        if left < 0:
            raise UnreadError(f"port {PORT}: no kinematics in its first {_MOST_BYTES >> 20} MiB")
        yield kind, line.read(size - HEAD.size)


def _parts(data: bytes) -> Iterator[tuple[int, bytes]]:
    while len(data) >= HEAD.size:
        size, kind = HEAD.unpack_from(data)
        if not HEAD.size <= size <= len(data):
            raise UnreadError(f"port {PORT}: a part of {size} bytes")
        yield kind, data[HEAD.size : size]
        data = data[size:]
