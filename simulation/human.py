"""An articulated human body of capsules: walking and reaching postures, and balls that approximate
it.

Lengths are shares of stature after Drillis and Contini (1966), as reprinted in Winter, Biomechanics
and Motor Control of Human Movement, figure 4.1. Radii are our rounding of typical girths. Positions
are in the robot's base frame, which stands on a pedestal above the floor unless another floor is
given.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

PEDESTAL = 0.75  # m, height of the base frame above the floor
TALLEST = 1.95  # m, stature for which the number of balls is fixed
BALL_ERROR = 1e-3  # m, by which a capsule protrudes from its balls at most

# Shares of stature.
ANKLE, SHANK, THIGH, FOOT = 0.039, 0.246, 0.245, 0.152
# hips to shoulders (0.818 - 0.530), shoulders to chin (0.870), chin to crown
TRUNK, NECK, HEAD = 0.288, 0.052, 0.130
UPPER_ARM, FOREARM, HAND = 0.186, 0.146, 0.108
HIPS, SHOULDERS = 0.191, 0.259  # widths between the joints of both sides
_HEEL, _CHEST = 0.03, 0.055  # from ankle to heel; from spine to the middle of each trunk half
RADII = {
    "foot": 0.022,
    "shank": 0.032,
    "thigh": 0.046,
    "trunk": 0.072,
    "neck": 0.034,
    "head": 0.052,
    "upper_arm": 0.027,
    "forearm": 0.023,
    "hand": 0.021,
}

_HIP_SWING, _KNEE_SWING, _KNEE_REST = np.radians((25.0, 60.0, 5.0))
_ARM_SWING, _ELBOW_REST = np.radians((20.0, 20.0))
# direction in which elbows point, in the trunk's frame: back, outward, down
_POLE = np.array([-0.6, 0.3, -0.75])
_SIDES = (1.0, -1.0)  # left and right: y points left
_UP = np.array([0.0, 0.0, 1.0])


class Posture(NamedTuple):
    """T postures."""

    position: Float[np.ndarray, "T 2"]
    """Pelvis over the floor, m."""
    heading: Float[np.ndarray, " T"]
    """Direction of the face about z, rad."""
    phase: Float[np.ndarray, " T"]
    """Phase of the gait, rad."""
    stride: Float[np.ndarray, " T"]
    """Stride: 0 standing to 1 full strides."""
    lean: Float[np.ndarray, " T"]
    """Forward lean of the trunk, rad."""
    reach: Float[np.ndarray, "T 2"]
    """Progress of left and right hand: 0 at rest to 1 at the goal."""
    goal: Float[np.ndarray, "T 2 3"]
    """Goals of left and right hand, m."""


@dataclass(frozen=True)
class Bones:
    """Named segments of the body; those of arms and legs come left first."""

    names: tuple[str, ...]
    """Names of the S segments."""
    start: Float[np.ndarray, "T S 3"]
    """Starts, m."""
    end: Float[np.ndarray, "T S 3"]
    """Ends, m."""
    radius: Float[np.ndarray, " S"]
    """Radii, m."""
    shoulder: Float[np.ndarray, "T 2 3"]
    """Left and right shoulder joints, m."""
    wrist: Float[np.ndarray, "T 2 3"]
    """Left and right wrist joints, m."""


def two_bones(
    shoulder: Float[np.ndarray, "T 3"],
    target: Float[np.ndarray, "T 3"],
    pole: Float[np.ndarray, "T 3"],
    a: float,
    b: float,
) -> tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"]]:
    """Solve the two-link inverse kinematics of an arm by the law of cosines.

    Args:
        shoulder: shoulder (T, 3), m.
        target: target of the wrist (T, 3), m; beyond reach, the wrist stops on the way to it.
        pole: direction (T, 3) towards which the elbow points.
        a: length of the upper arm, m.
        b: length of the forearm, m.

    Returns:
        Elbow and wrist (T, 3), m.
    """
    way = target - shoulder
    far = np.linalg.norm(way, axis=1)
    d = np.clip(far, abs(a - b) + 1e-3, (a + b) * 0.9999)
    unit = way / np.maximum(far, 1e-9)[:, None]
    side = pole - (pole * unit).sum(axis=1, keepdims=True) * unit
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
    along = (d**2 + a**2 - b**2) / (2 * d)
    elbow = (
        shoulder + along[:, None] * unit + np.sqrt(np.maximum(a**2 - along**2, 0))[:, None] * side
    )
    return elbow, shoulder + d[:, None] * unit


class _Skeleton:
    """The segments of a body of ``stature`` m in T postures, added from the floor upwards."""

    def __init__(self, stature: float, posture: Posture) -> None:
        c, s, zero = (
            np.cos(posture.heading),
            np.sin(posture.heading),
            np.zeros_like(posture.heading),
        )
        self.stature, self.posture = stature, posture
        self.forward, self.left = np.stack([c, s, zero], axis=1), np.stack([-s, c, zero], axis=1)
        self.names: list[str] = []
        self.start: list[Float[np.ndarray, "T 3"]] = []
        self.end: list[Float[np.ndarray, "T 3"]] = []

    def add(self, name: str, a: Float[np.ndarray, "T 3"], b: Float[np.ndarray, "T 3"]) -> None:
        """Add a segment from ``a`` to ``b``."""
        self.names.append(name)
        self.start.append(a)
        self.end.append(b)

    def swung(self, angle: Float[np.ndarray, " T"]) -> Float[np.ndarray, "T 3"]:
        """Return the downward direction, turned forward by ``angle`` rad."""
        way: np.ndarray = np.sin(angle)[:, None] * self.forward - np.cos(angle)[:, None] * _UP
        return way

    def add_legs(self, floor: float) -> Float[np.ndarray, "T 3"]:
        """Add legs and feet on a floor of height ``floor`` m, and return the pelvis."""
        h, posture = self.stature, self.posture
        legs = []
        for i in range(2):
            phase = posture.phase + i * np.pi
            hip = posture.stride * _HIP_SWING * np.sin(phase)
            knee = _KNEE_REST + posture.stride * _KNEE_SWING * np.maximum(np.cos(phase), 0) ** 2
            legs.append((THIGH * h * self.swung(hip), SHANK * h * self.swung(hip - knee)))
        height = ANKLE * h + np.maximum(*(-(thigh + shank)[:, 2] for thigh, shank in legs)) + floor
        pelvis = np.column_stack([posture.position, height])
        sole = RADII["foot"]
        for side, (thigh, shank) in zip(_SIDES, legs, strict=True):
            hip_joint = pelvis + side * HIPS / 2 * h * self.left
            ankle = hip_joint + thigh + shank
            heel = ankle - (_HEEL * h - sole * h) * self.forward - (ANKLE - sole) * h * _UP
            self.add("thigh", hip_joint, hip_joint + thigh)
            self.add("shank", hip_joint + thigh, ankle)
            self.add("foot", heel, heel + (FOOT - 2 * sole) * h * self.forward)
        return pelvis

    def add_trunk(
        self, pelvis: Float[np.ndarray, "T 3"], spine: Float[np.ndarray, "T 3"]
    ) -> Float[np.ndarray, "T 3"]:
        """Add trunk, neck and head along the unit vector ``spine``, and return the neck's base."""
        h = self.stature
        neck = pelvis + TRUNK * h * spine
        for side in _SIDES:
            middle = pelvis + side * _CHEST * h * self.left
            self.add("trunk", middle, middle + (TRUNK - RADII["trunk"] * 0.8) * h * spine)
        self.add("neck", neck, neck + NECK * h * spine)
        self.add(
            "head",
            neck + (NECK + RADII["head"]) * h * spine,
            neck + (NECK + HEAD - RADII["head"]) * h * spine,
        )
        return neck

    def add_arms(
        self, neck: Float[np.ndarray, "T 3"], spine: Float[np.ndarray, "T 3"]
    ) -> tuple[Float[np.ndarray, "T 2 3"], Float[np.ndarray, "T 2 3"]]:
        """Add arms and hands, and return the shoulders and the wrists, left and right."""
        h, posture = self.stature, self.posture
        a, b, front = UPPER_ARM * h, FOREARM * h, np.cross(self.left, spine)
        shoulders, wrists = [], []
        for i, side in enumerate(_SIDES):
            shoulder = neck + side * SHOULDERS / 2 * h * self.left
            swing = -posture.stride * _ARM_SWING * np.sin(posture.phase + i * np.pi)
            rest = shoulder + a * self.swung(swing) + b * self.swung(swing + _ELBOW_REST)
            target = rest + posture.reach[:, i, None] * (posture.goal[:, i] - rest)
            pole = _POLE[0] * front + side * _POLE[1] * self.left + _POLE[2] * spine
            elbow, wrist = two_bones(shoulder, target, pole, a, b)
            self.add("upper_arm", shoulder, elbow)
            self.add("forearm", elbow, wrist)
            self.add("hand", wrist, wrist + (wrist - elbow) / b * (HAND - RADII["hand"]) * h)
            shoulders.append(shoulder)
            wrists.append(wrist)
        return np.stack(shoulders, 1), np.stack(wrists, 1)


def bones(stature: float, posture: Posture, floor: float = -PEDESTAL) -> Bones:
    """Return the body of ``stature`` m in T postures on a floor of height ``floor`` m.

    The higher leg bends, the hips stand as high as the longer leg reaches to the floor, and feet
    stay level. Hands at rest swing opposite to the legs; a reaching wrist moves on the straight
    line from there to its goal.
    """
    body = _Skeleton(stature, posture)
    pelvis = body.add_legs(floor)
    spine = np.sin(posture.lean)[:, None] * body.forward + np.cos(posture.lean)[:, None] * _UP
    neck = body.add_trunk(pelvis, spine)
    shoulders, wrists = body.add_arms(neck, spine)
    radius = stature * np.array([RADII[name] for name in body.names])
    start, end = np.stack(body.start, 1), np.stack(body.end, 1)
    return Bones(tuple(body.names), start, end, radius, shoulders, wrists)


def balls_along(
    start: Float[np.ndarray, "T S 3"],
    end: Float[np.ndarray, "T S 3"],
    radius: Float[np.ndarray, " S"],
    count: list[int],
) -> tuple[Float[np.ndarray, "T B 3"], Float[np.ndarray, " B"]]:
    """Return balls in place of capsules, ``count`` of them evenly from end to end of each: centres
    (T, B, 3) m, radii (B,) m."""
    share = np.concatenate([np.linspace(0, 1, n) for n in count])[None, :, None]
    segment = np.repeat(np.arange(len(count)), count)
    return start[:, segment] + share * (end - start)[:, segment], radius[segment]


def ball_counts(
    length: Float[np.ndarray, " S"], radius: Float[np.ndarray, " S"], error: float = BALL_ERROR
) -> list[int]:
    """Return the number of balls for each capsule so that it protrudes from their union by at most
    ``error`` m.

    Halfway between two balls of radius r at a spacing of d the union is thinner by r - sqrt(r^2 -
    d^2/4), so d = 2 sqrt(error (2 r - error)) suffices.
    """
    spacing = 2 * np.sqrt(error * (2 * radius - error))
    return [int(n) + 1 for n in np.ceil(length / spacing)]


def body_balls(
    stature: float, posture: Posture, error: float = BALL_ERROR
) -> tuple[Float[np.ndarray, "T B 3"], Float[np.ndarray, " B"]]:
    """Return the body as balls: centres (T, B, 3) m, radii (B,) m; the number is the same for every
    stature up to ``TALLEST``."""
    if not 0 < stature <= TALLEST:
        raise ValueError(f"stature must be above 0 and at most {TALLEST} m, got {stature} m")
    body = bones(stature, posture)
    length = np.linalg.norm(body.end[0] - body.start[0], axis=1) * (TALLEST / stature)
    return balls_along(
        body.start,
        body.end,
        body.radius,
        ball_counts(length, body.radius * (TALLEST / stature), error),
    )
