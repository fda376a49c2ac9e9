"""Decoder of lines of text, by a grammar that is named or recognised over several lines."""

import re
from collections import Counter, deque
from typing import NamedTuple

import numpy as np

from ...coverage.definitions.errors import shown
from ...formats.ring_status import Status
from .line_grammar import GRAMMARS, LineReadings
from .protocol import Arrivals, Counts, Frame, measured

_LONGEST = 4096  # bytes of a line
_ENOUGH, _RECENT = 3, 12  # lines of one grammar among the recent ones, which recognise it
_BOOT = re.compile(
    rb"rst:0x|^ets [A-Z][a-z]{2} |^ESP-ROM|\bboot:0x|brownout detector|guru meditation|^rebooting",
    re.IGNORECASE,
)


class _Waiting(NamedTuple):
    """A line of a grammar that is not yet recognised."""

    key: tuple[str, str]
    line: bytes
    time: float
    read: LineReadings


class LineDecoder:
    """Decodes lines of text: the distances of all sensors of a ring, by a stated grammar.

    Lines outside the grammar count as corrupt; the first one is quoted in the counts. A known line
    of a boot log among them is a restart of the board.

    Args:
        count: number of sensors.
        counts: to continue.
        grammar: name of the only grammar to use; default: all. The first one is used of which
            three of the last twelve lines are, with one label. No line before is lost.
    """

    def __init__(self, count: int, counts: Counts | None = None, grammar: str = "") -> None:
        self.counts, self._count = counts or Counts(), count
        self._arrivals, self._sequence, self._whole = Arrivals(), 0, False
        self._grammars = {grammar: GRAMMARS[grammar]} if grammar else GRAMMARS
        self._key: tuple[str, str] | None = None
        self._waiting: deque[_Waiting] = deque()
        self._booting = False
        self.counts.waiting = 0

    def feed(self, data: bytes, time: float) -> list[Frame]:
        """Return the frames that ``data``, which arrived at ``time`` s, completes. Raises
        nothing.
        """
        self._arrivals.add(data, time)
        buffer, at, frames = self._arrivals.bytes, 0, list[Frame]()
        while (end := buffer.find(b"\n", at)) >= 0:
            if self._whole:  # the first line may be incomplete
                frames += self._line(bytes(buffer[at:end]), self._arrivals.time(end))
            self._whole, at = True, end + 1
        if len(buffer) - at > _LONGEST:
            self._refuse(bytes(buffer[at:]))
            self._whole, at = False, len(buffer)
        self._arrivals.drop(at)
        return frames

    def _line(self, line: bytes, time: float) -> list[Frame]:
        """Return the frames that a whole line completes."""
        if not line.strip():
            self.counts.skipped += len(line) + 1
            return []
        name, read = self._read(line)
        if read is None:
            self._refuse(line)
            return []
        if self._key is None:
            return self._recognise(_Waiting((name, read.head), line, time, read))
        if self._key == (name, read.head):
            return [self._frame(time, read)]
        self._refuse(line)
        return []

    def _read(self, line: bytes) -> tuple[str, LineReadings | None]:
        """Return the readings of a line, and the name of its grammar."""
        if line.isascii():
            text = line.decode("ascii").strip()
            for name, grammar in self._grammars.items():
                if (read := grammar(text, self._count)) is not None:
                    return name, read
        return "", None

    def _recognise(self, one: _Waiting) -> list[Frame]:
        """Return the frames of the lines that wait, once enough of them are of one grammar."""
        self._waiting.append(one)
        some = Counter(w.key for w in self._waiting if _sure(w.read))
        key, number = some.most_common(1)[0] if some else (one.key, 0)
        frames = list[Frame]()
        if number >= _ENOUGH:
            self._key = key
            for old in self._waiting:
                if old.key == key:
                    frames.append(self._frame(old.time, old.read))
                else:
                    self._refuse(old.line)
            self._waiting.clear()
        elif len(self._waiting) > _RECENT:
            self._refuse(self._waiting.popleft().line)
        self.counts.waiting = len(self._waiting)
        return frames

    def _refuse(self, line: bytes) -> None:
        """Count a line outside the grammar; a boot log is named once, however long it is."""
        self.counts.corrupt += 1
        self.counts.skipped += len(line) + 1
        self.counts.foreign = self.counts.foreign or quoted(line)
        if _BOOT.search(line) and not self._booting:
            self._booting = True
            self.counts.restarts += 1

    def _frame(self, time: float, read: LineReadings) -> Frame:
        self._booting = False
        sequence, self._sequence = self._sequence, self._sequence + 1
        self.counts.frames += 1
        mm = np.array([one.mm for one in read.sensors])
        status = np.array([one.status for one in read.sensors], np.uint8)
        return Frame(time, np.nan, sequence, *measured(mm, status))


def _sure(read: LineReadings) -> bool:
    """Whether a line tells more than failures."""
    return any(one.status != Status.FAILED for one in read.sensors)


def quoted(line: bytes) -> str:
    """Return a line as a message shows it: short, in quotes, other characters escaped."""
    text = line.strip().decode("ascii", "backslashreplace")
    return shown("".join(c if c.isprintable() else repr(c)[1:-1] for c in text))
