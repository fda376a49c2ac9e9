"""What a rig told, gathered while it runs or from a recording: the same pieces make the same
readings.
"""

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
from ..rings.health import Event, Line, Port
from ..rings.protocol import Counts, Frame
from ..robot.state import State
from ..robot.vetting import GAP, STALE, LinkFaultError, Vetting, between

_LONGEST = 0.05  # s between what a ring's clock says and its arrival: beyond, the arrival is taken


@dataclass
class Gathered:
    """states: of the robot, all good. frames: (ring, frame) of each ring in its order. events: of
    rings' lines. fault: of the link, with what it was. said: what was kept beside, as a check wrote
    it. counts: of each ring's line, at the end. patience: factor of how far states may be apart
    between which joints are interpolated, and of delays that are believed; 1 for a real rig."""

    states: list[State] = field(default_factory=list)
    frames: list[tuple[int, Frame]] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    fault: LinkFaultError | None = None
    said: list[tuple[float, dict[str, Any]]] = field(default_factory=list)
    counts: list[Counts] = field(default_factory=list)
    patience: float = 1.0
    lock: threading.Lock = field(default_factory=threading.Lock)

    def take(self, piece: Frame | Event | State, ring: int = 0) -> None:
        """One more; from any thread."""
        with self.lock:
            if isinstance(piece, State):
                self.states.append(piece)
            elif isinstance(piece, Frame):
                self.frames.append((ring, piece))
            else:
                self.events.append(piece)

    def clocks(self, rings: int) -> list[Alignment | None]:
        """Each ring's clock against the host's; None where it sends none, or too few."""
        alignments = list[Alignment | None]()
        for ring in range(rings):
            frames = [f for at, f in self.frames if at == ring and not np.isnan(f.clock)]
            alignments.append(
                align(np.array([f.time for f in frames]), np.array([f.clock for f in frames]))
            )
        return alignments

    def clock(self) -> Alignment | None:
        """The robot's clock against the host's."""
        return align(
            np.array([s.time for s in self.states]), np.array([s.clock for s in self.states])
        )

    def rows(
        self, rings: int, since: float = -np.inf, until: float = np.inf
    ) -> tuple[np.ndarray, ...]:
        """Readings of frames that came from ``since`` to ``until`` s: time (n,) s, joints (n, 6)
        rad, ring (n,), sensor (n,), distance (n,) m, status (n,).

        A frame's time is that of its ring's clock on the host's, or of its arrival where the ring
        sends none. Frames around which the robot was not heard of twice in time are left out.
        """
        some = [(ring, frame) for ring, frame in self.frames if since <= frame.time < until]
        some.sort(key=lambda pair: (pair[1].time, pair[0]))  # threads took turns by chance
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
    """When the frames of rings were measured, s of the host's monotonic clock; their arrivals where
    these are ``longest`` s and more beyond what the rings' clocks say."""
    ring = np.array([number for number, _ in some], int)
    arrival, clock = np.array([(f.time, f.clock) for _, f in some], float).reshape(-1, 2).T
    times = arrival.copy()
    for number, alignment in enumerate(clocks):
        if alignment:
            here = (ring == number) & np.isfinite(clock)
            host = alignment.host(clock[here])
            # else the ring had restarted
            sure = np.abs(host - arrival[here]) <= longest + 4 * alignment.jitter
            times[here] = np.where(sure, host, arrival[here])
    return times


def replay(recorded: RecordingReader, ports: Sequence[Port], stale: float = STALE) -> Gathered:
    """What was gathered when it was recorded: all bytes and states go the same way again, with the
    link's ``stale`` s.

    Events are those that were found then, as what nobody sent leaves no bytes. A record that cannot
    be read is passed over.
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
