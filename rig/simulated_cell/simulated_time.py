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
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy import stats

from ..recording.records import Kind, Record
from ..rings.line_monitor import Port
from ..robot.state import State
from ..robot.vetting import STALE
from ..sensing.readings import Readings
from ..session.gathering import replay
from ..simulated.arm import Arm
from ..simulated.ports import ENCODERS
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


class _Way:
    """The robot's state at each step of time, from ``_BEGIN`` on."""

    def __init__(self, pace: Pace, start: Float[np.ndarray, " 6"]) -> None:
        self._pace, self._arm = pace, Arm(start, 1 / pace.states)
        self.states = [(self._arm.q, self._arm.speed)] * round(_HOME * pace.states)

    @property
    def end(self) -> float:
        """Time of the end, s."""
        return _BEGIN + len(self.states) / self._pace.states

    def move(self, q: Float[np.ndarray, " 6"]) -> None:
        """Add a motion to ``q`` (6,) rad."""
        self._arm.move(q, self._pace.speed, self._pace.acceleration)
        while self._arm.moving:
            self._arm.tick()
            self.states.append((self._arm.q, self._arm.speed))

    def stand(self, until: float) -> None:
        """Stand there until a time, s."""
        self.states += self.states[-1:] * math.ceil((until - self.end) * self._pace.states)

    def at(self, time: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 6"]:
        """Return the joint angles (n, 6) rad at ``time`` (n,) s."""
        step = np.rint((time - _BEGIN) * self._pace.states).astype(int)
        q: np.ndarray = np.array([q for q, _ in self.states])
        return q.take(step, axis=0, mode="clip")


def mount_check(
    world: World,
    joints: Float[np.ndarray, "P J"],
    frames: int,
    rng: np.random.Generator,
    lateness: Lateness = PROMPT,
    pace: Pace | None = None,
) -> Readings:
    """Return the readings that count in a mount check at the stops ``joints``.

    Args:
        world: the rings as mounted.
        joints: (P, J) rad, the stops.
        frames: frames to wait for at each stop.
        rng: random numbers of noise and delays.
        lateness: delays of frames, and of states.
        pace: rates and speeds.
    """
    pace, robot = pace or Pace(), world.scene.robot
    turn = 4 * math.pi / pace.speed + 2 * pace.speed / pace.acceleration  # the longest on the way
    longest = _HOME + len(joints) * (turn + pace.settle + 10 * frames / pace.frames + 5.0)
    sent, arrived = _sent(longest, pace.frames, lateness, rng)
    way, steps = _Way(pace, robot.unwound(world.scene.poses[0].q)), list[tuple[float, float]]()
    for q in joints:
        way.move(q)
        begin = way.end + float(lateness.drawn(rng, 1, 1.0)[0]) + pace.settle
        waited = arrived[int(np.searchsorted(arrived, begin, "right")) + frames] - begin
        end = begin + math.ceil(waited / pace.look) * pace.look
        steps.append((begin, end + float(lateness.drawn(rng, 1, 1.0)[0])))
        way.stand(steps[-1][1])
    times = _sent(way.end - _BEGIN, pace.states, lateness, rng)
    records = list[Record]()
    for (q, speed), t, at in zip(way.states, *times, strict=True):
        state = State(at, _ROBOT_CLOCK + _ROBOT_RATE * (t - _BEGIN), q, speed)
        records.append(Record(Kind.STATE, 0, at, state.pack()))
    sent = sent[sent <= way.end]
    for ring, readings in enumerate(_told(world, way, sent, steps, rng)):
        for i, (t, at, *told) in enumerate(zip(sent, arrived, *readings, strict=False)):
            data = ENCODERS["place-rings"](i, _RING_CLOCK + _RING_RATE * (t - _BEGIN), *told)
            records.append(Record(Kind.BYTES, ring, at, data))
    records.sort(key=lambda record: record.time)
    ports = [Port("", group.count, patience=pace.patience) for group in world.mounted.groups]
    # a busy machine would end the link to a real robot
    gathered = replay(records, ports, 100 * STALE, robot=robot)
    gathered.patience = pace.patience
    received = gathered.readings()
    return received.only(_within(received.time, steps))


def _sent(
    seconds: float, rate: float, lateness: Lateness, rng: np.random.Generator
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return when pieces are sent, and when they arrive, s; none overtakes another."""
    sent = _BEGIN + np.arange(round(seconds * rate)) / rate
    return sent, np.maximum.accumulate(sent + lateness.drawn(rng, len(sent), 1 / rate))


def _within(
    time: Float[np.ndarray, " n"], steps: Sequence[tuple[float, float]], before: float = 0.0
) -> Bool[np.ndarray, " n"]:
    """Return which times lie in a step, or up to ``before`` s before one."""
    begin, end = np.transpose(steps)
    each = (time[:, None] >= begin - before) & (time[:, None] <= end)
    within: np.ndarray = each.any(axis=1)
    return within


def _told(
    world: World,
    way: _Way,
    sent: Float[np.ndarray, " n"],
    steps: Sequence[tuple[float, float]],
    rng: np.random.Generator,
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return what each ring's sensors read where the robot was when frames were sent. Frames sent
    longer than ``_BEFORE`` before a step, which cannot count for it, hold no distance.
    """
    used = _within(sent, steps, _BEFORE)
    poses, which = np.unique(way.at(sent[used]), axis=0, return_inverse=True)
    told = []
    for seen in world.seen(poses):
        true = np.full((len(sent), *seen.shape[1:]), np.nan)
        true[used] = seen[which.ravel()]
        told.append(world.told(rng, true))
    return told
