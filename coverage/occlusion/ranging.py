"""Readings of ranging sensors: the nearest point of a union of balls in each sensor's cone, in
closed form.

A single-zone Time-of-Flight sensor returns the distance of the nearest surface anywhere in its
beam. The reading of any solid that is a union of balls, such as a person made of capsules, needs no
sampling.

Most balls lie in few cones, so neighbouring balls are grouped in blocks. A pose, a sensor and a
block form a row. A row is discarded if the cone's implicit function shows that the block's
enclosing ball lies outside. The remaining rows are processed in slabs of one size, so that the
compiled functions serve every number of poses, sensors and balls.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..arrays import Array
from ..pytrees import register_trees
from ..solids.capsules import Capsules, gap_to_capsules
from ..solids.cones import cone
from ..solids.polyhedra import Polyhedron, crossed, polyhedra
from ..solids.segments import segment_to_segment
from .ball_in_cone import ball_in_cone

register_trees()

BLOCK = 16  # neighbouring balls that are tested together
_ROWS, _HITS = 1 << 12, 1 << 13  # rows and pairs processed at once: some megabytes
_TRIPLES = 1 << 20  # (pose, sensor, block) triples filtered at once: some hundred megabytes


class RangeReadings(NamedTuple):
    """Readings of K sensors in T poses."""

    distance: Float[np.ndarray, "T K"]
    """Distance, m; infinite where a sensor sees nothing."""
    point: Float[np.ndarray, "T K 3"]
    """The nearest point, m; NaN where a sensor sees nothing."""


def slabs(
    function: Callable[..., Array],
    rows: tuple[Array, ...],
    fixed: tuple[Any, ...] = (),
    size: int = _ROWS,
) -> Any:
    """Apply ``function(rows, fixed)`` to slabs of ``size`` rows, so that all calls have one shape.

    The last slab is padded with its last row. ``rows`` and the result are arrays with one entry for
    each of N rows, N at least 1. Memory use depends on ``size`` only.
    """
    n = len(rows[0])
    results = []
    for first in range(0, n, size):
        index = np.minimum(np.arange(first, first + size), n - 1)
        results.append(
            np.asarray(function(tuple(jnp.asarray(a[index]) for a in rows), fixed))[: n - first]
        )
    return np.concatenate(results)


def blocks(
    centre: Float[np.ndarray, "T B 3"], radius: Float[np.ndarray, " B"]
) -> tuple[Float[np.ndarray, "T G S 3"], Float[np.ndarray, "G S"]]:
    """Group balls in blocks of ``BLOCK`` neighbours; the last ball pads the last block.

    Returns:
        centres (T, G, BLOCK, 3) m and radii (G, BLOCK) m.
    """
    index = np.minimum(np.arange(-(-len(radius) // BLOCK) * BLOCK), len(radius) - 1).reshape(
        -1, BLOCK
    )
    return centre[:, index], radius[index]


@jax.jit
def _in_cones(rows: tuple[Array, ...], fixed: tuple[Array, ...]) -> Any:
    """Return the distances (R, BLOCK) of the balls of each row in its cone."""
    apex, axis, half, range_m, centre, radius = rows
    return ball_in_cone(
        apex[:, None], axis[:, None], half[:, None], range_m[:, None], centre, radius
    )[0]


@jax.jit
def _hidden(rows: tuple[Array, ...], fixed: tuple[Array, ...]) -> Any:
    """Return whether a body or an obstacle lies between an eye and a point, both (R, 3).

    ``rows`` also holds the bodies' start and end (R, N, 3). ``fixed`` holds their radii (N,) and
    the obstacles' planes (O, M, 3) and (O, M).
    """
    eye, point, start, end = rows
    thick, normal, offset = fixed
    body = segment_to_segment(eye[:, None], point[:, None], start, end) < thick[None]
    return body.any(axis=1) | crossed(eye[:, None], point[:, None], normal[None], offset[None]).any(
        axis=1
    )


@jax.jit
def _gaps(rows: tuple[Array, ...], fixed: tuple[Array, ...]) -> Any:
    """Return the least distance (R,) between the balls of each row and the bodies of its pose."""
    centre, radius, start, end = rows
    (thick,) = fixed
    return (gap_to_capsules(centre, start[:, None], end[:, None], thick[None, None]) - radius).min(
        axis=1
    )


def readings(
    apex: Float[np.ndarray, "T K 3"],
    axis: Float[np.ndarray, "T K 3"],
    half_angle: Float[np.ndarray, " K"],
    range_m: Float[np.ndarray, " K"],
    centre: Float[np.ndarray, "T B 3"],
    radius: Float[np.ndarray, " B"],
    bodies: Capsules | None = None,
    obstacles: tuple[Polyhedron, ...] = (),
) -> RangeReadings:
    """Return the readings of all sensors in all poses, in batches of poses of bounded memory.

    A ball is occluded from a sensor if the segment from the apex to the ball's nearest point in the
    cone comes closer to a body's axis than the body's radius. The next ball is read instead. A
    half-occluded ball thus counts as occluded, so balls should be small compared with the bodies. A
    sensor inside a body reads nothing.

    Args:
        apex, axis: poses of K sensors in T poses, m and unit.
        half_angle, range_m: of the sensors, rad and m.
        centre, radius: B balls whose union is the target, m; fastest if neighbours are adjacent.
        bodies: occluding capsules, N in each of T poses; None: no occlusion by bodies.
        obstacles: obstacles that occlude in the same way, the same in all poses.
    """
    poses, sensors = apex.shape[:2]
    if bodies is None and obstacles:
        bodies = Capsules(np.zeros((poses, 0, 3)), np.zeros((poses, 0, 3)), np.zeros(0))
    step = max(1, _TRIPLES // max(1, sensors * -(-len(radius) // BLOCK)))
    some = [slice(first, first + step) for first in range(0, poses, step)]
    parts = [
        _read(
            (apex[t], axis[t], half_angle, range_m),
            centre[t],
            radius,
            None if bodies is None else bodies.at(t),
            obstacles,
        )
        for t in some
    ]
    return RangeReadings(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def _read(
    sensors: tuple[Array, ...],
    centre: np.ndarray,
    radius: np.ndarray,
    bodies: Capsules | None,
    obstacles: tuple[Polyhedron, ...],
) -> tuple[Any, Any]:
    """Return distance and point of ``readings``, for all poses at once."""
    apex, axis, half_angle, range_m = sensors
    distance, point = np.full(apex.shape[:2], np.inf), np.full(apex.shape, np.nan)
    balls, size = blocks(centre, radius)
    middle = (balls.min(axis=2) + balls.max(axis=2)) / 2
    reach = (np.linalg.norm(balls - middle[:, :, None], axis=3) + size).max(axis=2)
    cosine, sine = (f(half_angle)[None, :, None] for f in (np.cos, np.sin))
    away = cone(
        middle[:, None], apex[:, :, None], axis[:, :, None], cosine, sine, range_m[None, :, None]
    )
    t, k, g = np.nonzero(away <= reach[:, None] + 1e-6)
    if not len(t):
        return distance, point
    eyes = apex[t, k], axis[t, k], half_angle[k], range_m[k]
    ball_distance = slabs(_in_cones, (*eyes, balls[t, g], size[g])).astype(float)
    if bodies is not None:
        _hide(ball_distance, t, k, g, eyes, (balls, size), bodies, obstacles)
    ball, near = ball_distance.argmin(axis=1), ball_distance.min(axis=1)
    best = _nearest_rows(near, t, k)
    t, k, g, ball = t[best], k[best], g[best], ball[best]
    exact = ball_in_cone(
        apex[t, k], axis[t, k], half_angle[k], range_m[k], balls[t, g, ball], size[g, ball]
    )
    distance[t, k], point[t, k] = near[best], exact[1]
    return distance, point


def _hide(
    distance: np.ndarray,
    t: np.ndarray,
    k: np.ndarray,
    g: np.ndarray,
    eyes: tuple[Array, ...],
    balls: tuple[Array, ...],
    bodies: Capsules,
    obstacles: tuple[Polyhedron, ...],
) -> None:
    """Set the distances ``distance`` (R, BLOCK) of occluded balls to infinity where this matters.

    A sensor's other balls are tested only if its nearest ball is occluded.
    """
    (centre, size), (apex, axis, half, range_m) = balls, eyes
    stands = polyhedra(obstacles, np.zeros((2, 3)))
    fixed = tuple(jnp.asarray(a) for a in (bodies.radius, stands.normal, stands.offset))

    def test(row: np.ndarray, ball: np.ndarray) -> Any:
        where = t[row], g[row], ball
        seen = ball_in_cone(
            apex[row], axis[row], half[row], range_m[row], centre[where], size[where[1:]]
        )[1]
        hidden = slabs(
            _hidden, (apex[row], seen, bodies.start[t[row]], bodies.end[t[row]]), fixed, _HITS
        )
        distance[row[hidden], ball[hidden]] = np.inf
        return hidden

    first = _nearest_rows(distance.min(axis=1), t, k)
    if not len(first):
        return
    again = np.zeros((t.max() + 1, k.max() + 1), bool)
    again[t[first], k[first]] = test(first, distance[first].argmin(axis=1))
    row, ball = np.nonzero(np.isfinite(distance) & again[t, k][:, None])
    if len(row):
        test(row, ball)


def _nearest_rows(near: np.ndarray, t: np.ndarray, k: np.ndarray) -> Any:
    """Return the index of the nearest row for each pose and sensor that sees anything.

    ``near`` (R,) holds the distances of the rows.
    """
    order = np.lexsort((near, k, t))
    best = order[np.append(True, (np.diff(t[order]) != 0) | (np.diff(k[order]) != 0))]
    return best[np.isfinite(near[best])]


def least_gap(
    centre: Float[np.ndarray, "T B 3"], radius: Float[np.ndarray, " B"], bodies: Capsules
) -> Float[np.ndarray, " T"]:
    """Return the least signed distance (T,) m between B balls and N capsules in each of T poses.

    It is negative where they overlap.
    """
    balls, size = blocks(centre, radius)
    poses, groups = balls.shape[:2]
    t, g = (i.ravel() for i in np.indices((poses, groups)))
    gap: np.ndarray = slabs(
        _gaps, (balls[t, g], size[g], bodies.start[t], bodies.end[t]), (jnp.asarray(bodies.radius),)
    )
    least: np.ndarray = gap.reshape(poses, groups).min(axis=1).astype(float)
    return least
