"""Frames of the ring protocol; docs/rig.md has the table of bytes."""

import zlib
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Integer

from ...formats import ring_frame

VERSION = 1
MAGIC = b"\xa5\xc3"
MOST_SENSORS = 64
MOST_MM = 0xFFFF
_HEADER, _CHECK, _SENSORS = ring_frame.HEADER, ring_frame.CHECK, ring_frame.SENSORS
_TURN = 1 << 16  # of the sequence number
_LATE = (
    # frames; a frame at most this much older than the newest is late, an older one means that the
    # ring restarted
    8
)


class Status(IntEnum):
    """Status of a sensor's distance."""

    VALID = 0
    NO_TARGET = 1
    WEAK = 2
    FAILED = 3


_DISTANT = (Status.VALID, Status.WEAK)  # with a distance
# status for any byte
_STATUS = np.array(
    [byte if byte in list(Status) else Status.FAILED for byte in range(256)], np.uint8
)
_HAS = np.isin(_STATUS, _DISTANT)


@dataclass(frozen=True)
class Frame:
    """One measurement of all sensors of a ring."""

    time: float
    """Arrival of the last byte, s of the host's monotonic clock."""
    clock: float
    """s of the ring's own clock; nan if its firmware sends none."""
    sequence: int
    """Number of the frame."""
    distance: Float[np.ndarray, " n"]
    """m, in the order as wired; nan where there is none."""
    status: Integer[np.ndarray, " n"]
    """Values of ``Status``."""


@dataclass
class Counts:
    """Counts of a line."""

    frames: int = 0
    """Frames passed on."""
    lost: int = 0
    """Gaps in the sequence."""
    late: int = 0
    """Frames that arrived after a newer one, or twice; not passed on."""
    corrupt: int = 0
    """Byte sequences that began like a frame and were not one."""
    skipped: int = 0
    """Bytes that belong to no frame."""
    restarts: int = 0
    """Restarts of the ring."""


class SequenceTracker:
    """Evaluates the sequence numbers of frames, modulo ``turn``."""

    def __init__(self, counts: Counts, turn: int = _TURN) -> None:
        self._counts, self._turn, self._last, self._clock = counts, turn, -1, float("-inf")

    def take(self, sequence: int, clock: float) -> bool:
        """Whether a frame with this number, at this time in s of the ring's clock, is newer than
        all before it.
        """
        ahead = (sequence - self._last) % self._turn if self._last >= 0 else 1
        if ahead == 0 or ahead >= self._turn - _LATE:
            self._counts.late += 1
            self._counts.lost -= ahead != 0 and self._counts.lost > 0  # it had been counted as lost
            return False
        if clock < self._clock or ahead >= self._turn // 2:
            self._counts.restarts += 1
        else:
            self._counts.lost += ahead - 1
        self._last, self._clock = sequence, clock
        self._counts.frames += 1
        return True


def encode(
    sequence: int,
    clock: float,
    distance: Float[np.ndarray, " n"],
    status: Integer[np.ndarray, " n"],
) -> bytes:
    """Encode a frame; distances (n,) m are rounded to mm, and 0 where ``status`` says that there is
    none.

    Raises:
        ValueError: if a number does not fit its field.
    """
    count = len(distance)
    if not 1 <= count <= MOST_SENSORS or len(status) != count:
        raise ValueError(
            f"a frame needs equal numbers of distances and statuses, 1 to {MOST_SENSORS}; got"
            f" {count} and {len(status)}"
        )
    sensors = np.zeros(count, _SENSORS)
    there = np.isin(status, _DISTANT)
    mm = np.rint(1000 * np.where(there, distance, 0.0))
    if not np.all((mm >= 0) & (mm <= MOST_MM)) or not np.isin(status, list(Status)).all():
        raise ValueError(f"distances must be 0 to {MOST_MM} mm, statuses 0 to {max(Status)}")
    sensors["mm"], sensors["status"] = mm, status
    head = _HEADER.pack(MAGIC, VERSION, count, 255 - count, sequence % _TURN, round(1e6 * clock))
    body = head + sensors.tobytes()
    return body + _CHECK.pack(zlib.crc32(body))


class Arrivals:
    """Bytes not yet used, with their arrival times."""

    def __init__(self) -> None:
        self.bytes, self._chunks = bytearray(), list[tuple[int, float]]()

    def add(self, data: bytes, time: float) -> None:
        """Append bytes that arrived at ``time`` s."""
        if data:
            self.bytes += data
            self._chunks.append((len(self.bytes), time))

    def time(self, place: int) -> float:
        """Return when the byte at ``place`` arrived, s."""
        return next(time for end, time in self._chunks if place < end)

    def drop(self, count: int) -> None:
        """Discard the first ``count`` bytes."""
        if count:
            del self.bytes[:count]
            self._chunks = [(end - count, time) for end, time in self._chunks if end > count]


class Decoder:
    """Decodes the intact frames in a stream of arbitrary bytes.

    A frame is intact if its magic, version, count (twice) and CRC-32 (ISO 3309, as in Ethernet and
    zlib) are right, and its count is that of the ring. After anything else the search continues one
    byte further, so that preceding garbage never costs an intact frame.
    """

    def __init__(self, count: int, counts: Counts | None = None) -> None:
        self.counts, self._count, self._length = (
            counts or Counts(),
            count,
            ring_frame.frame_length(count),
        )
        self._arrivals, self._order = Arrivals(), SequenceTracker(self.counts)

    def feed(self, data: bytes, time: float) -> list[Frame]:
        """Return the frames that ``data``, which arrived at ``time`` s, completes. Raises
        nothing.
        """
        self._arrivals.add(data, time)
        buffer, at, frames = self._arrivals.bytes, 0, list[Frame]()
        while True:
            start = buffer.find(MAGIC, at)
            if start < 0:  # the last byte may be the first of a magic
                start = len(buffer) - buffer.endswith(MAGIC[:1])
                self.counts.skipped += max(start - at, 0)
                at = max(start, at)
                break
            self.counts.skipped += start - at
            at = start
            if len(buffer) - at < _HEADER.size:
                break
            _, version, count, complement, sequence, micros = _HEADER.unpack_from(buffer, at)
            if (version, count, complement) != (VERSION, self._count, 255 - self._count):
                at = self._reject(at)
            elif len(buffer) - at < self._length:
                break
            elif not self._right(memoryview(buffer)[at : at + self._length]):
                at = self._reject(at)
            else:
                end = at + self._length
                if self._order.take(sequence, 1e-6 * micros):
                    sensors = np.frombuffer(
                        bytes(buffer[at + _HEADER.size : end - _CHECK.size]), _SENSORS
                    )
                    values = measured(sensors["mm"], sensors["status"])
                    frames.append(
                        Frame(self._arrivals.time(end - 1), 1e-6 * micros, sequence, *values)
                    )
                at = end
        self._arrivals.drop(at)
        return frames

    def _reject(self, at: int) -> int:
        self.counts.corrupt += 1
        self.counts.skipped += 1
        return at + 1

    @staticmethod
    def _right(frame: memoryview) -> bool:
        with frame:
            right: bool = (
                zlib.crc32(frame[: -_CHECK.size]) == _CHECK.unpack(frame[-_CHECK.size :])[0]
            )
            return right


def measured(mm: np.ndarray, status: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Convert millimetres and status bytes of a ring to distances (n,) m, nan where there is none,
    and statuses (n,). An unknown status byte counts as a failure.
    """
    return np.where(_HAS[status], mm / 1000.0, np.nan), _STATUS[status]
