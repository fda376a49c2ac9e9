"""Simulated rings on pseudo-terminals, which behave like serial ports except for their speed."""

import os
import pty
import struct
import tty
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from ...formats.ring_frame import SENSORS
from ..rings.protocol import Status, encode, encode_zones, hello
from ..rings.zones import Zones

_TURN = 1 << 16
_HELLO_EVERY = 16  # frames


def _frame(sequence: int, clock: float, distance: np.ndarray, status: np.ndarray) -> bytes:
    if distance.ndim > 1:
        return encode_zones(sequence, clock, Zones.of(distance, status))
    return encode(sequence, clock, distance, status)


def _esp32(sequence: int, clock: float, distance: np.ndarray, status: np.ndarray) -> bytes:
    sensors = np.array([*zip(_mm(distance), status, strict=True)], SENSORS)
    return b"\x5a\x5a" + struct.pack("<H", sequence % _TURN) + sensors.tobytes()


def _text(sequence: int, clock: float, distance: np.ndarray, status: np.ndarray) -> bytes:
    words = [
        "-" if s == Status.FAILED else str(mm) for mm, s in zip(_mm(distance), status, strict=True)
    ]
    return f"{sequence}: {', '.join(words)}\r\n".encode()


def _mm(distance: np.ndarray) -> list[int]:
    return [9999 if np.isnan(d) else round(1000 * d) for d in distance]


ENCODERS: dict[str, Callable[[int, float, np.ndarray, np.ndarray], bytes]] = {
    "place-rings": _frame,
    "esp32": _esp32,
    "text": _text,
}


class SimulatedRing:
    """Electronics of a ring at ``path``, a link to a pseudo-terminal that exists while the ring is
    plugged in. ``serial`` is the serial number of its board, 0 if it has none.

    Attributes for fault injection: ``silent`` sends nothing; ``corrupt`` is the share of changed
    bytes; ``disorder`` the share of frames that are held back until after the next one; ``garble``
    sends the frames of another firmware; ``failed`` and ``frozen`` are the shares of sensors that
    report failure or repeat their last distance; ``near`` is the distance of the first sensor, m.
    """

    def __init__(
        self, path: Path, encoding: str, rng: np.random.Generator, serial: int = 0
    ) -> None:
        self.path, self._encode, self._rng = path, ENCODERS[encoding], rng
        self.serial = serial if encoding == "place-rings" else 0
        self._last: tuple[np.ndarray, np.ndarray] | None = None
        self.sent, self.dropped, self._held = 0, 0, b""
        self._ends: tuple[int, ...] = ()
        self._left = b""
        self.cure()

    def cure(self) -> None:
        """Remove all injected faults."""
        self.silent, self.garble, self.corrupt, self.disorder = False, False, 0.0, 0.0
        self.failed, self.frozen, self.near = 0.0, 0.0, float("nan")
        if not self._ends:
            self.plug()

    def exchange(self, serial: int) -> None:
        """Continue as another board, which has just started, without a gap."""
        self.serial, self.sent = serial, 0

    def plug(self) -> None:
        """Appear, as a device that starts."""
        self.unplug()
        self._ends, self.sent = pty.openpty(), 0
        tty.setraw(self._ends[1])
        os.set_blocking(self._ends[0], False)
        there = self.path.with_suffix(".new")
        there.unlink(missing_ok=True)
        there.symlink_to(os.ttyname(self._ends[1]))
        there.rename(self.path)

    def unplug(self) -> None:
        """Disappear."""
        self.path.unlink(missing_ok=True)
        for end in self._ends:
            os.close(end)
        self._ends, self._left = (), b""

    def flush(self) -> bool:
        """Send what the port did not take at once; return whether anything is left. A port takes
        less than a large frame at a time.
        """
        with suppress(BlockingIOError):
            while self._left and self._ends:
                self._left = self._left[os.write(self._ends[0], self._left) :]
        return bool(self._left)

    def send(
        self,
        clock: float,
        distance: Float[np.ndarray, "*grid"],
        status: Int[np.ndarray, "*grid"],
    ) -> None:
        """Send a frame with the injected faults; it is dropped if nobody reads. Only the protocol
        of this toolkit has zones: other encodings send the nearest.
        """
        sequence, self.sent = self.sent, self.sent + 1
        if distance.ndim > 1 and self._encode is not _frame:
            distance, status = Zones.of(distance, status).nearest()
        distance, status = self._measured(distance, status)
        if self.silent or not self._ends:
            return
        data = (
            self._rng.bytes(len(distance) * 3)
            if self.garble
            else self._encode(sequence, clock, distance, status)
        )
        if self.serial and sequence % _HELLO_EVERY == 0 and not self.garble:
            data = hello(len(distance), self.serial) + data
        if self.disorder and not self._held and self._rng.random() < self.disorder:
            self._held = data
            return
        data, self._held = data + self._held, b""
        if self.corrupt:
            changed = np.frombuffer(data, np.uint8).copy()
            where = self._rng.random(len(changed)) < self.corrupt
            changed[where] ^= self._rng.integers(1, 256, where.sum(), dtype=np.uint8)
            data = changed.tobytes()
        if self.flush():
            self.dropped += 1
            return
        self._left = data
        self.flush()

    def _measured(
        self, distance: Float[np.ndarray, "*grid"], status: Int[np.ndarray, "*grid"]
    ) -> tuple[Float[np.ndarray, "*grid"], Int[np.ndarray, "*grid"]]:
        """Apply the injected faults of the sensors, beginning with the first sensor."""
        number = np.arange(len(distance)).reshape(-1, *[1] * (distance.ndim - 1))
        if self._last is not None:
            kept = number < round(self.frozen * len(distance))
            distance, status = (
                np.where(kept, old, new)
                for old, new in zip(self._last, (distance, status), strict=True)
            )
        self._last = distance, status
        if not np.isnan(self.near):
            first = number == 0
            distance = np.where(first, self.near, distance)
            status = np.where(first, Status.VALID, status)
        failed = number < round(self.failed * len(distance))
        return np.where(failed, np.nan, distance), np.where(failed, Status.FAILED, status)
