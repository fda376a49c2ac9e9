"""Random paths of a person around the robot: entry from outside, stations with reaching motions,
and exit."""

from typing import NamedTuple, TypedDict

import numpy as np
from jaxtyping import Float
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d

from .human import FOREARM, UPPER_ARM, Bones, Posture, bones

WALK = 1.6  # m/s, ISO 13855: speed of the whole body
HAND = 2.0  # m/s, ISO 13855: speed of the upper limb
START = (2.5, 3.0)  # m from the base's axis: entry and exit
PASS = (1.3, 2.2)  # m from the base's axis: midway between stations
STATION = (1.2, 1.8)  # m from the base's axis: stations
# m from the base's axis and above the base frame: goals of reaching motions
GOAL_RADIUS, GOAL_HEIGHT = (0.4, 1.0), (0.0, 0.9)
STATURE = (1.55, 1.90)  # m
_STEP = 0.01  # s, internal time step
_ACCELERATION = 1.5  # m/s^2
_STRIDE = 0.83  # length of two steps, as a share of stature
_TURN = 0.35  # s, width of the smoothing of headings
_SETTLE = 1.2  # s, pause between a walk and a reach, and after it
_REACH, _LEAVE = 6.0, 4.0  # s, reserved for a reach and for leaving


class Walk(NamedTuple):
    """A person's path."""

    stature: float
    """Stature, m."""
    time: Float[np.ndarray, " T"]
    """Times, s."""
    posture: Posture
    """Postures at the T times."""


class _Reaching(TypedDict):
    """Reaching motion over n steps."""

    lean: Float[np.ndarray, " n"]
    """Forward lean of the trunk, rad."""
    reach: Float[np.ndarray, "n 2"]
    """Progress of left and right hand towards the goal, 0 to 1."""
    goal: Float[np.ndarray, "2 3"]
    """Goals of both hands, m."""


class _Track:
    """A path under construction, on the internal time grid."""

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
        """Add n steps.

        Args:
            position: pelvis over the floor (n, 2), m.
            facing: heading (n,), rad.
            speed: walking speed (n,), m/s.
            lean: forward lean (n,), rad.
            reach: progress of both hands (n, 2), 0 to 1.
            goal: goals of both hands (2, 3), m.
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
        """Return all pieces, concatenated over time."""
        return [np.concatenate(values) for values in zip(*self.pieces, strict=True)]


def walk(seed: int, time_s: Float[np.ndarray, " T"]) -> Walk:
    """Return a random path at the times ``time_s`` (T,) s, which ascend from 0.

    The person enters from ``START`` and walks at up to ``WALK`` to stations around the robot. At a
    station the person stops, turns to a goal, leans and reaches with one hand at up to ``HAND`` (no
    part of hand or forearm is faster), holds, and draws back. The person leaves before the last
    time. The path depends only on the seed and the last time, not on the times between. It ignores
    the robot's motion; feet may slide by some centimetres in a turn.
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
    """Return a walk between two stations, each given as (radius, angle).

    Radius and angle are monotone between the ends and the midpoint, so that the path never crosses
    the base. The speed rises linearly to ``speed`` and falls linearly to 0.

    Returns:
        Positions (n, 2) m, directions (n,) rad and speeds (n,) m/s.
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
    """Add a turn towards a goal near the robot, a reach with one hand, a hold, and the way back.

    The wrist moves on a straight line with the minimum-jerk profile (Flash and Hogan 1985). The
    duration is chosen so that neither elbow, wrist nor fingertip exceeds the drawn speed.
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
    """Return the path at ``time_s``, with smoothed headings and a gait that follows the distance
    walked; after its end the person stands."""
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
