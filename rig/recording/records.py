"""Records: what a recording is made of, and what the processes of the rig tell each other. No
pickle: bytes and a check.
"""

import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum

MAGIC = b"PR"
MOST_BYTES = 1 << 20  # of one record's data
_HEAD = struct.Struct("<2sBBId")  # magic, kind, source, bytes of data, time
_CHECK = struct.Struct("<I")


class Kind(IntEnum):
    """What a record holds."""

    ABOUT = 1  # JSON: what is recorded
    STATE = 2  # of the robot: ``state.State``
    BYTES = 3  # of a ring's line, as they came
    EVENT = 4  # JSON: a fault, a step of the check, what a person said
    NOTE = 5  # a line of text
    MOVE = 6  # struct of doubles: joints, speed, acceleration
    STOP = 7
    DONE = 8
    CLOSED = 9  # the robot's side
    OPENED = 10  # a ring's port
    HAPPENED = 11  # JSON: ``health.Event``
    END = 12  # of a recording
    ALIVE = 13  # a sign of life
    REST = 14  # the motion is over


class DamagedError(Exception):
    """What follows is no record."""


@dataclass(frozen=True)
class Record:
    """kind: of data. source: number of the ring, 0 where there is one alone. time: s, of the host's
    monotonic clock.
    """

    kind: Kind
    source: int
    time: float
    data: bytes = b""

    def pack(self) -> bytes:
        """The record as bytes: a head with its length, its data, and a CRC-32 (as zlib has it) of
        both.
        """
        if len(self.data) > MOST_BYTES:
            raise ValueError(f"a record of {len(self.data)} bytes, allowed: {MOST_BYTES}")
        body = _HEAD.pack(MAGIC, self.kind, self.source, len(self.data), self.time) + self.data
        return body + _CHECK.pack(zlib.crc32(body))


class RecordReader:
    """Makes records of bytes as they come. ``left``: bytes that are not yet a record."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    @property
    def left(self) -> int:
        return len(self._buffer)

    def feed(self, data: bytes) -> list[Record]:
        """The records that ``data`` completes. Of damage it is told once the records before it are
        out: by the next call.

        Raises:
            DamagedError: if what comes next cannot be a record.
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
        return Record(Kind(kind), source, time, body[_HEAD.size :])
