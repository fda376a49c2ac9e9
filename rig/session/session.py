"""One session with a robot and its rings: receive, collect and record."""

import json
import time
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any

from ...coverage.robots.robot import Robot
from ...objectives.link_limits import USUAL_LIMITS, LinkLimits
from ..closing import Closing
from ..recording.recording import Recording
from ..recording.records import Kind, Record
from ..rings.line_monitor import Event, Port
from ..rings.ports import RingReaders
from ..rings.protocol import Frame
from ..robot.link import Link
from ..robot.vetting import LinkFaultError
from .gathering import Gathered


class Session(Closing):
    """Receives data from construction to ``close``.

    ``gathered`` holds the data received so far; ``link`` and ``rings`` give live access.

    Args:
        host: name or address of the robot.
        ports: of its rings, in the setup's order.
        recording: stores everything; the session closes it.
        limits: of the links.
        patience: factor on all time limits; 1 for a real rig.
        thinned: keep in memory only what a step reads; a recording has all.
        robot: the robot, whose continuous joints may stand at any angle; None: all have limits.
    """

    def __init__(
        self,
        host: str,
        ports: Sequence[Port],
        recording: Recording | None = None,
        limits: LinkLimits = USUAL_LIMITS,
        patience: float = 1.0,
        thinned: bool = False,
        robot: Robot | None = None,
    ) -> None:
        self.patience = patience
        self.gathered = Gathered.of(limits, patience, thinned)
        self._recording = recording
        with ExitStack() as stack:
            if recording:
                stack.enter_context(recording)
            self.link = stack.enter_context(
                Link(
                    host,
                    limits,
                    self.gathered.take,
                    self._record,
                    self._fault,
                    patience=patience,
                    robot=robot,
                )
            )
            self.rings = stack.enter_context(
                RingReaders(ports, self._frame, self._event, self._record, limits)
            )
            self._stack = stack.pop_all()

    def close(self) -> None:
        """Stop receiving; the collected data stays."""
        self._stack.close()
        self.gathered.counts = self.rings.counts
        self.gathered.settle()

    @property
    def trouble(self) -> str:
        """Why the session cannot continue, as one line; empty while it can."""
        if self.link.fault:
            return str(self.link.fault)
        return self._recording.failure if self._recording else ""

    def say(self, what: str, **more: Any) -> None:
        """Record a note about an action of the check or an answer of the person at the rig."""
        now, text = time.monotonic(), json.dumps({"what": what, **more})
        self.gathered.note(now, json.loads(text))
        self._record(Record(Kind.EVENT, 0, now, text.encode()))

    def _record(self, record: Record) -> None:
        if self._recording:
            self._recording.put(record)

    def _frame(self, ring: int, frame: Frame) -> None:
        self.gathered.take(frame, ring)

    def _event(self, event: Event) -> None:
        self.gathered.take(event)
        self._record(event.record())

    def _fault(self, fault: LinkFaultError) -> None:
        self.gathered.fault = fault
        self.say("link ended", why=fault.why.name, detail=fault.detail)
