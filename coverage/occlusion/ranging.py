"""What ranging sensors read: the nearest point of a union of balls in each sensor's cone, in closed
form.

A single-zone Time-of-Flight sensor answers with the distance of the nearest thing anywhere in its
beam. Any solid that is a union of balls, such as a person made of capsules, can be read without
sampling.

Most balls are in few cones. So neighbouring balls go in blocks, and a pose, a sensor and a block
make a row, which is left out where the cone's implicit function says that the block's enclosing
ball lies outside. The other rows are worked on in slabs of one size, so that the compiled functions
serve every number of poses, sensors and balls.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..arrays import Array
from ..solids.capsules import Capsules, gap_to_capsules
from ..solids.cones import cone
from ..solids.polyhedra import Polyhedron, crossed, polyhedra
from ..solids.segments import segment_to_segment
from .ball_in_cone import ball_in_cone

BLOCK = 16  # neighbouring balls that are sought together
_ROWS, _HITS = 1 << 12, 1 << 13  # rows and pairs worked on at once: some megabytes
_TRIPLES = 1 << 20  # of a pose, a sensor and a block, sorted out at once: some hundred megabytes


class RangeReadings(NamedTuple):
    """What K sensors read in T poses. distance (T, K) m: infinite where a sensor sees nothing.
    point (T, K, 3) m: the nearest point, which was read; not a number where nothing was."""

    distance: Float[np.ndarray, "T K"]
    point: Float[np.ndarray, "T K 3"]


def slabs(
    function: Callable[..., Array],
    rows: tuple[Array, ...],
    fixed: tuple[Array, ...] = (),
    size: int = _ROWS,
) -> Any:
    """``function(rows, fixed)`` over slabs of ``size`` rows, the last filled up with its last row:
    one shape for all calls.

    ``rows`` and the answer are arrays with one entry for each of N rows, N at least 1; memory
    follows ``size``.
    """
    n = len(rows[0])
    found = []
    for first in range(0, n, size):
        index = np.minimum(np.arange(first, first + size), n - 1)
        found.append(
            np.asarray(function(tuple(jnp.asarray(a[index]) for a in rows), fixed))[: n - first]
        )
    return np.concatenate(found)


def blocks(
    centre: Float[np.ndarray, "T B 3"], radius: Float[np.ndarray, " B"]
) -> tuple[Float[np.ndarray, "T G S 3"], Float[np.ndarray, "G S"]]:
    """Balls in blocks of ``BLOCK`` neighbours, centres (T, G, BLOCK, 3) m and radii (G, BLOCK) m;
    the last ball fills up.
    """
    index = np.minimum(np.arange(-(-len(radius) // BLOCK) * BLOCK), len(radius) - 1).reshape(
        -1, BLOCK
    )
    return centre[:, index], radius[index]


@jax.jit
def _in_cones(rows: tuple[Array, ...], fixed: tuple[Array, ...]) -> Any:
    """Distances (R, BLOCK) of the balls of each row in its cone."""
    apex, axis, half, range_m, centre, radius = rows
    return ball_in_cone(
        apex[:, None], axis[:, None], half[:, None], range_m[:, None], centre, radius
    )[0]


@jax.jit
def _hidden(rows: tuple[Array, ...], fixed: tuple[Array, ...]) -> Any:
    """Does a body or an obstacle stand between an eye and a point, both (R, 3)? Bodies start and
    end (R, N, 3), thick (N,); obstacles' planes (O, M, 3) and (O, M)."""
    eye, point, start, end = rows
    thick, normal, offset = fixed
    body = segment_to_segment(eye[:, None], point[:, None], start, end) < thick[None]
    return body.any(axis=1) | crossed(eye[:, None], point[:, None], normal[None], offset[None]).any(
        axis=1
    )


@jax.jit
def _gaps(rows: tuple[Array, ...], fixed: tuple[Array, ...]) -> Any:
    """Least distance (R,) between the balls of each row and the bodies of its pose."""
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
    """What every sensor reads in every pose, some poses at a time in bounded memory.

    Args:
        apex, axis: of K sensors in T poses, m and unit.
        half_angle, range_m: of the sensors, rad and m.
        centre, radius: B balls whose union is seen, m; quickest where neighbours follow each other.
        bodies: that hide what lies behind them, N capsules in T poses; None hides nothing. A ball
            is hidden from a sensor
            when the segment from the apex to the ball's nearest point in the cone comes closer to a
                body's axis than the body's radius; the next ball is read instead. So a ball half
                hidden counts as hidden: balls should be small beside the bodies. A sensor that
                stands inside a body reads nothing at all.
        obstacles: that hide in the same way, in all poses alike.
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
    """Distance and point of ``readings``, all poses at once."""
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
    found = slabs(_in_cones, (*eyes, balls[t, g], size[g])).astype(float)
    if bodies is not None:
        _hide(found, t, k, g, eyes, (balls, size), bodies, obstacles)
    ball, near = found.argmin(axis=1), found.min(axis=1)
    best = _nearest_rows(near, t, k)
    t, k, g, ball = t[best], k[best], g[best], ball[best]
    exact = ball_in_cone(
        apex[t, k], axis[t, k], half_angle[k], range_m[k], balls[t, g, ball], size[g, ball]
    )
    distance[t, k], point[t, k] = near[best], exact[1]
    return distance, point


def _hide(
    found: np.ndarray,
    t: np.ndarray,
    k: np.ndarray,
    g: np.ndarray,
    eyes: tuple[Array, ...],
    balls: tuple[Array, ...],
    bodies: Capsules,
    obstacles: tuple[Polyhedron, ...],
) -> None:
    """Make the distances ``found`` (R, BLOCK) of hidden balls infinite, as far as that matters.

    Only where a sensor's nearest ball is hidden are its others tested.
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
        found[row[hidden], ball[hidden]] = np.inf
        return hidden

    first = _nearest_rows(found.min(axis=1), t, k)
    if not len(first):
        return
    again = np.zeros((t.max() + 1, k.max() + 1), bool)
    again[t[first], k[first]] = test(first, found[first].argmin(axis=1))
    row, ball = np.nonzero(np.isfinite(found) & again[t, k][:, None])
    if len(row):
        test(row, ball)


def _nearest_rows(near: np.ndarray, t: np.ndarray, k: np.ndarray) -> Any:
    """Of rows with the distances ``near`` (R,) the index of the nearest for each pose and sensor
    that sees anything.
    """
    order = np.lexsort((near, k, t))
    best = order[np.append(True, (np.diff(t[order]) != 0) | (np.diff(k[order]) != 0))]
    return best[np.isfinite(near[best])]


def least_gap(
    centre: Float[np.ndarray, "T B 3"], radius: Float[np.ndarray, " B"], bodies: Capsules
) -> Float[np.ndarray, " T"]:
    """Least signed distance (T,) m between B balls and N capsules in each of T poses, negative
    where they overlap.
    """
    balls, size = blocks(centre, radius)
    poses, groups = balls.shape[:2]
    t, g = (i.ravel() for i in np.indices((poses, groups)))
    gap: np.ndarray = slabs(
        _gaps, (balls[t, g], size[g], bodies.start[t], bodies.end[t]), (jnp.asarray(bodies.radius),)
    )
    least: np.ndarray = gap.reshape(poses, groups).min(axis=1).astype(float)
    return least
