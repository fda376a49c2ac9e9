"""Events of a ring's line, derived from its bytes; the same live and in a replay."""

import json
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from typing import Annotated

import numpy as np
from pydantic import Field

from ...coverage.definitions.definition import definition
from ...objectives.link_limits import USUAL_LIMITS, LinkLimits
from ..recording.clocks import Lag, RateCheck
from ..recording.records import Kind, Record
from .firmware_decoders import decoder
from .identity import HelloReader
from .protocol import Counts, Frame

# s without a frame, after which a ring is silent. Rings send at least ten frames a second
SILENT = USUAL_LIMITS.ring_silent
LATE = USUAL_LIMITS.ring_late  # s; frames with a longer delay are reported and not passed on
BAUD = 460800
_WINDOW = 3.0  # s; a line with _NOISY bad frames in this time is reported
_NOISY = 3  # bad frames
_JUMP = 0.2  # s, times patience; a clock that goes ahead by more in one frame has jumped
_SETTLED = 1.0  # s of a ring's clock, before which its first frames may only have been late
_SAME = 0.25  # s; clocks that agree so closely are one clock
_PROOFS = 3  # in _WINDOW s, that frames come from two rings


class Happened(Enum):
    """Events of a ring's line; the values are shown to the user."""

    GONE = "its port is gone"
    BACK = "frames arrive"
    SILENT = "no data arrives"
    GARBLED = "data arrives, but no valid frame"
    NOISY = "frames are lost, late or corrupt"
    LATE = "frames arrived late"
    RESTARTED = "it restarted"
    CLOCK = "its clock is wrong"
    OTHER = "another board answers at its port"
    TWO = "two rings send on its line"


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


@definition
class Port:
    """Serial port of a ring."""

    name: Annotated[str, Field(max_length=1000)]
    """Name of the port."""
    count: Annotated[int, Field(ge=1, le=1000)]
    """Number of sensors of the ring."""
    decoder: str = "place-rings"
    """Decoder of its firmware."""
    baud: Annotated[int, Field(ge=50, le=20_000_000)] = BAUD
    """Speed, baud."""
    patience: Annotated[float, Field(ge=1, le=100)] = 1.0
    """Factor on time limits; a simulated ring on a busy machine needs more than 1."""


class Line:
    """Frames and events of ring ``number`` from ``now`` s on, within ``limits``. ``counts`` cover
    the whole time."""

    def __init__(
        self, number: int, port: Port, now: float, limits: LinkLimits = USUAL_LIMITS
    ) -> None:
        self._number, self._port, self.counts = number, port, Counts()
        self.silent = port.patience * limits.ring_silent
        self._late = port.patience * limits.ring_late
        self._state: Happened | None = None
        self._spoiled: deque[float] = deque([-np.inf] * _NOISY, maxlen=_NOISY)
        self._bad, self._noisy, self._era = 0, False, -1
        self._serials: list[str] = []
        self.opened(now)

    def opened(self, now: float) -> None:
        """Note that the port was opened at ``now`` s: the ring, and with it its clock, may have
        restarted.
        """
        self._decoder = decoder(self._port.decoder, self._port.count, self.counts)
        speaks = self._port.decoder == "place-rings"
        self._hellos = HelloReader(self._port.count, self.counts) if speaks else None
        self._heard, self._bytes, self._restarts = now, 0, self.counts.restarts
        self._doubled, self._other_sizes = self.counts.doubled, self.counts.sizes.total()
        self._serials = self._serials[-1:]
        self._proofs: deque[float] = deque([-np.inf] * _PROOFS, maxlen=_PROOFS)
        self._offsets: deque[float] = deque(maxlen=8)
        self._next_era()

    def _next_era(self) -> None:
        """Begin with a clock that has nothing to do with the one before."""
        self._era += 1
        self._lag, self._rate_check, self._fast = Lag(), RateCheck(), False
        self._since, self._offset = np.inf, np.nan

    def gone(self, now: float, why: str) -> Iterator[Event]:
        """Note that the port cannot be read."""
        yield from self._turn(Happened.GONE, now, why)

    def take(self, data: bytes, now: float) -> Iterator[Frame | Event]:
        """Yield the frames and events of the bytes that arrived until ``now`` s, which
        may be none.
        """
        self._bytes += len(data)
        if data and self._hellos:
            for serial in self._hellos.feed(data):
                yield from self._hello(serial, now)
        for frame in self._decoder.feed(data, now) if data else ():
            yield from self._frame(frame)
        if self.counts.doubled > self._doubled:
            self._doubled = self.counts.doubled
            yield from self._prove(now)
        # a line of text is used once its grammar is recognised
        if now - self._heard > self.silent * (2 if self.counts.waiting else 1):
            yield from self._turn(
                Happened.GARBLED if self._bytes else Happened.SILENT, now, self._why_garbled()
            )
        yield from self._judge(now)

    def _why_garbled(self) -> str:
        sizes = self.counts.sizes
        if sizes.total() > self._other_sizes:
            size = sizes.most_common(1)[0][0]
            return f"frames of {size} sensors arrive, not of {self._port.count}"
        return self._quoted(f"{self._bytes} bytes")

    def _quoted(self, text: str) -> str:
        """Add the first line outside the decoder's grammar, if there was one."""
        first = self.counts.foreign
        return f"{text}; the first foreign line: {first}" if first else text

    def _hello(self, serial: str, now: float) -> Iterator[Event]:
        """Take a hello: a board that answers again after another one shares the line with it."""
        before = self._serials[-1:]
        if serial in self._serials[:-1]:
            self._proofs.extend([now] * _PROOFS)
            yield from self._prove(now, f"{serial} and {before[0]}")
        elif before and before != [serial] and not self._two(now):
            yield Event(self._number, Happened.OTHER, now, f"{serial}, before {before[0]}")
        if before != [serial]:
            self._serials = [s for s in self._serials if s != serial] + [serial]

    def _prove(self, now: float, detail: str = "") -> Iterator[Event]:
        """Note a proof that two rings send; enough of them in a short time are an event."""
        self._proofs.append(now)
        if self._two(now):
            yield from self._turn(Happened.TWO, now, detail or "their clocks or frames differ")

    def _two(self, now: float) -> bool:
        """Whether two rings send on the line, so that no frame can be assigned to one."""
        return now - self._proofs[0] < _WINDOW

    def _frame(self, frame: Frame) -> Iterator[Frame | Event]:
        self._heard, self._bytes, clock = frame.time, 0, frame.clock
        restarted, delay = self.counts.restarts > self._restarts, 0.0
        if not np.isnan(clock):
            delay = 0.0 if restarted else self._lag.delay(frame.time, clock)
            jumped = delay < -_JUMP * self._port.patience and clock - self._since > _SETTLED
            if restarted or jumped:
                yield from self._new_clock(frame, -delay)
                delay = self._lag.delay(frame.time, clock)
            self._since, self._offset = min(self._since, clock), frame.time - clock
            if delay < 0 and clock - self._since <= _SETTLED:
                self._rate_check = RateCheck()  # the frames before were late
            yield from self._rate(frame)
        elif restarted:
            self._restarts = self.counts.restarts
            self._next_era()
            yield Event(self._number, Happened.RESTARTED, frame.time)
        if self._two(frame.time):
            return
        if delay > self._late:
            yield from self._turn(Happened.LATE, frame.time, f"{1000 * delay:.0f} ms")
        else:
            yield from self._turn(Happened.BACK, frame.time)
            yield replace(frame, clock=np.nan if self._fast else clock, era=self._era)

    def _new_clock(self, frame: Frame, ahead: float) -> Iterator[Event]:
        """Take a frame whose clock does not continue the one before: the ring restarted, its clock
        jumped, or the frame is from another ring, if an earlier clock continues.
        """
        restarted = self.counts.restarts > self._restarts
        offset, self._restarts = frame.time - frame.clock, self.counts.restarts
        resumed = any(abs(offset - other) < _SAME for other in self._offsets)
        self._offsets.append(self._offset)
        self._next_era()
        if resumed:
            yield from self._prove(frame.time)
        elif not self._two(frame.time):
            what = Happened.RESTARTED if restarted else Happened.CLOCK
            detail = "" if restarted else f"jumped by {ahead:.4g} s"
            yield Event(self._number, what, frame.time, detail)

    def _rate(self, frame: Frame) -> Iterator[Event]:
        """Stop using a clock that runs too fast, which would hide every delay."""
        fault = self._rate_check.fault(frame.time, frame.clock, self._late)
        if fault and not self._fast:
            self._fast = True
            yield Event(self._number, Happened.CLOCK, frame.time, fault)

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
            yield Event(self._number, Happened.NOISY, now, self._quoted(told))

    def _turn(self, what: Happened, now: float, detail: str = "") -> Iterator[Event]:
        if what != self._state:
            self._state = what
            yield Event(self._number, what, now, detail)
