"""Reading of a beam that is no cone: the nearest body hit by a fan of rays, refined around the
nearest ray.

The beam of a multi-zone sensor is a pyramid, and we have no closed form for the nearest point of a
capsule in it. A fan of 33 by 33 rays, border included, detects everything wider than the gap
between two rays (2.4 cm at 1 m in a beam of 45 degrees). Finer fans around the nearest ray then
determine the distance to a fraction of a millimetre.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.arrays import dot
from ...coverage.solids.beams import Beams
from ...coverage.solids.polyhedra import Polyhedron, crossing

RAYS, FINER = 33, 9  # rays per side, of the first fan and of the finer ones
_ROUNDS = 4
_AT_ONCE = 1 << 8  # beams


def ray_to_capsule(origin: Any, direction: Any, start: Any, end: Any, radius: Any) -> Any:
    """Return the distance (...) m along unit rays (..., 3) at which capsules begin: 0 inside,
    infinite if missed. All arguments broadcast.
    """
    found = np.full(np.broadcast_shapes(direction.shape, start.shape)[:-1], np.inf)
    axis = end - start
    length = np.sqrt(dot(axis, axis))
    unit = axis / np.where(length > 0, length, 1.0)[..., None]
    v = origin - start
    with np.errstate(invalid="ignore", divide="ignore"):
        along_v, along_d = dot(v, unit), dot(direction, unit)
        a = 1 - along_d**2
        b = dot(v, direction) - along_v * along_d
        c = dot(v, v) - along_v**2 - radius**2
        t = (-b - np.sqrt(b * b - a * c)) / a  # the cylinder
        place = along_v + t * along_d
        found = np.where((a > 1e-12) & (t >= 0) & (place >= 0) & (place <= length), t, found)
        for centre in (start, end):
            w = origin - centre
            b = dot(w, direction)
            t = -b - np.sqrt(b * b - dot(w, w) + radius**2)
            found = np.where(t >= 0, np.minimum(t, found), found)
    place = np.clip(along_v, 0.0, length)
    w = v - place[..., None] * unit
    return np.where(dot(w, w) <= radius**2, 0.0, found)


def ray_to_polyhedron(origin: Any, direction: Any, body: Polyhedron) -> Any:
    """Return the same (...) for a convex polyhedron."""
    height, slope = (dot(v[..., None, :], body.normal) for v in (origin, direction))
    enter, leave = crossing(height - body.offset, slope, np.inf)
    return np.where(enter <= leave, enter, np.inf)


Hit = Callable[[Any, Any, Any], Any]
"""Maps rows (B,) of beams, origins (B, 1, 3) and unit rays (B, N, 3) to the distances (B, N) m at
which a body begins."""


def hit_capsules(
    start: Float[np.ndarray, "R 3"], end: Float[np.ndarray, "R 3"], radius: Float[np.ndarray, " R"]
) -> Hit:
    """Return the test of capsules, one for each row."""
    return lambda row, origin, way: ray_to_capsule(
        origin, way, start[row, None], end[row, None], radius[row, None]
    )


def hit_polyhedron(body: Polyhedron) -> Hit:
    """Return the test of a polyhedron, the same for all rows."""
    return lambda row, origin, way: ray_to_polyhedron(origin, way, body)


def ball_around(body: Polyhedron) -> tuple[Float[np.ndarray, " 3"], float]:
    """Return centre (3,) and radius, m, of a ball around a polyhedron; infinite for a
    half-space."""
    if not len(body.edges):
        return np.zeros(3), np.inf
    corners = np.asarray(body.edges).reshape(-1, 3)
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    return middle, float(np.linalg.norm(corners - middle, axis=1).max())


def nearest_by_rays(beams: Beams, hit: Hit) -> Float[np.ndarray, " R"]:
    """Return the distance (R,) m of the first hit in each of R beams, infinite without one.

    Args:
        beams: R of them.
        hit: test of the body.
    """
    found = np.full(len(beams), np.inf)
    for first in range(0, len(beams), _AT_ONCE):
        some = np.arange(first, min(first + _AT_ONCE, len(beams)))
        middle, wide, side = np.zeros((len(some), 2)), np.ones((len(some), 2)), RAYS
        best = np.full(len(some), np.inf)
        for _ in range(_ROUNDS):
            grid = np.stack(np.meshgrid(*(np.linspace(-1, 1, side),) * 2), axis=-1).reshape(-1, 2)
            at = np.clip(middle[:, None] + grid * wide[:, None], -1, 1)
            way = beams.ways(some, at)
            longer = np.sqrt(dot(way, way))
            distance = hit(some, np.asarray(beams.apex)[some, None], way / longer[..., None])
            distance = np.where(
                distance <= np.asarray(beams.range_m)[some, None] * longer, distance, np.inf
            )
            nearest = distance.argmin(axis=1)
            best = np.minimum(best, distance[np.arange(len(some)), nearest])
            middle, wide = at[np.arange(len(some)), nearest], wide * 2 / (side - 1)
            side = FINER
        found[some] = best
    return found
