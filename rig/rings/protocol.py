"""Frames of the ring protocol, and counts of a line; docs/rig.md has the table of bytes."""

import re
import zlib
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Integer

from ...formats import ring_frame
from ...formats.ring_status import ABSENT as ABSENT
from ...formats.ring_status import DISTANT, known_status, millimetres
from ...formats.ring_status import MOST_MM as MOST_MM
from ...formats.ring_status import Status as Status
from .zones import Zones

VERSION = 1
MAGIC, ZONE_MAGIC, HELLO_MAGIC = b"\xa5\xc3", b"\xa5\xc6", b"\xa5\xc5"
MOST_SENSORS = 64
_HEADER, _CHECK, _SENSORS = ring_frame.HEADER, ring_frame.CHECK, ring_frame.SENSORS
_TURN = 1 << 16  # of the sequence number
_LATE = (
    # frames; a frame at most this much older than the newest is late, an older one means that the
    # ring restarted
    8
)


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
    doubled: int = 0
    """Frames with the number of the frame before and another time: from another ring."""
    serials: Counter[str] = field(default_factory=Counter)
    """Number of hellos of each board, by its serial number; empty if none says hello."""
    sizes: Counter[int] = field(default_factory=Counter)
    """Number of intact frames with another number of sensors, by that number."""
    foreign: str = ""
    """The first line of text outside the decoder's grammar, shortened and quoted; empty if none."""
    codes: Integer[np.ndarray, "n 256"] | None = field(default=None, compare=False)
    """Number of each status code of each sensor, with those of its zones; None before a frame."""
    waiting: int = 0
    """Lines of text that wait until their grammar is recognised."""

    def take_codes(self, status: Integer[np.ndarray, "*each"]) -> None:
        """Count the status codes of a frame, (n,) or (n, z)."""
        count = len(status)
        if self.codes is None:
            self.codes = np.zeros((count, 256), int)
        np.add.at(self.codes, (np.arange(count)[:, None], status.reshape(count, -1)), 1)


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
    """Values of ``Status``, or ``ABSENT``."""
    era: int = 0
    """Number of restarts and jumps of the ring's clock before this frame."""
    zones: Zones | None = None
    """Readings of the sensors' zones, of which ``distance`` and ``status`` are the nearest; None
    for sensors of one zone."""


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
            self._counts.doubled += ahead == 0 and clock != self._clock and clock == clock
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
    sensors["mm"], sensors["status"] = millimetres(distance, status), status
    return _checked(_header(MAGIC, count, sequence, clock) + sensors.tobytes())


def encode_zones(sequence: int, clock: float, zones: Zones) -> bytes:
    """Encode a frame of sensors with zones.

    Raises:
        ValueError: if there are more sensors, zones or targets than a frame holds.
    """
    count, grid = len(zones.mm), zones.grid
    if (
        not 1 <= count <= MOST_SENSORS
        or not 1 <= grid.zones <= ring_frame.MOST_ZONES
        or not 1 <= grid.targets <= ring_frame.MOST_TARGETS
    ):
        raise ValueError(
            f"a frame needs 1 to {MOST_SENSORS} sensors of 1 to {ring_frame.MOST_ZONES} zones with"
            f" 1 to {ring_frame.MOST_TARGETS} targets; got {count}, {grid.zones}, {grid.targets}"
        )
    return _checked(_header(ZONE_MAGIC, count, sequence, clock) + grid.pack() + zones.pack())


def _header(magic: bytes, count: int, sequence: int, clock: float) -> bytes:
    numbers = (count, 255 - count, sequence % _TURN, round(1e6 * clock))
    return _HEADER.pack(magic, VERSION, *numbers)


def _checked(body: bytes) -> bytes:
    return body + _CHECK.pack(zlib.crc32(body))


def hello(count: int, serial: int) -> bytes:
    """Encode the hello of a ring of ``count`` sensors, whose board has the number ``serial``; 0 if
    it has none.
    """
    return _checked(ring_frame.HELLO.pack(HELLO_MAGIC, VERSION, count, serial))


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

    A frame is intact if its magic, version, count and zones (each twice) and CRC-32 (ISO 3309, as
    in Ethernet and zlib) are right, and its count is that of the ring. After anything else the
    search continues one byte further, so that preceding garbage never costs an intact frame.
    """

    def __init__(self, count: int, counts: Counts | None = None) -> None:
        self.counts, self._count = counts or Counts(), count
        self._arrivals, self._order = Arrivals(), SequenceTracker(self.counts)

    def feed(self, data: bytes, time: float) -> list[Frame]:
        """Return the frames that ``data``, which arrived at ``time`` s, completes. Raises
        nothing.
        """
        self._arrivals.add(data, time)
        buffer, at, frames = self._arrivals.bytes, 0, list[Frame]()
        while True:
            match = _START.search(buffer, at)
            if match is None:  # the last byte may be the first of a magic
                start = len(buffer) - buffer.endswith(MAGIC[:1])
                self.counts.skipped += max(start - at, 0)
                at = max(start, at)
                break
            self.counts.skipped += match.start() - at
            at = match.start()
            length = frame_size(buffer, at, self._count)
            if length is None or len(buffer) - at < length:
                break
            if not length or not intact(buffer, at, length):
                self.counts.corrupt += 1
                self.counts.skipped += 1
                at += 1
            else:
                body = bytes(buffer[at : at + length - _CHECK.size])
                frames += self._frame(body, self._arrivals.time(at + length - 1))
                at += length
        self._arrivals.drop(at)
        return frames

    def _frame(self, body: bytes, time: float) -> list[Frame]:
        """Return the frame of intact bytes, unless it comes too late."""
        magic, _, count, _, sequence, micros = _HEADER.unpack_from(body)
        if not self._order.take(sequence, 1e-6 * micros):
            return []
        if magic == MAGIC:
            sensors = np.frombuffer(body, _SENSORS, count, _HEADER.size)
            self.counts.take_codes(sensors["status"])
            values = measured(sensors["mm"], sensors["status"])
            return [Frame(time, 1e-6 * micros, sequence, *values)]
        grid = ring_frame.Grid.read(body, _HEADER.size)
        assert grid is not None
        records = body[_HEADER.size + ring_frame.GRID.size :]
        zones = Zones.read(records, count, grid)
        raw = np.frombuffer(records, grid.record)["status"].reshape(count, -1)
        self.counts.take_codes(raw)
        return [Frame(time, 1e-6 * micros, sequence, *zones.nearest(), zones=zones)]


_START = re.compile(re.escape(MAGIC) + b"|" + re.escape(ZONE_MAGIC))


def frame_size(buffer: bytes | bytearray, at: int, count: int | None = None) -> int | None:
    """Return the length of the frame that begins at ``at`` with a magic; 0 if none can, None if
    more bytes are needed to tell. ``count`` is its number of sensors, if known.
    """
    if len(buffer) - at < _HEADER.size:
        return None
    magic, version, n, complement, *_ = _HEADER.unpack_from(buffer, at)
    if version != VERSION or n + complement != 255 or not 1 <= n <= MOST_SENSORS:
        return 0
    if count not in (None, n):
        return 0
    if magic == MAGIC:
        return ring_frame.frame_length(n)
    if len(buffer) - at < _HEADER.size + ring_frame.GRID.size:
        return None
    grid = ring_frame.Grid.read(buffer, at + _HEADER.size)
    return 0 if grid is None else ring_frame.frame_length(n, grid)


def intact(buffer: bytes | bytearray, at: int, length: int) -> bool:
    """Return whether the frame or hello of ``length`` bytes at ``at`` has the right check."""
    end = at + length - _CHECK.size
    right: bool = zlib.crc32(bytes(buffer[at:end])) == _CHECK.unpack_from(buffer, end)[0]
    return right


def measured(mm: np.ndarray, status: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Convert millimetres and status bytes of a ring to distances (n,) m, nan where there is none,
    and statuses (n,). An unknown status byte counts as a failure.
    """
    known = known_status(status)
    return np.where(np.isin(known, DISTANT), mm / 1000.0, np.nan), known
