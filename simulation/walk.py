"""Seeded random paths of a human around the robot: in from outside, from station to station,
reaching, and out again.
"""

from typing import NamedTuple, TypedDict

import numpy as np
from jaxtyping import Float
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d

from .human import FOREARM, UPPER_ARM, Bones, Posture, bones

WALK = 1.6  # m/s, ISO 13855: speed of the whole body
HAND = 2.0  # m/s, ISO 13855: speed of the upper limb
START = (2.5, 3.0)  # m from the base's axis: where the human comes from and goes to
PASS = (1.3, 2.2)  # m: how near it passes between stations
STATION = (1.2, 1.8)  # m: where it stops
# m from the base's axis and above the base frame: what it reaches for
GOAL_RADIUS, GOAL_HEIGHT = (0.4, 1.0), (0.0, 0.9)
STATURE = (1.55, 1.90)  # m
_STEP = 0.01  # s, of the inner grid
_ACCELERATION = 1.5  # m/s^2
_STRIDE = 0.83  # two steps, as a share of stature
_TURN = 0.35  # s, width of the smoothing of headings
_SETTLE = 1.2  # s, from the end of a walk to the reach, and back
_REACH, _LEAVE = 6.0, 4.0  # s, kept for a reach and for leaving


class Walk(NamedTuple):
    """A human's path. stature m; time (T,) s; posture: T postures."""

    stature: float
    time: Float[np.ndarray, " T"]
    posture: Posture


class _Reaching(TypedDict):
    """Of n steps the lean (n,) rad, the reach (n, 2) and the hands' goals (2, 3) m."""

    lean: Float[np.ndarray, " n"]
    reach: Float[np.ndarray, "n 2"]
    goal: Float[np.ndarray, "2 3"]


class _Track:
    """A path as it grows on the inner grid, piece by piece of time."""

    def __init__(self) -> None:
        self.pieces: list[tuple[np.ndarray, ...]] = []
        self.steps = 0

    def add(
        self,
        position: Float[np.ndarray, "n 2"],
        facing: float | Float[np.ndarray, " n"],
        speed: float | Float[np.ndarray, " n"] = 0.0,
        lean: float | Float[np.ndarray, " n"] = 0.0,
        reach: Float[np.ndarray, "n 2"] | None = None,
        goal: Float[np.ndarray, "2 3"] | None = None,
    ) -> None:
        """Add n steps: position (n, 2) m, facing (n,) rad, speed (n,) m/s, lean (n,) rad, reach (n,
        2), goal (2, 3) m.
        """
        n = len(position)
        reach, goal = (
            np.zeros((n, 2)) if reach is None else reach,
            np.zeros((2, 3)) if goal is None else goal,
        )
        row = (
            *(np.broadcast_to(v, n) for v in (facing, speed, lean)),
            reach,
            np.broadcast_to(goal, (n, 2, 3)),
        )
        self.pieces.append((position, *row))
        self.steps += n

    def joined(self) -> list[np.ndarray]:
        """Everything that was added, joined over time."""
        return [np.concatenate(values) for values in zip(*self.pieces, strict=True)]


def walk(seed: int, time_s: Float[np.ndarray, " T"]) -> Walk:
    """A random path at the times ``time_s`` (T,) s, ascending from 0 on.

    The human comes from ``START``, goes at up to ``WALK`` to stations around the robot, stops,
    turns to what it reaches for, leans and reaches with one hand at up to ``HAND`` (no part of hand
    or forearm is faster), holds, draws back, and leaves for good in time for the end. Its path is
    one function of time for a seed and a last time, whatever the times between. It knows nothing of
    the robot's motion and does not give way; feet may slide by some centimetres in a turn.
    """
    rng = np.random.default_rng(seed)
    stature, end = float(rng.uniform(*STATURE)), float(time_s[-1])
    track = _Track()
    here = np.array([rng.uniform(*START), rng.uniform(-np.pi, np.pi)])
    while True:
        turn = rng.choice([-1, 1]) * rng.uniform(0.5, 2.6)
        there = np.array([rng.uniform(*STATION), here[1] + turn])
        position, facing, speed = _leg(
            here, rng.uniform(*PASS), there, rng.uniform(0.6, 1.0) * WALK
        )
        if track.steps and (track.steps + len(position)) * _STEP + _LEAVE > end:
            break
        track.add(position, facing, speed)
        here = there
        for _ in range(rng.integers(1, 3)):
            if track.steps * _STEP + _REACH + _LEAVE < end:
                _reach_out(track, rng, stature, position[-1])
    out = np.array([rng.uniform(*START), here[1] + rng.uniform(-0.8, 0.8)])
    track.add(*_leg(here, (here[0] + out[0]) / 2, out, 0.9 * WALK))
    return Walk(stature, time_s, _sampled(track, stature, time_s))


def _leg(
    here: Float[np.ndarray, " 2"], passing: float, there: Float[np.ndarray, " 2"], speed: float
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Positions (n, 2) m, directions (n,) rad and speeds (n,) m/s of a walk between two stations,
    each (radius, angle).

    Radius and angle are monotone between the ends and the place passed, so that the base is never
    crossed. The speed rises evenly to ``speed`` and falls evenly to 0.
    """
    knots = np.stack([here, [passing, (here[1] + there[1]) / 2], there])
    radius, angle = PchipInterpolator([0, 0.5, 1], knots)(np.linspace(0, 1, 400)).T
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    length = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    total = length[-1]
    top = min(speed, np.sqrt(_ACCELERATION * total))
    ramp = top / _ACCELERATION
    duration = total / top + ramp
    t = np.linspace(0, duration, int(np.ceil(duration / _STEP)) + 1)[1:]
    left = duration - t
    slowing = np.where(left < ramp, total - _ACCELERATION / 2 * left**2, top * (t - ramp / 2))
    gone = np.where(t < ramp, _ACCELERATION / 2 * t**2, slowing)

    def at(where: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 2"]:
        return np.stack([np.interp(where, length, points[:, i]) for i in range(2)], axis=1)

    ahead = at(gone + 0.05) - at(gone - 0.05)
    return (
        at(gone),
        np.arctan2(ahead[:, 1], ahead[:, 0]),
        top * np.clip(np.minimum(t, left) / ramp, 0, 1),
    )


def _reach_out(
    track: _Track, rng: np.random.Generator, stature: float, position: Float[np.ndarray, " 2"]
) -> None:
    """Add a turn towards something near the robot, a reach for it with one hand, a hold and the way
    back.

    The wrist goes on a straight line by the minimum-jerk profile (Flash and Hogan 1985), over so
    long a time that neither elbow, wrist nor fingertip is faster than asked.
    """
    angle = np.arctan2(position[1], position[0]) + rng.uniform(-0.5, 0.5)
    radius, height = rng.uniform(*GOAL_RADIUS), rng.uniform(*GOAL_HEIGHT)
    wanted = np.array([radius * np.cos(angle), radius * np.sin(angle), height])
    hand, lean, speed, hold = (
        rng.integers(2),
        rng.uniform(0, 0.5),
        rng.uniform(0.7, 1.0) * HAND,
        rng.uniform(0.3, 1.5),
    )
    facing = np.arctan2(wanted[1] - position[1], wanted[0] - position[0])

    def reaching(w: Float[np.ndarray, " n"], goal: Float[np.ndarray, " 3"]) -> _Reaching:
        reach, goals = np.zeros((len(w), 2)), np.zeros((2, 3))
        reach[:, hand], goals[hand] = w, goal
        return {"lean": lean * w, "reach": reach, "goal": goals}

    def body(w: Float[np.ndarray, " n"], goal: Float[np.ndarray, " 3"]) -> Bones:
        more, n = reaching(w, goal), len(w)
        place, still = np.broadcast_to(position, (n, 2)), np.zeros(n)
        goals = np.broadcast_to(more["goal"], (n, 2, 3))
        return bones(
            stature,
            Posture(place, np.full(n, facing), still, still, more["lean"], more["reach"], goals),
        )

    shoulder = body(np.ones(1), wanted).shoulder[0, hand]
    far = np.linalg.norm(wanted - shoulder)
    goal = shoulder + (wanted - shoulder) / far * np.clip(
        far, 0.25, 0.95 * (UPPER_ARM + FOREARM) * stature
    )
    u = np.linspace(0, 1, 201)
    moved = body(_minimum_jerk(u), goal)
    arm = 10 + 3 * hand  # its bones come last, the left arm's before the right one's
    fastest = np.linalg.norm(np.diff(moved.end[:, arm : arm + 3], axis=0), axis=2).max() / u[1]
    n = int(np.ceil(fastest / speed / _STEP)) + 1
    there = _minimum_jerk(np.linspace(0, 1, n))
    settle = np.zeros(round(_SETTLE / _STEP))
    w = np.concatenate([settle, there, np.ones(round(hold / _STEP)), there[::-1], settle])
    track.add(np.broadcast_to(position, (len(w), 2)), facing, **reaching(w, goal))


def _minimum_jerk(u: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    share: np.ndarray = u**3 * (10 - 15 * u + 6 * u**2)
    return share


def _sampled(track: _Track, stature: float, time_s: Float[np.ndarray, " T"]) -> Posture:
    """The path at the times asked: headings smoothed, gait from the way walked; after its end the
    human stands.
    """
    position, facing, speed, lean, reach, goal = track.joined()
    t = _STEP * np.arange(track.steps)
    heading = gaussian_filter1d(np.unwrap(facing), _TURN / _STEP, mode="nearest")
    phase = np.cumsum(speed) * _STEP * 2 * np.pi / (_STRIDE * stature)
    columns = (*position.T, heading, phase, np.minimum(speed / (0.9 * WALK), 1), lean, *reach.T)
    x, y, heading, phase, stride, lean, left, right = (
        np.interp(time_s, t, column) for column in columns
    )
    before = np.clip(np.floor(np.asarray(time_s) / _STEP).astype(int), 0, track.steps - 1)
    both = np.stack([left, right], axis=1)
    return Posture(np.stack([x, y], axis=1), heading, phase, stride, lean, both, goal[before])
