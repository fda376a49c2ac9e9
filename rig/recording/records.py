"""Records: the units of a recording, and the messages between the processes of the rig. They are
bytes with a checksum, not pickles.
"""

import math
import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum

MAGIC = b"PR"
MOST_BYTES = 1 << 20  # of one record's data
MOST_TIME = 1e11  # s; no monotonic clock runs that long
_HEAD = struct.Struct("<2sBBId")  # magic, kind, source, bytes of data, time
_CHECK = struct.Struct("<I")


class Kind(IntEnum):
    """Content of a record."""

    ABOUT = 1  # JSON: description of the recorded check
    STATE = 2  # of the robot: ``state.State``
    BYTES = 3  # of a ring's line, as received
    EVENT = 4  # JSON: a fault, a step of the check, an answer of a person
    NOTE = 5  # a line of text
    MOVE = 6  # struct of doubles: joints, speed, acceleration
    STOP = 7
    DONE = 8
    CLOSED = 9  # the robot closed the connection
    OPENED = 10  # a ring's port was opened
    HAPPENED = 11  # JSON: ``health.Event``
    END = 12  # of a recording
    ALIVE = 13  # a sign of life


class DamagedError(Exception):
    """The following bytes are not a record."""


@dataclass(frozen=True)
class Record:
    """One record."""

    kind: Kind
    """Content of the data."""
    source: int
    """Number of the ring; 0 if there is only one source."""
    time: float
    """s of the host's monotonic clock."""
    data: bytes = b""
    """Payload."""

    def pack(self) -> bytes:
        """Encode the record: a header with its length, its data, and a CRC-32 (as in
        zlib) of both.
        """
        if len(self.data) > MOST_BYTES:
            raise ValueError(f"a record of {len(self.data)} bytes, allowed: {MOST_BYTES}")
        body = _HEAD.pack(MAGIC, self.kind, self.source, len(self.data), self.time) + self.data
        return body + _CHECK.pack(zlib.crc32(body))


class RecordReader:
    """Decodes records from a stream of bytes. ``left`` is the number of bytes not yet part of a
    record.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()

    @property
    def left(self) -> int:
        return len(self._buffer)

    def feed(self, data: bytes) -> list[Record]:
        """Return the records that ``data`` completes. Damage is raised by the next call, after the
        records before it have been returned.

        Raises:
            DamagedError: if the next bytes cannot be a record.
        """
        self._buffer += data
        found, at = list[Record](), 0
        try:
            while (record := self._next(at)) is not None:
                found.append(record)
                at += _HEAD.size + len(record.data) + _CHECK.size
        except DamagedError:
            if not found:
                raise
        del self._buffer[:at]
        return found

    def _next(self, at: int) -> Record | None:
        if len(self._buffer) - at < _HEAD.size:
            return None
        magic, kind, source, size, time = _HEAD.unpack_from(self._buffer, at)
        if magic != MAGIC or kind not in list(Kind) or size > MOST_BYTES:
            raise DamagedError("no head of a record")
        end = at + _HEAD.size + size
        if len(self._buffer) < end + _CHECK.size:
            return None
        body = bytes(self._buffer[at:end])
        if _CHECK.unpack_from(self._buffer, end)[0] != zlib.crc32(body):
            raise DamagedError("a record whose check is wrong")
        if not math.fabs(time) <= MOST_TIME:  # nan too
            raise DamagedError(f"a record with the time {time:g} s")
        return Record(Kind(kind), source, time, body[_HEAD.size :])
