"""Events of a ring's line, derived from its bytes; the same live and in a replay."""

import json
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ..recording.clocks import Lag
from ..recording.records import Kind, Record
from .firmware_decoders import decoder
from .protocol import Counts, Frame

# s without a frame, after which a ring is silent. Rings send at least ten frames a second
SILENT = 0.25
LATE = 0.1  # s; frames with a longer delay are reported and not passed on
BAUD = 460800
_WINDOW = 3.0  # s; a line with _NOISY bad frames in this time is reported
_NOISY = 3  # bad frames


class Happened(Enum):
    """Events of a ring's line; the values are shown to the user."""

    GONE = "its port is gone"
    BACK = "frames arrive"
    SILENT = "no data arrives"
    GARBLED = "data arrives, but no valid frame"
    NOISY = "frames are lost, late or corrupt"
    LATE = "frames arrived late"
    RESTARTED = "it restarted"


@dataclass(frozen=True)
class Event:
    """An event of a ring's line."""

    ring: int
    """Number of the ring."""
    what: Happened
    """What happened."""
    time: float
    """When it was detected, s of the host's monotonic clock."""
    detail: str = ""
    """More about it, as text."""

    def record(self) -> Record:
        """Return the event as a record."""
        return Record(
            Kind.HAPPENED, self.ring, self.time, json.dumps([self.what.name, self.detail]).encode()
        )

    @staticmethod
    def of(record: Record) -> "Event":
        """Return the event in a record; raise ValueError if it holds none."""
        match json.loads(record.data):
            case [str(name), str(detail)] if name in Happened.__members__:
                return Event(record.source, Happened[name], record.time, detail)
        raise ValueError("no event of a ring")


@dataclass(frozen=True)
class Port:
    """Serial port of a ring."""

    name: str
    """Name of the port."""
    count: int
    """Number of sensors of the ring."""
    decoder: str = "place-rings"
    """Decoder of its firmware."""
    baud: int = BAUD
    """Speed, baud."""
    patience: float = 1.0
    """Factor on ``SILENT`` and ``LATE``; a simulated ring on a busy machine needs more than 1."""


class Line:
    """Frames and events of ring ``number`` from ``now`` s on. ``counts`` cover the whole time."""

    def __init__(self, number: int, port: Port, now: float) -> None:
        self._number, self._port, self.counts = number, port, Counts()
        self._state: Happened | None = None
        self._spoiled: deque[float] = deque([-np.inf] * _NOISY, maxlen=_NOISY)
        self._bad, self._noisy = 0, False
        self.opened(now)

    def opened(self, now: float) -> None:
        """Note that the port was opened at ``now`` s: the ring, and with it its clock, may have
        restarted.
        """
        self._decoder, self._lag = decoder(self._port.decoder, self._port.count, self.counts), Lag()
        self._heard, self._bytes, self._restarts = now, 0, self.counts.restarts

    def gone(self, now: float, why: str) -> Iterator[Event]:
        """Note that the port cannot be read."""
        yield from self._turn(Happened.GONE, now, why)

    def take(self, data: bytes, now: float) -> Iterator[Frame | Event]:
        """Yield the frames and events of the bytes that arrived until ``now`` s, which
        may be none.
        """
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
        """Yield an event when the line begins to spoil frames."""
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
