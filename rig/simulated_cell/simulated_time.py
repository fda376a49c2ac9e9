"""A mount check in simulated time: what a rig sends, and when it arrives on a busy machine, without
waiting.

The robot travels from stop to stop and stands at each until enough frames have arrived. All rings
measure at a fixed rate, also on the way. Frames and states wait for the machine before the check
receives them, and none overtakes another. Everything then passes through the code of a real check:
the rings' decoders and lines, the vetting of states, and the notes that tell which readings belong
to which stop.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy import stats

from ..recording.records import Kind, Record
from ..rings.line_monitor import Line, Port
from ..rings.protocol import Counts, Frame, encode
from ..robot.state import State
from ..robot.vetting import STALE, Vetting
from ..sensing.readings import Readings
from ..session.gathering import Gathered
from .world import World

_BEGIN = 100.0  # s of the host's clock
_RING_CLOCK, _RING_RATE = 5.0, 1 - 40e-6  # start, s, and rate of the rings' clocks
_ROBOT_CLOCK, _ROBOT_RATE = 1000.0, 1 + 30e-6  # the same of the robot's
_HOME = 2.0  # s that the robot stands before it moves
_BEFORE = 0.6  # s; no frame's time is known worse


@dataclass(frozen=True)
class Lateness:
    """Delays of what arrives: a random process in time with a measured distribution.

    A delay is a quantile of the distribution at the normal probability of a process whose
    correlation falls with time as exp(-t / ``memory``), because a machine that is busy now still is
    a moment later.
    """

    share: tuple[float, ...] = (0.0, 1.0)
    """Probabilities, ascending from 0 to 1."""
    seconds: tuple[float, ...] = (0.0, 0.0)
    """The delay that is not exceeded with each probability, s."""
    memory: float = 0.1
    """Time in which the correlation falls to 1/e, s."""

    def drawn(self, rng: np.random.Generator, count: int, step: float) -> Float[np.ndarray, " n"]:
        """Return ``count`` consecutive delays, ``step`` s apart, in s."""
        kept = math.exp(-step / self.memory)
        z = rng.normal(size=count)
        for i in range(1, count):
            z[i] = kept * z[i - 1] + math.sqrt(1 - kept * kept) * z[i]
        delays: np.ndarray = np.interp(stats.norm.cdf(z), self.share, self.seconds)
        return delays


PROMPT = Lateness()
BUSY = Lateness(
    (0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.98, 0.99, 0.995, 0.999, 1.0),
    (0.0, 0.0007, 0.0032, 0.0077, 0.0228, 0.0517, 0.0736, 0.099, 0.1207, 0.1596, 0.2316, 0.3348),
)
"""Delays of 2,957 frames of a ring, beside eight busy processes on two cores, relative to the
quickest, measured once. The correlation of two frames
0.04 s apart was 0.58, 0.2 s apart 0.24.
"""


@dataclass(frozen=True)
class Pace:
    """Rates and speeds of a simulated mount check."""

    frames: float = 25.0
    """Frames per second of each ring."""
    states: float = 125.0
    """States per second of the robot."""
    speed: float = math.radians(60.0)
    """Speed of the leading joint, rad/s."""
    acceleration: float = math.radians(120.0)
    """Its acceleration, rad/s²."""
    settle: float = 0.3
    """Time that the robot stands at a stop before readings count, s."""
    look: float = 0.02
    """Time between two looks at the number of frames, s."""
    patience: float = 100.0
    """Factor on the time limits of the rings' lines, as in ``Port``."""


class Way:
    """The robot's motion: from the first of P joint vectors to the last, with a stand at each."""

    def __init__(self, pace: Pace, start: Float[np.ndarray, " J"]) -> None:
        self._pace, self._knots = pace, [(_BEGIN, start, start, 0.0)]
        self.end = _BEGIN + _HOME

    def move(self, q: Float[np.ndarray, " J"]) -> float:
        """Add a motion to ``q`` (J,) rad that begins at ``end``; return its end, s."""
        before = self._knots[-1][2]
        self._knots.append((self.end, before, q, float(np.abs(q - before).max())))
        self.end += self._duration(self._knots[-1][3])
        return self.end

    def _duration(self, way: float) -> float:
        v, a = self._pace.speed, self._pace.acceleration
        return way / v + v / a if way > v * v / a else 2 * math.sqrt(way / a)

    def at(self, time: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n J"]:
        """Return the joint angles (n, J) rad at ``time`` (n,) s: a trapezoid of speed."""
        begin = np.array([knot[0] for knot in self._knots])
        which = np.maximum(np.searchsorted(begin, time, "right") - 1, 0)
        start, goal = (np.array([knot[k] for knot in self._knots])[which] for k in (1, 2))
        way = np.array([knot[3] for knot in self._knots])[which]
        a = self._pace.acceleration
        whole = np.array([self._duration(knot[3]) for knot in self._knots])[which]
        since = np.clip(time - begin[which], 0.0, whole)
        ramp = np.minimum(self._pace.speed / a, whole / 2)
        rest = np.minimum(np.maximum(since - ramp, 0.0), np.maximum(whole - 2 * ramp, 0.0))
        slow = np.maximum(since - (whole - ramp), 0.0)
        first = np.minimum(since, ramp)
        gone = a * (first**2 / 2 + ramp * rest + ramp * slow - slow**2 / 2)
        share = np.where(way > 0, gone / np.where(way > 0, way, 1.0), 0.0)
        q: np.ndarray = start + np.clip(share, 0.0, 1.0)[:, None] * (goal - start)
        return q


def mount_check(
    world: World,
    joints: Float[np.ndarray, "P J"],
    frames: int,
    rng: np.random.Generator,
    lateness: Lateness = PROMPT,
    pace: Pace | None = None,
) -> Gathered:
    """Return what a mount check at the stops ``joints`` receives.

    Args:
        world: the rings as mounted.
        joints: (P, J) rad, the stops.
        frames: frames to wait for at each stop.
        rng: random numbers of noise and delays.
        lateness: delays of frames, and of states.
        pace: rates and speeds.
    """
    pace = pace or Pace()
    most = _longest(joints, frames, pace)
    sent = _BEGIN + np.arange(math.ceil(most * pace.frames)) / pace.frames
    arrived = _arrivals(sent, lateness, rng, 1 / pace.frames)
    gathered = Gathered(patience=pace.patience)
    start = world.scene.robot.unwound(world.scene.poses[0].q)
    way, steps = Way(pace, start), list[tuple[float, float]]()
    for number, q in enumerate(joints):
        noticed = way.move(q) + float(lateness.drawn(rng, 1, 1.0)[0])
        begin = noticed + pace.settle
        have = int(np.searchsorted(arrived, begin, "right"))
        looked = math.ceil((arrived[have + frames] - begin) / pace.look) * pace.look
        gathered.said.append((begin, {"what": "begin", "step": "mount", "number": number}))
        way.end = begin + looked + float(lateness.drawn(rng, 1, 1.0)[0])
        gathered.said.append((way.end, {"what": "end"}))
        steps.append((begin, way.end))
    gathered.said.append((way.end, {"what": "ended", "why": ""}))
    _states(gathered, way, rng, lateness, pace)
    some = sent <= way.end
    passed: dict[int, tuple[list[Frame], Counts]] = {}  # all rings send and arrive at once
    for ring, group in enumerate(world.mounted.groups):
        if group.count not in passed:
            passed[group.count] = _passed(group.count, sent[some], arrived[some], pace)
        frames_of, counts = passed[group.count]
        gathered.frames += [(ring, frame) for frame in frames_of]
        gathered.counts.append(counts)
    gathered.frames = _measured(world, way, gathered.frames, sent, steps, rng)
    return gathered


def _longest(joints: Float[np.ndarray, "P J"], frames: int, pace: Pace) -> float:
    """Return a time that no check exceeds, s."""
    turn = 4 * math.pi / pace.speed + pace.speed / pace.acceleration
    return _HOME + len(joints) * (turn + pace.settle + 10 * frames / pace.frames + 5.0)


def _arrivals(
    sent: Float[np.ndarray, " n"], lateness: Lateness, rng: np.random.Generator, step: float
) -> Float[np.ndarray, " n"]:
    """Return when pieces sent at ``sent`` (n,) s arrive; none overtakes another."""
    latest: np.ndarray = np.maximum.accumulate(sent + lateness.drawn(rng, len(sent), step))
    return latest


def _states(
    gathered: Gathered, way: Way, rng: np.random.Generator, lateness: Lateness, pace: Pace
) -> None:
    """Add the robot's states."""
    sent = np.arange(_BEGIN, way.end, 1 / pace.states)
    arrived, q = _arrivals(sent, lateness, rng, 1 / pace.states), way.at(sent)
    speed = np.gradient(q, 1 / pace.states, axis=0)
    vetting = Vetting(STALE * 100)  # a busy machine would end the link to a real robot
    for t, at, joints, rate in zip(sent, arrived, q, speed, strict=True):
        state = State(at, _ROBOT_CLOCK + _ROBOT_RATE * (t - _BEGIN), joints, rate)
        gathered.take(vetting.take(Record(Kind.STATE, 0, at, state.pack())))


def _passed(
    count: int, sent: Float[np.ndarray, " n"], arrived: Float[np.ndarray, " n"], pace: Pace
) -> tuple[list[Frame], Counts]:
    """Return the frames, still without distances, that the line of a ring of ``count`` sensors
    passes on, and the line's counts.
    """
    line, frames = Line(0, Port("", count, patience=pace.patience), _BEGIN), list[Frame]()
    none, fine = np.ones(count), np.zeros(count, int)
    for i, (t, at) in enumerate(zip(sent, arrived, strict=True)):
        data = encode(i, _RING_CLOCK + _RING_RATE * (t - _BEGIN), none, fine)
        frames += [each for each in line.take(data, at) if isinstance(each, Frame)]
    return frames, line.counts


def _measured(
    world: World,
    way: Way,
    frames: list[tuple[int, Frame]],
    sent: Float[np.ndarray, " n"],
    steps: Sequence[tuple[float, float]],
    rng: np.random.Generator,
) -> list[tuple[int, Frame]]:
    """Return the frames with what the sensors read where the robot was when they were sent; frames
    sent longer than ``_BEFORE`` before a step, which cannot count for it, keep no distance.
    """
    index: Int[np.ndarray, " f"] = np.array([frame.sequence for _, frame in frames])
    used = np.zeros(len(sent), bool)
    for begin, end in steps:
        used |= (sent >= begin - _BEFORE) & (sent <= end)
    poses, which = np.unique(way.at(sent[used]), axis=0, return_inverse=True)
    true = np.full((len(sent), world.mounted.sensors), np.nan)
    true[used] = world.distances(poses)[which.ravel()]
    distance, status = world.told(rng, true)
    wires = world.mounted.slices
    return [
        (ring, replace(f, distance=distance[i, wires[ring]], status=status[i, wires[ring]]))
        for (ring, f), i in zip(frames, index, strict=True)
    ]


def counted(readings: Readings, gathered: Gathered) -> Readings:
    """Select the readings of the steps that a simulated mount check noted."""
    notes = gathered.said[:-1]  # the last one ends the check
    counts = np.zeros(len(readings), bool)
    for (begin, _), (end, _) in zip(notes[::2], notes[1::2], strict=True):
        counts |= (readings.time >= begin) & (readings.time <= end)
    return readings.only(counts)
