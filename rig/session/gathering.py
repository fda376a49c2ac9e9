"""Data of a rig, collected live or from a recording: the same input gives the same readings."""

import json
import math
import threading
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Self

import numpy as np
from jaxtyping import Float

from ...coverage.robots.robot import Robot
from ...objectives.link_limits import USUAL_LIMITS, LinkLimits
from ..recording.clocks import Alignment, align
from ..recording.records import Kind, Record
from ..rings.line_monitor import LATE, Event, Line, Port
from ..rings.protocol import ABSENT, Counts, Frame
from ..robot.state import State
from ..robot.vetting import GAP, LinkFaultError, Vetting, between
from ..sensing.readings import Readings
from .retention import Retention

_TURN = 1 << 16  # of frame numbers
_BATCH = 1000  # states after which data is thinned out
# s; the quickest of a ring's frames keep to a steady rate so closely, if its firmware has one
_STEADY = 0.01


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
    late: float = LATE
    """Largest delay of a frame that is used, s."""
    patience: float = 1.0
    """Factor on the largest gap between states for interpolation, and on the largest accepted
    delay; 1 for a real rig.
    """
    standing: float = 0.0
    """Gap between states, s, over which a robot at the same place before and after it stood still.
    """
    retention: Retention | None = None
    """Leaves out data that no step reads; None keeps all."""
    lock: threading.Lock = field(default_factory=threading.Lock)
    """Guards all lists."""

    _received: int = 0

    @classmethod
    def of(cls, limits: LinkLimits, patience: float, thinned: bool) -> Self:
        """Return a session's data before any arrives.

        Args:
            limits: of the links.
            patience: factor on all time limits; 1 for a real rig.
            thinned: leave out what no step reads.
        """
        margin = 1.0 + patience * (2 * limits.ring_late + GAP)
        retention = Retention(margin) if thinned else None
        return cls(late=limits.ring_late, patience=patience, retention=retention)

    def take(self, piece: Frame | Event | State, ring: int = 0) -> None:
        """Add one item; safe to call from any thread."""
        with self.lock:
            if isinstance(piece, State):
                self.states.append(piece)
                self._received += 1
                if self.retention and self._received % _BATCH == 0:
                    self.retention.discard(self.states, self.frames, piece.time)
            elif isinstance(piece, Frame):
                self.frames.append((ring, piece))
            else:
                self.events.append(piece)

    def note(self, time: float, said: dict[str, Any]) -> None:
        """Add a note of the check, made at ``time`` s; safe to call from any thread."""
        with self.lock:
            self.said.append((time, said))
            if self.retention:
                self.retention.note(time, said)

    def notes(self, what: str) -> list[dict[str, Any]]:
        """Return the notes of a kind."""
        return [said for _, said in self.said if said.get("what") == what]

    def settle(self) -> None:
        """Note that nothing more arrives."""
        with self.lock:
            if self.retention:
                self.retention.discard(self.states, self.frames)

    @property
    def state_count(self) -> int:
        """Number of states received."""
        return len(self.states) + (self.retention.states if self.retention else 0)

    def snapshot(self, counts: list[Counts]) -> "Gathered":
        """Return the data received so far, with the counts of each ring's line."""
        with self.lock:
            return replace(
                self,
                states=list(self.states),
                frames=list(self.frames),
                events=list(self.events),
                said=list(self.said),
                counts=counts,
                retention=None,
                lock=threading.Lock(),
            )

    def clocks(self, rings: int) -> list[Alignment | None]:
        """Align each ring's clock with the host's, in its longest time without a restart or jump;
        None if it sends no clock or too few frames.
        """
        longest = list[Alignment | None]()
        groups = {key: some for key, some in _eras(self.frames).items() if key.clock}
        for ring in range(rings):
            mine = [(len(some), key) for key, some in groups.items() if key.ring == ring]
            frames = [self.frames[i][1] for i in groups[max(mine)[1]]] if mine else []
            times, clocks = ([getattr(f, name) for f in frames] for name in ("time", "clock"))
            longest.append(align(np.array(times), np.array(clocks)))
        return longest

    def clock(self) -> Alignment | None:
        """Align the robot's clock with the host's; None if it sends no clock or too few states."""
        states = [s for s in self.states if not np.isnan(s.clock)]
        return align(np.array([s.time for s in states]), np.array([s.clock for s in states]))

    def times(self) -> Float[np.ndarray, " n"]:
        """Return when each frame was measured, s; see ``readings``."""
        return _times(self.frames, self.late * self.patience)

    def readings(self) -> Readings:
        """Return the readings of all frames.

        A frame's time is its ring's clock converted to the host's clock. For a ring that sends no
        clock, the numbers of its frames are its clock if they come at a steady rate; else a frame's
        time is its arrival. Frames without a robot state shortly before and after them are omitted.
        """
        # the order of threads is random
        order = sorted(
            range(len(self.frames)), key=lambda i: (self.frames[i][1].time, self.frames[i][0])
        )
        times = self.times()[order]
        joints = between(self.states, times, GAP * self.patience, self.standing)
        sure = np.isfinite(joints).all(axis=1)
        kept = [self.frames[i] for i, good in zip(order, sure, strict=True) if good]
        there = [np.flatnonzero(frame.status != ABSENT) for _, frame in kept]
        count = np.array([len(k) for k in there], int)
        parts = [
            (np.full(len(k), ring), k, f.distance[k], f.status[k])
            for (ring, f), k in zip(kept, there, strict=True)
        ]
        empty = (np.zeros(0, int), np.zeros(0, int), np.zeros(0), np.zeros(0, int))
        rows = map(np.concatenate, zip(*(parts or [empty]), strict=True))
        ring, sensor, distance, status = rows
        time, joints = np.repeat(times[sure], count), np.repeat(joints[sure], count, axis=0)
        zones = _zones([frame for _, frame in kept], there)
        return Readings(time, joints, ring, sensor, distance, status, *zones)


def _zones(frames: Sequence[Frame], there: Sequence[np.ndarray]) -> tuple[Any, Any]:
    """Return distance (n, Z) m and status (n, Z) of the zones of the sensors ``there`` in each
    frame: ``ABSENT`` beyond a sensor's own; None and None if no ring sends zones.
    """
    most = max((f.zones.grid.zones for f in frames if f.zones), default=0)
    if not most:
        return None, None
    size = sum(map(len, there))
    distance = np.full((size, most), np.nan, np.float32)
    status, at = np.full((size, most), ABSENT, np.uint8), 0
    for frame, k in zip(frames, there, strict=True):
        if frame.zones is not None:
            here = (slice(at, at + len(k)), slice(frame.zones.grid.zones))
            distance[here], status[here] = (a[k] for a in frame.zones.first())
        at += len(k)
    return distance, status


class _Era(NamedTuple):
    """Frames of a ring that share a clock."""

    ring: int
    number: int
    clock: bool


def _eras(frames: Sequence[tuple[int, Frame]]) -> dict[_Era, list[int]]:
    """Return the indices of the frames of each ring in each of its eras."""
    eras: dict[_Era, list[int]] = {}
    for i, (ring, frame) in enumerate(frames):
        eras.setdefault(_Era(ring, frame.era, not math.isnan(frame.clock)), []).append(i)
    return eras


def _times(frames: Sequence[tuple[int, Frame]], longest: float) -> Float[np.ndarray, " n"]:
    """Return when the rings' frames were measured, s of the host's monotonic clock.

    Each ring's clock is aligned anew in each era. If a clock and a frame's arrival differ by more
    than ``longest`` s plus four times the jitter, the arrival is used. Frames without a clock are
    aligned by their numbers, if they come at a steady rate.
    """
    times = np.array([frame.time for _, frame in frames], float)
    for era, index in _eras(frames).items():
        mine, arrival = [frames[i][1] for i in index], times[index]
        clock = np.array([frame.clock for frame in mine]) if era.clock else _counted(mine)
        alignment = align(arrival, clock)
        if alignment and (era.clock or alignment.spread <= _STEADY):
            host = alignment.host(clock)
            sure = np.abs(host - arrival) <= longest + 4 * alignment.jitter
            times[index] = np.where(sure | (not era.clock), host, arrival)
    return times


def _counted(frames: Sequence[Frame]) -> Float[np.ndarray, " n"]:
    """Return the number of each frame times their mean period, s."""
    step = np.diff([frame.sequence for frame in frames], prepend=frames[0].sequence)
    number = np.cumsum(step % _TURN).astype(float)
    counted: np.ndarray = number * (frames[-1].time - frames[0].time) / max(number[-1], 1.0)
    return counted


def replay(
    records: Iterable[Record],
    ports: Sequence[Port],
    stale: float | None = None,
    limits: LinkLimits = USUAL_LIMITS,
    thinned: bool = False,
    robot: Robot | None = None,
) -> Gathered:
    """Collect the data of recorded records: all bytes and states pass through the same code again.

    Events come from the recording, because silence leaves no bytes to replay. Unreadable records
    are skipped.

    Args:
        records: in the order of arrival.
        ports: of the rings, in the setup's order.
        stale: maximum age of a robot's state, s; by default that of the limits.
        limits: of the links, as the scene states them.
        thinned: leave out what no step reads, as a live check does.
        robot: the robot, whose continuous joints may stand at any angle; None: all have limits.
    """
    stale = limits.state_stale if stale is None else stale
    gathered = Gathered.of(limits, stale / limits.state_stale, thinned)
    vetting, lines = Vetting(stale, robot=robot), dict[int, Line]()
    for record in records:
        match record.kind:
            case Kind.STATE | Kind.NOTE | Kind.CLOSED if gathered.fault is None:
                try:
                    gathered.take(vetting.take(record))
                except LinkFaultError as fault:
                    fault.time, gathered.fault = record.time, fault
            case Kind.BYTES if record.source < len(ports):
                line = lines.setdefault(
                    record.source, Line(record.source, ports[record.source], record.time, limits)
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
                        gathered.note(record.time, said)
    gathered.settle()
    gathered.counts = [lines[i].counts if i in lines else Counts() for i in range(len(ports))]
    return gathered
