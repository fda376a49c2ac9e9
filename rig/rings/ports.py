"""Serial ports of the rings, each read in its own thread and reopened after an interruption."""

import threading
import time
from collections.abc import Callable, Sequence

from ...objectives.link_limits import USUAL_LIMITS, LinkLimits
from ..closing import Closing
from ..recording.records import Kind, Record
from .line_monitor import Event, Line, Port
from .protocol import Counts, Frame

_TICK = 0.02  # s, timeout of a read
_RETRY = 0.05  # s between attempts to open a port


class RingReader:
    """Reads ring ``number`` at ``port`` and passes on its frames, its events and all its bytes.

    It reads until ``ended`` is set. It detects a lost port within 20 ms, silence or bytes without a
    valid frame within ``limits.ring_silent`` s of the last frame, and a port that is back within 50
    ms of its appearance; plus the time that the machine takes to wake a thread.
    """

    def __init__(
        self,
        number: int,
        port: Port,
        on_frame: Callable[[int, Frame], None],
        on_event: Callable[[Event], None],
        record: Callable[[Record], None],
        limits: LinkLimits = USUAL_LIMITS,
    ) -> None:
        self._number, self._port = number, port
        self._on_frame, self._on_event, self._record = on_frame, on_event, record
        self.line = Line(number, port, time.monotonic(), limits)
        self._last: Frame | None = None
        self._open, self.ended = False, threading.Event()
        self.thread = threading.Thread(target=self._run, name=f"ring {number}", daemon=True)
        self.thread.start()

    @property
    def starting(self) -> bool:
        """Whether the ring may still be starting: its port is open, as which it may have restarted,
        and no frame of any ring has come yet.
        """
        counts = self.line.counts
        return self._open and not counts.frames and not counts.sizes

    def latest(self) -> Frame | None:
        """Return the newest frame if it is fresh, else None."""
        frame = self._last
        fresh = frame and time.monotonic() - frame.time <= self.line.silent
        return frame if fresh else None

    def _run(self) -> None:
        import serial  # only when there is a ring to read

        while not self.ended.is_set():
            try:
                with serial.Serial(
                    self._port.name, self._port.baud, timeout=_TICK, exclusive=True
                ) as port:
                    self.line.opened(now := time.monotonic())
                    self._record(Record(Kind.OPENED, self._number, now))
                    self._open = True
                    while not self.ended.is_set():
                        data = port.read(1)
                        self._take(
                            data + port.read(port.in_waiting) if data else b"", time.monotonic()
                        )
            except (OSError, ValueError) as error:  # serial.SerialException is an OSError
                self._last, self._open = None, False
                for event in self.line.gone(time.monotonic(), str(error)):
                    self._on_event(event)
                self.ended.wait(_RETRY)

    def _take(self, data: bytes, now: float) -> None:
        if data:
            self._record(Record(Kind.BYTES, self._number, now, data))
        for found in self.line.take(data, now):
            if isinstance(found, Frame):
                self._last = found
                self._on_frame(self._number, found)
            else:
                self._on_event(found)


class RingReaders(Closing):
    """All rings of a rig. ``sizes`` holds the number of sensors of each.

    Args:
        ports: of the rings, in the setup's order.
        on_frame: receives a ring's number and each of its frames, in the ring's thread.
        on_event: receives the events of the lines, in their threads.
        record: receives all bytes as they arrive.
        limits: of the links.
    """

    def __init__(
        self,
        ports: Sequence[Port],
        on_frame: Callable[[int, Frame], None] = lambda ring, frame: None,
        on_event: Callable[[Event], None] = lambda event: None,
        record: Callable[[Record], None] = lambda record: None,
        limits: LinkLimits = USUAL_LIMITS,
    ) -> None:
        self.sizes = [port.count for port in ports]
        self._readers = [
            RingReader(i, port, on_frame, on_event, record, limits) for i, port in enumerate(ports)
        ]

    @property
    def counts(self) -> list[Counts]:
        """Counts of each line."""
        return [reader.line.counts for reader in self._readers]

    def latest(self) -> list[Frame | None]:
        """Return each ring's newest frame; None where it is not fresh."""
        return [reader.latest() for reader in self._readers]

    @property
    def starting(self) -> list[int]:
        """Numbers of the rings that may still be starting."""
        return [i for i, reader in enumerate(self._readers) if reader.starting]

    def wait(self, seconds: float) -> bool:
        """Wait for a frame of every ring; return whether all arrived within ``seconds``."""
        until = time.monotonic() + seconds
        while (deaf := None in self.latest()) and time.monotonic() < until:
            time.sleep(_TICK)
        return not deaf

    def close(self) -> None:
        """Stop reading."""
        for reader in self._readers:
            reader.ended.set()
        for reader in self._readers:
            reader.thread.join()
