"""First returns of many sensors from capsules, quickly: what bodies leave of a beam that they
blind.
"""

import numpy as np
from jaxtyping import Float, Int

from ...coverage.occlusion.ball_in_cone import ball_in_cone
from ...coverage.occlusion.first_return import Beam

# places of balls along a capsule; about the nearest of them; and along a capsule that a beam grazes
_FIRST, _CLOSE = (np.linspace(0, 1, n, dtype=np.float32) for n in (16, 241))
_STEP = 1 / (len(_FIRST) - 1)
_ABOUT = np.linspace(-_STEP, _STEP, 9, dtype=np.float32)
# m and rad: a body this near to a beam counts as in it, so that rounding a setup blinds no sensor
GRAZE = 1e-4


def first_returns(
    beam: Beam,
    start: Float[np.ndarray, "T 3"],
    end: Float[np.ndarray, "T 3"],
    radius: Float[np.ndarray, " T"],
) -> Float[np.ndarray, " T"]:
    """Return the distance of the nearest point of each capsule in each beam, m; else infinity.

    A capsule is a union of balls, and the nearest point of a ball has a closed form. It is sought
    among balls along the axis, so wide that together they hold the capsule: no beam that meets it
    passes between them. It is then sought among balls about the nearest of these. Where that misses
    the capsule, or ends at an end of the places tried, the beam grazes it, and is tried against
    many more balls: a search drives beams to where an error here favours them.

    The distance is at most 1 mm more than that of ``capsule_in_beam``. In at least 999 of 1000
    pairs it is at most 1 mm less than that for capsule and cone widened by 1 mm and 1 mrad. Both
    hold for axes of at most 1 m and radii from 2 cm on.

    Args:
        beam: the sensors, of half angles below 90 degrees.
        start, end: ends of the capsules' axes, m.
        radius: radii of the capsules, m.
    """
    way = end - start
    square, length = radius * radius, np.sqrt(np.einsum("tc,tc->t", way, way))

    def nearest(
        some: Int[np.ndarray, " S"] | slice, at: Float[np.ndarray, "#S P"], gap: float
    ) -> tuple[Int[np.ndarray, " S"], Float[np.ndarray, " S"]]:
        """Return the nearest of balls at places ``at``, ``gap`` apart, and its distance, m."""
        middle = start[some, None] + at[..., None] * way[some, None]
        wide = np.sqrt(square[some] + (gap / 2 * length[some]) ** 2) + np.float32(GRAZE)
        apex, axis, half, range_m = (a[some, None] for a in beam)
        distance = np.asarray(ball_in_cone(apex, axis, half, range_m, middle, wide[:, None])[0])
        best = distance.argmin(axis=1)
        return best, distance[np.arange(len(best)), best]

    best, found = nearest(slice(None), _FIRST[None], _STEP)
    some = np.flatnonzero(np.isfinite(found))  # (S,), those that may meet
    at = np.clip(_FIRST[best[some], None] + _ABOUT, 0, 1)  # (S, next)
    best, found[some] = nearest(some, at, 2 * _STEP / (len(_ABOUT) - 1))
    place = at[np.arange(len(best)), best]
    cut = ((best == 0) & (place > 0)) | ((best == len(_ABOUT) - 1) & (place < 1))
    graze = some[cut | ~np.isfinite(found[some])]
    if len(graze):
        found[graze] = nearest(graze, _CLOSE[None], 1 / (len(_CLOSE) - 1))[1]
    return found
