"""A robot and its rings, listened to at once, gathered and recorded."""

import json
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Self

from ..recording.recording import Recording
from ..recording.records import Kind, Record
from ..rings.health import Event, Port
from ..rings.ports import Rings
from ..rings.protocol import Frame
from ..robot.link import RATE, START, Link
from ..robot.vetting import LinkFaultError
from .gathering import Gathered


class Session:
    """Listens from its making to its end. gathered: what came. link, rings: to look at while it
    runs.

    Args:
        host: of the robot.
        ports: of its rings, in the setup's order.
        recording: keeps everything; closed with the session.
        on_event: is given what happens to a ring's line, from that line's thread.
        rate, start: of the link.
        patience: factor of all limits of time; 1 for a real rig.
    """

    def __init__(
        self,
        host: str,
        ports: Sequence[Port],
        recording: Recording | None = None,
        on_event: Callable[[Event], None] = lambda event: None,
        rate: float = RATE,
        start: float = START,
        patience: float = 1.0,
    ) -> None:
        self.patience = patience
        self.gathered, self._recording, self._on_event = (
            Gathered(patience=patience),
            recording,
            on_event,
        )
        with ExitStack() as stack:
            if recording:
                stack.enter_context(recording)
            self.link = stack.enter_context(
                Link(
                    host,
                    rate,
                    self.gathered.take,
                    self._record,
                    self._fault,
                    start=start,
                    patience=patience,
                )
            )
            self.rings = stack.enter_context(Rings(ports, self._frame, self._event, self._record))
            self._stack = stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End; what was gathered stays."""
        self._stack.close()
        self.gathered.counts = self.rings.counts

    @property
    def trouble(self) -> str:
        """Why this cannot go on, as a line; empty while it can."""
        if self.link.fault:
            return str(self.link.fault)
        return self._recording.failure if self._recording else ""

    def say(self, what: str, **more: Any) -> None:
        """Keep what the check does, or was told, beside what comes."""
        now, text = time.monotonic(), json.dumps({"what": what, **more})
        with self.gathered.lock:
            self.gathered.said.append((now, json.loads(text)))
        self._record(Record(Kind.EVENT, 0, now, text.encode()))

    def _record(self, record: Record) -> None:
        if self._recording:
            self._recording.put(record)

    def _frame(self, ring: int, frame: Frame) -> None:
        self.gathered.take(frame, ring)

    def _event(self, event: Event) -> None:
        self.gathered.take(event)
        self._record(event.record())
        self._on_event(event)

    def _fault(self, fault: LinkFaultError) -> None:
        self.gathered.fault = fault
        self.say("link ended", why=fault.why.name, detail=fault.detail)
