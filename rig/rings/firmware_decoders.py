"""Decoders of ring firmwares, by name: the protocol of this toolkit, packed binary frames, lines of
text.
"""

import struct
from collections.abc import Callable
from functools import partial
from typing import Protocol

import numpy as np

from ...formats.ring_frame import SENSORS
from ...formats.ring_status import CHIPS, MOST_MM, Status, StatusCodes
from .line_grammar import GRAMMARS, NO_TARGET_MM
from .protocol import Arrivals, Counts, Decoder, Frame, SequenceTracker, measured
from .text_decoder import LineDecoder

_NONE = np.isin(np.arange(MOST_MM + 1), NO_TARGET_MM)


class FrameDecoder(Protocol):
    """Decodes frames from the bytes of a line."""

    counts: Counts

    def feed(self, data: bytes, time: float) -> list[Frame]:
        """Return the frames that ``data``, which arrived at ``time`` s, completes. Raises
        nothing.
        """
        ...


# a packed frame without a checksum: a magic, a sequence number, then mm and status of each sensor
_MAGIC, _SEQUENCE = b"\x5a\x5a", struct.Struct("<H")


class PackedDecoder:
    """Decodes packed frames.

    Without a checksum, a frame counts as intact only if the magic of the next one follows it at
    once. So each frame is returned when the next one starts; its time is still the arrival of its
    own last byte. Without ``codes`` the status is that of the ring protocol.
    """

    def __init__(
        self, count: int, counts: Counts | None = None, codes: StatusCodes | None = None
    ) -> None:
        self.counts, self._count, self._codes = counts or Counts(), count, codes
        self._length = len(_MAGIC) + _SEQUENCE.size + count * SENSORS.itemsize
        self._arrivals = Arrivals()
        self._order = SequenceTracker(self.counts, 1 << 8 * _SEQUENCE.size)

    def feed(self, data: bytes, time: float) -> list[Frame]:
        """Return the frames that ``data``, which arrived at ``time`` s, completes. Raises
        nothing.
        """
        self._arrivals.add(data, time)
        buffer, at, frames = self._arrivals.bytes, 0, list[Frame]()
        while len(buffer) - at >= self._length + len(_MAGIC):
            end = at + self._length
            if buffer.startswith(_MAGIC, at) and buffer.startswith(_MAGIC, end):
                frames += self._frame(bytes(buffer[at:end]), self._arrivals.time(end - 1))
                at = end
            else:
                self.counts.corrupt += buffer.startswith(_MAGIC, at)
                after = buffer.find(_MAGIC, at + 1)
                after = after if after >= 0 else len(buffer) - len(_MAGIC) + 1
                self.counts.skipped += after - at
                at = after
        self._arrivals.drop(at)
        return frames

    def _frame(self, data: bytes, time: float) -> list[Frame]:
        sequence = _SEQUENCE.unpack_from(data, len(_MAGIC))[0]
        if not self._order.take(sequence, np.nan):
            return []
        sensors = np.frombuffer(data, SENSORS, self._count, len(_MAGIC) + _SEQUENCE.size)
        mm, code = sensors["mm"], sensors["status"]
        status = code
        if self._codes is None:
            self.counts.take_codes(code)
        else:
            status = self._codes.status(code)
        return [Frame(time, np.nan, sequence, *measured(mm, _none(mm, status)))]


def _none(mm: np.ndarray, status: np.ndarray) -> np.ndarray:
    """Return ``status`` (n,), with no target where ``mm`` of a valid sensor is a code for no
    target.
    """
    return np.where(_NONE[mm] & (status == Status.VALID), np.uint8(Status.NO_TARGET), status)


DECODERS: dict[str, Callable[[int, Counts | None], FrameDecoder]] = {
    "place-rings": Decoder,
    "esp32": PackedDecoder,
    "text": LineDecoder,
    **{codes.decoder: partial(PackedDecoder, codes=codes) for codes in CHIPS},
    **{f"text-{name}": partial(LineDecoder, grammar=name) for name in GRAMMARS},
}


def decoder(name: str, count: int, counts: Counts | None = None) -> FrameDecoder:
    """Return the decoder ``name`` for a ring of ``count`` sensors, which continues ``counts``.

    Raises:
        ValueError: if no decoder has that name; the message lists all names.
    """
    if name not in DECODERS:
        raise ValueError(f"unknown decoder {name!r}; known: {', '.join(DECODERS)}")
    return DECODERS[name](count, counts)
