"""Distances from the robot of the points that a system assumes at the readings of its sensors."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..coverage.arrays import dot, root
from ..coverage.occlusion.ranging import slabs
from ..coverage.solids.capsules import Capsules, gap_to_capsules

# samples of a beam's cross-section: circles as shares of the half angle, points on each circle
_CIRCLES, _ON_CIRCLE = (0.55, 1.0), 8


@jax.jit
def _beliefs(rows: tuple[jax.Array, ...], fixed: tuple[jax.Array, ...]) -> jax.Array:
    """Return the distances (R, 2) m of the believed and the careful point from the robot, for R
    readings."""
    apex, axis, half, reading, start, end = rows
    (thick,) = fixed
    z, x = (jnp.eye(3, dtype=axis.dtype)[i][None] for i in (2, 0))
    u = jnp.cross(axis, jnp.where(jnp.abs(axis[:, 2:]) < 0.9, z, x))
    u = u / root(dot(u, u))[:, None]
    v = jnp.cross(axis, u)
    ways = [axis] + [
        jnp.cos(s * half)[:, None] * axis
        + jnp.sin(s * half)[:, None] * (np.cos(a) * u + np.sin(a) * v)
        for s in _CIRCLES
        for a in 2 * np.pi * np.arange(_ON_CIRCLE) / _ON_CIRCLE
    ]
    points = apex[:, None] + reading[:, None, None] * jnp.stack(ways, axis=1)
    gap = gap_to_capsules(points, start[:, None], end[:, None], thick[None, None])
    return jnp.stack([gap[:, 0], gap.min(axis=1)], axis=1)


def beliefs(
    apex: Float[np.ndarray, "T K 3"],
    axis: Float[np.ndarray, "T K 3"],
    half_angle: Float[np.ndarray, " K"],
    reading: Float[np.ndarray, "T K"],
    bodies: Capsules,
) -> Float[np.ndarray, "T 2"]:
    """Return the believed and the careful distance (T, 2) m; infinite without readings.

    Args:
        apex: apexes of the K sensors, m.
        axis: unit axes of the beams.
        half_angle: half angles, rad.
        reading: readings, m; infinite for none.
        bodies: bodies of the robot at T poses.
    """
    distances = np.full((*reading.shape, 2), np.inf)
    t, k = np.nonzero(np.isfinite(reading))
    if len(t):
        rows = (
            apex[t, k],
            axis[t, k],
            half_angle[k],
            reading[t, k],
            bodies.start[t],
            bodies.end[t],
        )
        distances[t, k] = slabs(_beliefs, rows, (jnp.asarray(bodies.radius),))
    least: np.ndarray = distances.min(axis=1)
    return least
