"""Reachable poses: within the joint limits, clear of the robot itself and of the cell."""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import robot_capsules
from ...coverage.solids.capsules import Capsules
from ...coverage.solids.segments import segment_to_segment
from ...objectives.scene import Scene

CELL, OWN = 0.1, 0.04  # m, clearance of the robot's bodies, from which rings protrude
_ALONG = 9  # points on a body's axis, tested against the cell
_TURN = np.pi  # rad; random poses lie within ± this angle if the limits allow more
_TRIES = 100
_ROUNDING = 1e-6  # m
_SOME, _MANY = 32, 256  # poses
_APART = 0.1  # m; bodies that can be farther apart are not neighbours


def gaps(
    scene: Scene, joints: Float[np.ndarray, "P J"]
) -> tuple[Float[np.ndarray, "P A"], Float[np.ndarray, "P B"]]:
    """Return the distances at P poses, m: (P, A) between each pair of the robot's bodies, and (P,
    B) between each body and each obstacle; see ``from_cell``.
    """
    bodies = robot_capsules(
        scene.robot.enclosed(), forward(scene.robot.chain, np.asarray(joints, float))
    )
    return _from_each_other(bodies), from_cell(scene, bodies)


def _from_each_other(bodies: Capsules) -> Float[np.ndarray, "P A"]:
    """Return the distances (P, A) m between each pair of the robot's bodies."""
    start, end, radius = bodies.arrays()
    pairs = np.array(list(itertools.combinations(range(len(radius)), 2))).reshape(-1, 2)
    a, b = pairs.T
    axes = segment_to_segment(start[:, a], end[:, a], start[:, b], end[:, b])  # (P, A)
    return np.asarray(axes - radius[a] - radius[b])


def from_cell(scene: Scene, bodies: Capsules) -> Float[np.ndarray, "P B"]:
    """Return the distances (P, N * O) m of N capsules from O obstacles, from points on the
    capsules' axes. They are at most 1/64 of an axis too large, because an obstacle's function is
    convex along it.
    """
    start, end, radius = (np.asarray(a) for a in bodies.arrays())
    each = [_from_body(o.body, start, end) - radius for o in scene.obstacles]
    return (
        np.stack(each, axis=-1).reshape(len(start), -1)
        if each
        else np.full((len(start), 0), np.inf)
    )


def _from_body(
    body: Any, start: Float[np.ndarray, "P N 3"], end: Float[np.ndarray, "P N 3"]
) -> Float[np.ndarray, "P N"]:
    """Minimise a convex function along segments between points (P, N, 3) m: sample each segment,
    then sample more finely around the minimum.
    """
    low = np.zeros(start.shape[:2])
    width = np.ones(start.shape[:2])
    least = np.full(start.shape[:2], np.inf)
    for _ in range(2):
        place = np.clip(low + np.linspace(0, 1, _ALONG)[:, None, None] * width, 0, 1)  # (A, P, N)
        value = body(start + place[..., None] * (end - start))  # (A, P, N)
        least = np.minimum(least, value.min(axis=0))
        lowest = np.take_along_axis(place, value.argmin(axis=0)[None], axis=0)[0]
        low, width = lowest - width / (_ALONG - 1), 2 * width / (_ALONG - 1)
    return least


def clear(
    scene: Scene,
    joints: Float[np.ndarray, "P J"],
    cell: float = CELL,
    own: float = OWN,
    slack: float = 0.0,
) -> Bool[np.ndarray, " P"]:
    """Return which poses keep the joint limits and the distances of ``least_gaps``."""
    limits = scene.robot.limits
    good: np.ndarray = np.ones(len(joints), bool)
    if limits is not None:
        good &= ((joints >= limits[:, 0]) & (joints <= limits[:, 1])).all(axis=1)
    if not scene.robot.bodies:
        return good
    for found, least in zip(gaps(scene, joints), least_gaps(scene, own, cell, slack), strict=True):
        good = good & (found >= least).all(axis=1)
    return good


def least_gaps(
    scene: Scene, own: float, cell: float, slack: float = 0.0
) -> tuple[Float[np.ndarray, " A"], Float[np.ndarray, " B"]]:
    """Return the distances that the pairs of ``gaps`` must keep, m: ``own`` and ``cell``, plus
    ``slack``.

    Two of the robot's bodies that are closer than ``own`` at one of the scene's own poses need no
    distance if they are neighbours. Otherwise they may come as close as they are there and no
    closer. A body that is closer than ``cell`` to an obstacle at one of these poses may come as
    close as it is there, but never into it. A body that no joint moves relative to an obstacle,
    such as a base on its floor, needs no distance. The slack never excludes one of these poses.
    """
    bodies, obstacles = (
        known.min(axis=0) for known in gaps(scene, np.array([p.q for p in scene.poses]))
    )
    near_bodies = np.where(neighbours(scene), -np.inf, bodies - _ROUNDING)
    near_obstacles = np.where(fixed(scene), -np.inf, np.maximum(obstacles - _ROUNDING, 0.0))
    return (
        np.where(bodies >= own, np.clip(bodies - _ROUNDING, own, own + slack), near_bodies),
        np.where(
            obstacles >= cell, np.clip(obstacles - _ROUNDING, cell, cell + slack), near_obstacles
        ),
    )


def neighbours(scene: Scene) -> Bool[np.ndarray, " A"]:
    """Return which pairs of the robot's bodies (A,), in the order of ``gaps``, are never far apart,
    such as those on both sides of a joint. They are close in all of many random poses within the
    joint limits.
    """
    low, high = _bounds(scene)
    joints = np.random.default_rng(0).uniform(low, high, (_MANY, len(low)))
    bodies = robot_capsules(scene.robot.enclosed(), forward(scene.robot.chain, joints))
    return np.asarray((_from_each_other(bodies) < _APART).all(axis=0))


def fixed(scene: Scene) -> Bool[np.ndarray, " B"]:
    """Return which distances between bodies and obstacles (B,), in the order of ``gaps``, no joint
    changes.
    """
    joints = np.random.default_rng(0).uniform(-_TURN, _TURN, (_SOME, len(scene.robot.chain)))
    still: np.ndarray = np.ptp(gaps(scene, joints)[1], axis=0) < _ROUNDING
    return still


def _bounds(scene: Scene) -> tuple[Float[np.ndarray, " J"], Float[np.ndarray, " J"]]:
    """Return the lowest and highest angles (J,) rad for random poses."""
    limits = (
        np.tile([-np.inf, np.inf], (len(scene.robot.chain), 1))
        if scene.robot.limits is None
        else scene.robot.limits
    )
    low, high = np.maximum(limits[:, 0], -_TURN), np.minimum(limits[:, 1], _TURN)
    beyond = low > high  # limits that leave no angle within half a turn of 0
    return np.where(beyond, limits[:, 0], low), np.where(beyond, limits[:, 1], high)


def sunk(scene: Scene) -> list[str]:
    """List which bodies are inside an obstacle at which of the scene's own poses, one line each;
    bodies that no joint moves are omitted.
    """
    distances = gaps(scene, np.array([p.q for p in scene.poses]))[1]  # (P, B)
    names = [(b.name, o.name) for b in scene.robot.enclosed().bodies for o in scene.obstacles]
    return [
        f"poses[{p}]: {names[b][0]} is {-1000 * distances[p, b]:.0f} mm inside {names[b][1]}"
        for p, b in np.argwhere((distances < -_ROUNDING) & ~fixed(scene))
    ]


Good = Callable[[Float[np.ndarray, "P J"]], Bool[np.ndarray, " P"]]


def drawn(
    scene: Scene, count: int, seed: int, good: Good | None = None
) -> Float[np.ndarray, "count J"]:
    """Draw ``count`` poses uniformly within the joint limits that are clear, or that fulfil
    ``good`` if given.

    Raises:
        ValueError: if hardly any pose is clear.
    """
    rng, joints = np.random.default_rng(seed), len(scene.robot.chain)
    low, high = _bounds(scene)
    poses = np.zeros((0, joints))
    for _ in range(_TRIES):
        tries = rng.uniform(low, high, (4 * count, joints))
        poses = np.concatenate([poses, tries[good(tries) if good else clear(scene, tries)]])
        if len(poses) >= count:
            return poses[:count]
    raise ValueError(
        f"found {len(poses)} clear poses in {4 * count * _TRIES} drawn; allowed: a cell with room"
        " to move"
    )
