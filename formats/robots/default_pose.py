"""Reach and default pose of a robot from a URDF, which states neither."""

import math

import numpy as np
from jaxtyping import Bool, Float

from ...coverage.robots.kinematics import Chain, arm_base, forward

_POSES = 20_000  # random poses that estimate the reach and yield the default pose


def _drawn(
    limits: Float[np.ndarray, "J 2"], slides: Bool[np.ndarray, " J"]
) -> Float[np.ndarray, "P J"]:
    """Return random poses (P, J) within the limits, with some joints at 0: angles in steps of 5
    degrees where the limits allow, and distances up to a metre in steps of a centimetre."""
    rng, shape, step = np.random.default_rng(0), (_POSES, len(limits)), np.radians(5)
    moved = rng.uniform(size=shape) < rng.uniform(0.1, 1, (_POSES, 1))
    turn = rng.uniform(-np.pi, np.pi, shape)
    value = moved * np.where(slides, np.round(turn / np.pi, 2), step * np.round(turn / step))
    poses: np.ndarray = np.clip(value, limits[:, 0], limits[:, 1])
    return poses


def reach_and_pose(
    chain: Chain, limits: Float[np.ndarray, "J 2"]
) -> tuple[float, Float[np.ndarray, " J"]]:
    """Return an estimate of the reach, m, and a default pose (J,) rad or m.

    The reach is the largest distance of the last joint from the vertical axis through the arm's
    base in random poses, rounded up to the next centimetre. The pose is the random one that best
    holds the tip in front of the robot, at two thirds of its reach and below the elbow, with the
    whole arm above the ground and with few and small joint angles. A rail or lift that carries the
    arm stands as near to 0 as its limits allow.
    """
    first = chain.first_revolute
    q = np.tile(np.clip(0.0, limits[:, 0], limits[:, 1]), (_POSES, 1))
    q[:, first:] = _drawn(limits[first:], chain.slides[first:])
    q = chain.settled(q)
    points = np.asarray(forward(chain, q))[..., :3, 3]
    points = points[:, first:] - arm_base(chain, q[0])
    wrist, tip = points[:, -2], points[:, -1]
    far = max(float(np.linalg.norm(p, axis=1).max()) for p in (wrist[:, :2], 0.5 * tip))
    reach = math.ceil(100 * max(far, 0.01) - 1e-9) / 100
    off = np.linalg.norm(tip - np.array([0.65, 0, 0.3]) * reach, axis=1)
    low = np.maximum(-points[..., 2].min(axis=1), 0.0)
    elbow = np.abs(points[..., 2].max(axis=1) - tip[:, 2] - 0.3 * reach)
    turned = 0.05 * np.count_nonzero(q, axis=1) + 0.05 * np.abs(q).sum(axis=1)
    return reach, q[int(np.argmin(off + 3 * low + elbow + reach * turned))]
