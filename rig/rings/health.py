"""What happens to a ring's line, judged by its bytes as they come: the same while it runs and when
it is replayed.
"""

import json
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ..recording.clocks import Lag
from ..recording.records import Kind, Record
from .decoders import decoder
from .protocol import Counts, Frame

# s without a frame: nothing is known of a ring any more. Rings send ten frames a second or more
SILENT = 0.25
LATE = 0.1  # s: frames that waited longer on their way are told of, and not handed on
BAUD = 460800
_WINDOW = 3.0  # s, in which so many bad frames
_NOISY = 3  # are told of


class Happened(Enum):
    """To a ring's line; the values are for people."""

    GONE = "its port is gone"
    BACK = "frames come"
    SILENT = "nothing comes"
    GARBLED = "bytes come, but no frame"
    NOISY = "frames are lost, late or corrupt"
    LATE = "frames waited on their way"
    RESTARTED = "it began anew"


@dataclass(frozen=True)
class Event:
    """What happened to which ring, and when it was found, s of the host's monotonic clock."""

    ring: int
    what: Happened
    time: float
    detail: str = ""

    def record(self) -> Record:
        """As it is kept."""
        return Record(
            Kind.HAPPENED, self.ring, self.time, json.dumps([self.what.name, self.detail]).encode()
        )

    @staticmethod
    def of(record: Record) -> "Event":
        """What was kept; ValueError if it is none."""
        match json.loads(record.data):
            case [str(name), str(detail)] if name in Happened.__members__:
                return Event(record.source, Happened[name], record.time, detail)
        raise ValueError("no event of a ring")


@dataclass(frozen=True)
class Port:
    """Where a ring is: the name of its serial port, how many sensors it has, its firmware's
    decoder, its speed. patience: so many times ``SILENT`` and ``LATE`` are allowed; a simulated
    ring on a busy machine needs more than 1."""

    name: str
    count: int
    decoder: str = "place-rings"
    baud: int = BAUD
    patience: float = 1.0


class Line:
    """The frames of ring ``number``, and what happens to its line from ``now`` s on. ``counts`` are
    of all its time.
    """

    def __init__(self, number: int, port: Port, now: float) -> None:
        self._number, self._port, self.counts = number, port, Counts()
        self._state: Happened | None = None
        self._spoiled: deque[float] = deque([-np.inf] * _NOISY, maxlen=_NOISY)
        self._bad, self._noisy = 0, False
        self.opened(now)

    def opened(self, now: float) -> None:
        """Its port was opened, now: the ring may have begun anew, and its clock with it."""
        self._decoder, self._lag = decoder(self._port.decoder, self._port.count, self.counts), Lag()
        self._heard, self._bytes, self._restarts = now, 0, self.counts.restarts

    def gone(self, now: float, why: str) -> Iterator[Event]:
        """Its port cannot be read."""
        yield from self._turn(Happened.GONE, now, why)

    def take(self, data: bytes, now: float) -> Iterator[Frame | Event]:
        """Frames and events by the bytes that came until ``now`` s, which may be none."""
        self._bytes += len(data)
        for frame in self._decoder.feed(data, now) if data else ():
            yield from self._frame(frame)
        if now - self._heard > self._port.patience * SILENT:
            yield from self._turn(
                Happened.GARBLED if self._bytes else Happened.SILENT, now, f"{self._bytes} bytes"
            )
        yield from self._judge(now)

    def _frame(self, frame: Frame) -> Iterator[Frame | Event]:
        self._heard, self._bytes = frame.time, 0
        if self.counts.restarts > self._restarts:
            self._restarts, self._lag = self.counts.restarts, Lag()
            yield Event(self._number, Happened.RESTARTED, frame.time)
        delay = 0.0 if np.isnan(frame.clock) else self._lag.delay(frame.time, frame.clock)
        if delay > self._port.patience * LATE:
            yield from self._turn(Happened.LATE, frame.time, f"{1000 * delay:.0f} ms")
        else:
            yield from self._turn(Happened.BACK, frame.time)
            yield frame

    def _judge(self, now: float) -> Iterator[Event]:
        """Tells of a line that spoils frames, when it begins to."""
        c = self.counts
        bad = c.lost + c.late + c.corrupt
        self._spoiled.extend([now] * min(bad - self._bad, _NOISY))
        self._bad = bad
        first, last = self._spoiled[0], self._spoiled[-1]
        before, self._noisy = self._noisy, now - (last if self._noisy else first) < _WINDOW
        if self._noisy and not before:
            told = f"{c.lost} lost, {c.late} late, {c.corrupt} corrupt beside {c.frames} frames"
            yield Event(self._number, Happened.NOISY, now, told)

    def _turn(self, what: Happened, now: float, detail: str = "") -> Iterator[Event]:
        if what != self._state:
            self._state = what
            yield Event(self._number, what, now, detail)
