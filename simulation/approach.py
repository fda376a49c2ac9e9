"""The approach that stays unseen: how near a ball comes to a robot at one pose without any sensor
ever seeing it.

A ball of radius rho surely stays outside a cone where the cone's implicit function at its centre
exceeds rho, as that function never exceeds the distance. Centres stand on a lattice; neighbours are
joined where the function, which is 1-Lipschitz, cannot fall to rho on the way between them. So what
is found is a real gap in what is seen: along its whole path the ball is unseen and clears the
robot; so is an arm no thicker than the ball that follows it along the path. Where none is found
that is no proof, as narrow gaps slip through the lattice.
"""

from typing import NamedTuple

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
from ..coverage.solids.cones import cone
from .human import PEDESTAL

# m: balls as large as a hand, a sleeved forearm, a head
HAND_RADIUS, ARM_RADIUS, HEAD_RADIUS = 0.05, 0.075, 0.1
LATTICE = 0.035  # m
_MARGIN = 0.1  # m of lattice beyond what any sensor reaches: approaches start there
_SLAB = 1 << 13  # points worked on at once


class Approach(NamedTuple):
    """An unseen approach. radius of the ball, m. gap_m: its clearance where it ends, m. path (P, 3)
    m: corners of the way of its centre, from outside all sensors' reach, straight between them."""

    radius: float
    gap_m: float
    path: Float[np.ndarray, "P 3"]


class _Scene:
    """What a ball's centre has to keep clear of: ``clear(points)`` (N,) m is at least the distance
    from the cones and from the robot, whichever is less, and 1-Lipschitz."""

    def __init__(
        self, robot: Robot, setup: Setup, q: Float[np.ndarray, " J"], moving_only: bool
    ) -> None:
        self.cones = sensor_cones(robot, setup, q)
        self.bodies = robot_capsules(robot, forward(robot.chain, q))
        chosen = np.array([b.frame > 0 or not moving_only for b in robot.bodies])
        c = self.cones
        cones = (c.apex, c.axis, np.cos(c.half_angle), np.sin(c.half_angle), c.range_m)
        self.fixed = tuple(jnp.asarray(a) for a in (*cones, *self.bodies.arrays(), chosen))

    def values(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 2"]:
        """Clearance (N,) m from cones and robot, and distance (N,) m from the parts of the robot
        that matter.
        """
        both: np.ndarray = slabs(_clearances, (points,), self.fixed, _SLAB)
        return both


@jax.jit
def _clearances(rows: tuple[jax.Array, ...], fixed: tuple[jax.Array, ...]) -> jax.Array:
    (points,), (*cones, start, end, thick, chosen) = rows, fixed
    see = cone(points[:, None], *(a[None] for a in cones)).min(axis=1)
    gap = jnp.stack(
        [
            gap_to_capsules(points, start[None, i], end[None, i], thick[None, i])
            for i in map(_one, range(len(thick)))
        ]
    )
    return jnp.stack(
        [jnp.minimum(see, gap.min(axis=0)), jnp.where(chosen[:, None], gap, jnp.inf).min(axis=0)],
        axis=1,
    )


def _one(i: int) -> slice:
    return slice(i, i + 1)


def unseen_approaches(
    robot: Robot,
    setup: Setup,
    q: Float[np.ndarray, " J"],
    radii: tuple[float, ...] = (HAND_RADIUS, HEAD_RADIUS),
    side: float = LATTICE,
    floor: float = -PEDESTAL,
    moving_only: bool = True,
) -> list[Approach]:
    """For balls of ``radii`` the ways from outside every sensor's reach that stay unseen and end
    nearest to the robot.

    Args:
        robot: with bodies; they stop the ball but hide nothing, sensors see through them.
        setup: whose rings see.
        q: pose (J,) rad.
        radii: of the balls, m.
        side: of the lattice, m; the nearest end is found to about this.
        floor: height m, which balls stay above; there is no table, and a pedestal stops nothing.
        moving_only: nearest to the parts that sweep through space, from the upper arm on, not to
            the base.

    Raises:
        ValueError: if a radius or the side is not positive or the robot has no bodies.
    """
    if not (min(radii) > 0 and side > 0):
        raise ValueError(
            f"radii are {radii} m and the lattice's side {side} m; all must be above 0"
        )
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
    """The nearest lattice point that a ball reaches from the lattice's outer faces, and the
    shortest way there.
    """
    free = clear > radius
    number = np.cumsum(free.ravel()).reshape(free.shape) - 1
    n = int(number.ravel()[-1]) + 1
    outer = np.ones(free.shape, bool)
    outer[1:-1, 1:-1, :-1] = False  # the lowest layer is the floor, no way in
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
    """The path less the corners that a straight way, unseen as surely, can leave out: at best all
    the rest, else half
    """
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
    """Is a straight way surely unseen? By the Lipschitz constant between samples ``spacing`` m
    apart.
    """
    n = int(np.ceil(np.linalg.norm(b - a) / spacing)) + 1
    clear = scene.values(a + np.linspace(0, 1, n)[:, None] * (b - a))[:, 0]
    return bool(np.all(clear > radius + spacing / 2))
