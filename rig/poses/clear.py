"""Poses that a robot can be sent to: within its joints' limits, clear of itself and of the cell."""

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

CELL, OWN = 0.1, 0.04  # m, clearance of the robot's bodies: rings stand out of them
_ALONG = 9  # points of a body's axis against the cell
_TURN = np.pi  # rad either way of 0 that poses are drawn from, where limits leave more
_TRIES = 100
_ROUNDING = 1e-6  # m
_SOME, _MANY = 32, 256  # poses
_APART = 0.1  # m; bodies that can be farther apart are no neighbours


def gaps(
    scene: Scene, joints: Float[np.ndarray, "P J"]
) -> tuple[Float[np.ndarray, "P A"], Float[np.ndarray, "P B"]]:
    """Of the robot's bodies at P poses, m: distances (P, A) of each two, and (P, B) of each from
    each obstacle; see ``from_cell``."""
    bodies = robot_capsules(scene.robot, forward(scene.robot.chain, np.asarray(joints, float)))
    return _from_each_other(bodies), from_cell(scene, bodies)


def _from_each_other(bodies: Capsules) -> Float[np.ndarray, "P A"]:
    """Distances (P, A) m of each two of the robot's bodies."""
    start, end, radius = bodies.arrays()
    pairs = np.array(list(itertools.combinations(range(len(radius)), 2))).reshape(-1, 2)
    a, b = pairs.T
    axes = segment_to_segment(start[:, a], end[:, a], start[:, b], end[:, b])  # (P, A)
    return np.asarray(axes - radius[a] - radius[b])


def from_cell(scene: Scene, bodies: Capsules) -> Float[np.ndarray, "P B"]:
    """Distances (P, N * O) m of N capsules from O obstacles, by points of their axes: at most 1/64
    of an axis too large, as an obstacle's function is convex along it."""
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
    """The least of a convex function on the segments between points (P, N, 3) m: on points of each,
    then on more of them about the lowest."""
    low, width, found = (
        np.zeros(start.shape[:2]),
        np.ones(start.shape[:2]),
        np.full(start.shape[:2], np.inf),
    )
    for _ in range(2):
        place = np.clip(low + np.linspace(0, 1, _ALONG)[:, None, None] * width, 0, 1)  # (A, P, N)
        value = body(start + place[..., None] * (end - start))  # (A, P, N)
        found = np.minimum(found, value.min(axis=0))
        lowest = np.take_along_axis(place, value.argmin(axis=0)[None], axis=0)[0]
        low, width = lowest - width / (_ALONG - 1), 2 * width / (_ALONG - 1)
    return found


def clear(
    scene: Scene,
    joints: Float[np.ndarray, "P J"],
    cell: float = CELL,
    own: float = OWN,
    slack: float = 0.0,
) -> Bool[np.ndarray, " P"]:
    """Which poses keep the joints' limits, and the distances of ``least_gaps``."""
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
    """What the pairs of ``gaps`` must keep, m: ``own`` and ``cell``, and ``slack`` more.

    Two of the robot's bodies that are nearer than ``own`` at one of the scene's own poses need keep
    nothing if they are neighbours. Else they may come as near as they are there and no nearer. A
    body that is nearer than ``cell`` to an obstacle at one of them may come as near as it is there,
    but never into it. A body that no joint moves nearer to an obstacle, as a base to its floor,
    needs keep nothing.
    """
    bodies, obstacles = (
        known.min(axis=0) for known in gaps(scene, np.array([p.q for p in scene.poses]))
    )
    near_bodies = np.where(neighbours(scene), -np.inf, bodies - _ROUNDING)
    near_obstacles = np.where(fixed(scene), -np.inf, np.maximum(obstacles - _ROUNDING, 0.0))
    return (
        np.where(bodies >= own, own + slack, near_bodies),
        np.where(obstacles >= cell, cell + slack, near_obstacles),
    )


def neighbours(scene: Scene) -> Bool[np.ndarray, " A"]:
    """Which pairs of the robot's bodies (A,), in the order of ``gaps``, are never far apart, as
    those on both sides of a joint: in no pose of many that are drawn within the joints' limits."""
    low, high = _bounds(scene)
    joints = np.random.default_rng(0).uniform(low, high, (_MANY, len(low)))
    bodies = robot_capsules(scene.robot, forward(scene.robot.chain, joints))
    return np.asarray((_from_each_other(bodies) < _APART).all(axis=0))


def fixed(scene: Scene) -> Bool[np.ndarray, " B"]:
    """Which distances of bodies from obstacles (B,), in the order of ``gaps``, no joint changes."""
    joints = np.random.default_rng(0).uniform(-_TURN, _TURN, (_SOME, len(scene.robot.chain)))
    still: np.ndarray = np.ptp(gaps(scene, joints)[1], axis=0) < _ROUNDING
    return still


def _bounds(scene: Scene) -> tuple[Float[np.ndarray, " J"], Float[np.ndarray, " J"]]:
    """Lowest and highest angles (J,) rad of the joints that poses are drawn from."""
    limits = (
        np.tile([-np.inf, np.inf], (len(scene.robot.chain), 1))
        if scene.robot.limits is None
        else scene.robot.limits
    )
    low, high = np.maximum(limits[:, 0], -_TURN), np.minimum(limits[:, 1], _TURN)
    beyond = low > high  # limits that leave no angle within half a turn of 0
    return np.where(beyond, limits[:, 0], low), np.where(beyond, limits[:, 1], high)


def sunk(scene: Scene) -> list[str]:
    """Which bodies stand in an obstacle at which of the scene's own poses, as lines; those that no
    joint moves are left out."""
    found = gaps(scene, np.array([p.q for p in scene.poses]))[1]  # (P, B)
    names = [(b.name, o.name) for b in scene.robot.bodies for o in scene.obstacles]
    return [
        f"poses[{p}]: {names[b][0]} stands {-1000 * found[p, b]:.0f} mm in {names[b][1]}"
        for p, b in np.argwhere((found < -_ROUNDING) & ~fixed(scene))
    ]


Good = Callable[[Float[np.ndarray, "P J"]], Bool[np.ndarray, " P"]]


def drawn(
    scene: Scene, count: int, seed: int, good: Good | None = None
) -> Float[np.ndarray, "count J"]:
    """So many poses, drawn evenly within the joints' limits, that are clear, or ``good`` where
    another rule is given.

    Raises:
        ValueError: if hardly any pose is clear.
    """
    rng, joints = np.random.default_rng(seed), len(scene.robot.chain)
    low, high = _bounds(scene)
    found = np.zeros((0, joints))
    for _ in range(_TRIES):
        some = rng.uniform(low, high, (4 * count, joints))
        found = np.concatenate([found, some[good(some) if good else clear(scene, some)]])
        if len(found) >= count:
            return found[:count]
    raise ValueError(
        f"found {len(found)} clear poses in {4 * count * _TRIES} drawn; allowed: a cell with room"
        " to move"
    )
