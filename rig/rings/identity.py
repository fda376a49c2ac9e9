"""Identities on a ring's line: the serial numbers in its hellos, and frames of other sizes."""

import re

from ...formats.ring_frame import CHECK, HELLO
from .protocol import HELLO_MAGIC, MAGIC, VERSION, ZONE_MAGIC, Counts, frame_size, intact

_ANY = re.compile(b"|".join(map(re.escape, (MAGIC, ZONE_MAGIC, HELLO_MAGIC))))
_LENGTH = HELLO.size + CHECK.size  # of a hello, which is shorter than any frame


def serial_text(serial: int) -> str:
    """Return a serial number as files and reports state it: 16 hexadecimal digits."""
    return f"{serial:016X}"


class HelloReader:
    """Reads the hellos in the bytes of a line, and counts intact frames that are not of this ring.

    It never delays a frame of the ring, because it works beside the decoder.

    Args:
        count: number of sensors of the ring.
        counts: of the line; ``serials`` and ``sizes`` are updated.
    """

    def __init__(self, count: int, counts: Counts) -> None:
        self._count, self._counts, self._buffer = count, counts, bytearray()

    def feed(self, data: bytes) -> list[str]:
        """Return the serial numbers of the hellos that ``data`` completes. Raises nothing."""
        self._buffer += data
        buffer, at, serials = self._buffer, 0, list[str]()
        while match := _ANY.search(buffer, at):
            at = match.start()
            if len(buffer) - at < _LENGTH:
                break
            size = self._size(at)
            if size is None or len(buffer) - at < size:
                break
            if not size or not intact(buffer, at, size):
                at += 1
                continue
            if match[0] == HELLO_MAGIC:
                serials += self._hello(at)
            elif buffer[at + 3] != self._count:
                self._counts.sizes[buffer[at + 3]] += 1
            at += size
        else:
            at = max(at, len(buffer) - 1)  # the last byte may be the first of a magic
        del buffer[:at]
        return serials

    def _size(self, at: int) -> int | None:
        """Return the length of the hello or frame that begins at ``at``; 0 if none can, None if
        more bytes are needed to tell.
        """
        if self._buffer.startswith(HELLO_MAGIC, at):
            return _LENGTH if self._buffer[at + 2] == VERSION else 0
        return frame_size(self._buffer, at)

    def _hello(self, at: int) -> list[str]:
        """Note a hello; return its serial number unless the board has none."""
        serial = HELLO.unpack_from(self._buffer, at)[3]
        if not serial:
            return []
        self._counts.serials[serial_text(serial)] += 1
        return [serial_text(serial)]
