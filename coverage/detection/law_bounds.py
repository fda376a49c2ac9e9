"""Bounds of the law of detection over balls of places.

Let a ball of radius r lie about a place at depth d of a beam. Within it the depth lies in [d - r,
d + r], the distance from the apex within r of the centre's, and so do the place across the axis and
the function of what is in view, as all of these are 1-Lipschitz. A tangent x / d is then between
the quotients of the ends of both intervals. The share of a zone that an interval covers grows with
its length, is continuous in its centre and changes no faster than the centre over the zone's width.
The law grows with each of its factors, so the products of their least and of their largest values
bound it. The bounds meet as r goes to 0, with an error in proportion to r.
"""

from typing import Any

import numpy as np

from ..arrays import Numbers
from ..solids.beams import NIL, FromPose
from .law import Detectors, Extent, overlap, sides


def strength_bounds(at: FromPose, of: Detectors, piece: Extent, reach: Numbers) -> tuple[Any, Any]:
    """Return bounds of ``law.strength`` over balls.

    Args:
        at: centres of the balls in the frames of the beams, m.
        of: the sensors.
        piece: its size.
        reach: radius of the balls, m.
    """
    near, far = np.maximum(at.away - reach, NIL), at.away + reach
    full, (low, high) = np.maximum(of.reach, 0.0), fill_bounds(at, of, piece, reach)
    low = np.where(at.away - reach >= of.least, low * (full / far) ** 2, 0.0)
    return low, np.where(far >= of.least, high * (full / near) ** 2, 0.0)


def fill_bounds(at: FromPose, of: Detectors, piece: Extent, reach: Numbers) -> tuple[Any, Any]:
    """Return bounds of ``law.fill`` over balls of radius ``reach`` m.

    Where a piece begins beyond a side of the beam, its share is 0: the distance from that side, a
    plane or a cone through the apex, is 1-Lipschitz, too.
    """
    near, far = np.maximum(at.along - reach, NIL), np.maximum(at.along + reach, NIL)
    high: np.ndarray = np.where(at.along > -reach, 1.0, 0.0)
    low: np.ndarray = np.ones_like(high)
    for place, size, edge, zones in sides(at, of, piece):
        left, right = place - reach, place + reach
        left, right = left / np.where(left > 0, far, near), right / np.where(right > 0, near, far)
        middle, per_zone = (left + right) / 2, zones / (2 * edge)
        slack = (right - left) / 2 * per_zone
        least = overlap(middle, size / (2 * far), edge, zones) - slack
        most = overlap(middle, size / (2 * near), edge, zones) + slack
        most = np.minimum(np.minimum(most, size / near * per_zone), 1.0)
        beyond = (abs(place) - size / 2 - edge * at.along) / np.sqrt(1 + edge * edge)
        low = low * np.maximum(least, 0.0)
        high = high * np.where(beyond <= reach, most, 0.0)
    low = np.where(at.along > reach, low, 0.0)
    return np.where(of.flat, low, 1.0), np.where(of.flat, high, 1.0)
