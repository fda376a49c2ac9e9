"""Unseen approach: how near a ball can come to a robot in one pose without being seen by any
sensor.

A ball of radius rho lies outside a cone where the cone's implicit function at the ball's centre
exceeds rho, because that function never exceeds the distance. Centres lie on a lattice. Neighbours
are connected where the function, which is 1-Lipschitz, cannot fall to rho between them. Every path
found is therefore a real gap in coverage: along the whole path the ball is unseen and clears the
robot, and so does an arm no thicker than the ball that follows it. Finding no path proves nothing,
because narrow gaps slip through the lattice.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order

from ..coverage.occlusion.ranging import slabs
from ..coverage.rings.ring import Setup
from ..coverage.rings.ring_kinematics import sensor_cones
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.robots.robot import Robot
from ..coverage.solids.capsules import gap_to_capsules
from .human import PEDESTAL

# m: balls as large as a hand, a sleeved forearm, a head
HAND_RADIUS, ARM_RADIUS, HEAD_RADIUS = 0.05, 0.075, 0.1
LATTICE = 0.035  # m
_MARGIN = 0.1  # m of lattice beyond every sensor's range, where approaches start
_SLAB = 1 << 13  # points in one batch


class Approach(NamedTuple):
    """An unseen approach."""

    radius: float
    """Radius of the ball, m."""
    gap_m: float
    """Clearance from the robot at the end, m."""
    path: Float[np.ndarray, "P 3"]
    """Corners of the centre's polyline, from outside all sensors' range, m."""


class _Scene:
    """Obstacles of a ball's centre: the cones of the sensors and the bodies of the robot."""

    def __init__(
        self, robot: Robot, setup: Setup, q: Float[np.ndarray, " J"], moving_only: bool
    ) -> None:
        self.cones, robot = sensor_cones(robot, setup, q), robot.enclosed()
        self.bodies = robot_capsules(robot, forward(robot.chain, q))
        chosen = np.array([b.frame > 0 or not moving_only for b in robot.bodies])
        self.fixed = jax.tree.map(jnp.asarray, (self.cones, *self.bodies.arrays(), chosen))

    def values(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 2"]:
        """Return clearance and distance (N, 2) m.

        The clearance is a 1-Lipschitz lower bound of the distance from cones and robot, whichever
        is less. The distance is the one to the chosen parts of the robot.
        """
        both: np.ndarray = slabs(_clearances, (points,), self.fixed, _SLAB)
        return both


@jax.jit
def _clearances(rows: tuple[jax.Array, ...], fixed: tuple[Any, ...]) -> jax.Array:
    (points,), (cones, start, end, thick, chosen) = rows, fixed
    gap = jnp.stack(
        [
            gap_to_capsules(points, *(ends[None, i : i + 1] for ends in (start, end, thick)))
            for i in range(len(thick))
        ]
    )
    return jnp.stack(
        [
            jnp.minimum(cones(points), gap.min(axis=0)),
            jnp.where(chosen[:, None], gap, jnp.inf).min(axis=0),
        ],
        axis=1,
    )


def unseen_approaches(
    robot: Robot,
    setup: Setup,
    q: Float[np.ndarray, " J"],
    radii: tuple[float, ...] = (HAND_RADIUS, HEAD_RADIUS),
    side: float = LATTICE,
    floor: float = -PEDESTAL,
    moving_only: bool = True,
) -> list[Approach]:
    """Return, for balls of ``radii``, the unseen path from outside every sensor's range that ends
    nearest to the robot.

    Args:
        robot: robot with bodies; they stop the ball but do not occlude.
        setup: setup whose sensors observe.
        q: pose (J,), rad.
        radii: radii of the balls, m.
        side: spacing of the lattice, m, and the approximate error of the nearest end.
        floor: height above which the balls stay, m; there is no table, and the pedestal stops
            nothing.
        moving_only: measure the distance to the moving parts, from the upper arm on, and not to the
            base.

    Raises:
        ValueError: if a radius or the side is not positive or the robot has no bodies.
    """
    if not (min(radii) > 0 and side > 0):
        raise ValueError(f"radii and lattice spacing must be above 0 m, got {radii} and {side}")
    scene = _Scene(robot, setup, q, moving_only)
    around = np.stack(
        [f(ends, axis=0) for f, ends in ((np.min, scene.bodies.start), (np.max, scene.bodies.end))]
    )
    box = np.stack(
        [
            np.minimum(scene.cones.bounds()[0], around[0]),
            np.maximum(scene.cones.bounds()[1], around[1]),
        ]
    )
    box += np.array([[-1.0], [1.0]]) * (max(radii) + _MARGIN)
    axes = [np.arange(np.floor(a / side), np.ceil(b / side) + 1) * side for a, b in box.T]
    axes[2] = axes[2][axes[2] >= floor + min(radii)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    clear, gap = scene.values(points.reshape(-1, 3)).T.reshape(2, *points.shape[:3]).astype(float)
    return [
        _approach(
            scene, points, np.where(points[..., 2] >= floor + r, clear, -np.inf), gap, r, side
        )
        for r in radii
    ]


def _approach(
    scene: _Scene,
    points: Float[np.ndarray, "X Y Z 3"],
    clear: Float[np.ndarray, "X Y Z"],
    gap: Float[np.ndarray, "X Y Z"],
    radius: float,
    side: float,
) -> Approach:
    """Return the lattice point nearest to the robot that a ball reaches from the lattice's outer
    faces, and the shortest path there."""
    free = clear > radius
    number = np.cumsum(free.ravel()).reshape(free.shape) - 1
    n = int(number.ravel()[-1]) + 1
    outer = np.ones(free.shape, bool)
    outer[1:-1, 1:-1, :-1] = False  # no entry through the lowest layer, the floor
    starts = number[outer & free]
    rows, columns = [np.full(len(starts), n)], [starts]
    for axis in range(3):
        a, b = (
            tuple(slice(i, i - 1 or None) if d == axis else slice(None) for d in range(3))
            for i in (0, 1)
        )
        joined = free[a] & free[b] & (clear[a] + clear[b] - side > 2 * radius)
        rows += [number[a][joined], number[b][joined]]
        columns += [number[b][joined], number[a][joined]]
    row, column = np.concatenate(rows), np.concatenate(columns)
    graph = csr_array((np.ones(len(row), np.int8), (row, column)), shape=(n + 1, n + 1))
    order, before = breadth_first_order(graph, n)
    reached = order[1:]
    end = reached[np.argmin(gap[free][reached])]
    way = [end]
    while before[way[-1]] != n:
        way.append(before[way[-1]])
    path = _shortened(scene, points[free][way[::-1]], radius, side)
    return Approach(radius, float(gap[free][end]) - radius, path)


def _shortened(
    scene: _Scene, path: Float[np.ndarray, "P 3"], radius: float, side: float
) -> Float[np.ndarray, "Q 3"]:
    """Return the path without corners that a straight segment, proven unseen, can skip; try all
    remaining corners first, then half as many."""
    kept, i = [0], 0
    while i < len(path) - 1:
        step = len(path) - 1 - i
        while step > 1 and not _is_clear(scene, path[i], path[i + step], radius, side / 4):
            step //= 2
        i += step
        kept.append(i)
    return path[kept]


def _is_clear(
    scene: _Scene,
    a: Float[np.ndarray, " 3"],
    b: Float[np.ndarray, " 3"],
    radius: float,
    spacing: float,
) -> bool:
    """Return whether a straight segment is proven unseen, by the Lipschitz constant between samples
    ``spacing`` m apart."""
    n = int(np.ceil(np.linalg.norm(b - a) / spacing)) + 1
    clear = scene.values(a + np.linspace(0, 1, n)[:, None] * (b - a))[:, 0]
    return bool(np.all(clear > radius + spacing / 2))
