"""Data of a rig, collected live or from a recording: the same input gives the same readings."""

import json
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from ..recording.clocks import Alignment, align
from ..recording.recording import RecordingReader
from ..recording.records import Kind
from ..rings.line_monitor import Event, Line, Port
from ..rings.protocol import Counts, Frame
from ..robot.state import State
from ..robot.vetting import GAP, STALE, LinkFaultError, Vetting, between

_LONGEST = 0.05  # s; if clock and arrival of a frame differ by more, the arrival is used


@dataclass
class Gathered:
    """The data that a rig has sent, and the events of its lines."""

    states: list[State] = field(default_factory=list)
    """Valid states of the robot."""
    frames: list[tuple[int, Frame]] = field(default_factory=list)
    """Pairs (ring, frame), in order of arrival for each ring."""
    events: list[Event] = field(default_factory=list)
    """Events of the rings' lines."""
    fault: LinkFaultError | None = None
    """The fault that ended the robot's link; None while the link works."""
    said: list[tuple[float, dict[str, Any]]] = field(default_factory=list)
    """Notes of the check: (time in s, content)."""
    counts: list[Counts] = field(default_factory=list)
    """Counts of each ring's line, set when the session closes."""
    patience: float = 1.0
    """Factor on the largest gap between states for interpolation, and on the largest accepted
    delay; 1 for a real rig.
    """
    lock: threading.Lock = field(default_factory=threading.Lock)
    """Guards all lists."""

    def take(self, piece: Frame | Event | State, ring: int = 0) -> None:
        """Add one item; safe to call from any thread."""
        with self.lock:
            if isinstance(piece, State):
                self.states.append(piece)
            elif isinstance(piece, Frame):
                self.frames.append((ring, piece))
            else:
                self.events.append(piece)

    def clocks(self, rings: int) -> list[Alignment | None]:
        """Align each ring's clock with the host's; None if it sends no clock or too few frames."""
        alignments = list[Alignment | None]()
        for ring in range(rings):
            frames = [f for at, f in self.frames if at == ring and not np.isnan(f.clock)]
            alignments.append(
                align(np.array([f.time for f in frames]), np.array([f.clock for f in frames]))
            )
        return alignments

    def clock(self) -> Alignment | None:
        """Align the robot's clock with the host's."""
        return align(
            np.array([s.time for s in self.states]), np.array([s.clock for s in self.states])
        )

    def rows(
        self, rings: int, since: float = -np.inf, until: float = np.inf
    ) -> tuple[np.ndarray, ...]:
        """Return the readings of frames that arrived from ``since`` to ``until`` s.

        A frame's time is its ring's clock converted to the host's clock, or its arrival if the ring
        sends no clock. Frames without a robot state shortly before and after them are omitted.

        Returns:
            time (n,) s, joints (n, 6) rad, ring (n,), sensor (n,), distance (n,) m, status (n,).
        """
        some = [(ring, frame) for ring, frame in self.frames if since <= frame.time < until]
        some.sort(key=lambda pair: (pair[1].time, pair[0]))  # the order of threads is random
        times = _times(some, self.clocks(rings), _LONGEST * self.patience)
        joints = between(self.states, times, GAP * self.patience)
        sure = np.isfinite(joints).all(axis=1)
        kept = [pair for pair, good in zip(some, sure, strict=True) if good]
        count = np.array([len(frame.distance) for _, frame in kept], int)
        parts = [
            (np.full(len(f.distance), ring), np.arange(len(f.distance)), f.distance, f.status)
            for ring, f in kept
        ]
        empty = (np.zeros(0, int), np.zeros(0, int), np.zeros(0), np.zeros(0, int))
        ring, sensor, distance, status = (
            np.concatenate(column) for column in zip(*(parts or [empty]), strict=True)
        )
        return (
            np.repeat(times[sure], count),
            np.repeat(joints[sure], count, axis=0),
            ring,
            sensor,
            distance,
            status,
        )


def _times(
    some: Sequence[tuple[int, Frame]], clocks: Sequence[Alignment | None], longest: float
) -> Float[np.ndarray, " n"]:
    """Return when the rings' frames were measured, s of the host's monotonic clock.

    If a ring's clock and a frame's arrival differ by more than ``longest`` s plus four times the
    jitter, the arrival is used.
    """
    ring = np.array([number for number, _ in some], int)
    arrival, clock = np.array([(f.time, f.clock) for _, f in some], float).reshape(-1, 2).T
    times = arrival.copy()
    for number, alignment in enumerate(clocks):
        if alignment:
            here = (ring == number) & np.isfinite(clock)
            host = alignment.host(clock[here])
            # otherwise the ring had restarted
            sure = np.abs(host - arrival[here]) <= longest + 4 * alignment.jitter
            times[here] = np.where(sure, host, arrival[here])
    return times


def replay(recorded: RecordingReader, ports: Sequence[Port], stale: float = STALE) -> Gathered:
    """Collect the data of a recording: all bytes and states pass through the same code again.

    Events come from the recording, because silence leaves no bytes to replay. Unreadable records
    are skipped.

    Args:
        recorded: the recording.
        ports: of the rings, in the setup's order.
        stale: maximum age of a robot's state, s.
    """
    gathered, vetting, lines = Gathered(patience=stale / STALE), Vetting(stale), dict[int, Line]()
    for record in recorded.records():
        match record.kind:
            case Kind.STATE | Kind.NOTE | Kind.CLOSED if gathered.fault is None:
                try:
                    gathered.take(vetting.take(record))
                except LinkFaultError as fault:
                    fault.time, gathered.fault = record.time, fault
            case Kind.BYTES if record.source < len(ports):
                line = lines.setdefault(
                    record.source, Line(record.source, ports[record.source], record.time)
                )
                for each in line.take(record.data, record.time):
                    if isinstance(each, Frame):
                        gathered.take(each, record.source)
            case Kind.OPENED if record.source in lines:
                lines[record.source].opened(record.time)
            case Kind.HAPPENED:
                with suppress(ValueError):
                    gathered.take(Event.of(record))
            case Kind.EVENT:
                with suppress(ValueError):
                    if isinstance(said := json.loads(record.data), dict):
                        gathered.said.append((record.time, said))
    gathered.counts = [lines[i].counts if i in lines else Counts() for i in range(len(ports))]
    return gathered
