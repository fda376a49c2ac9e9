"""Bounds of the law of detection over balls of places.

Let a ball of radius r lie about a place. In it the part of the piece's axis that is nearest to the
axis of the beam moves along the piece by a bounded step, which is linear in the place. In the
metric that finds it, the nearest part is a projection on a segment: across the axis of the beam it
moves by at most r. Its depth lies between the sums of the ends of depth and step. A tangent x / d
is between the quotients of the ends of both intervals. The share of a zone that an interval covers
grows with its length, is continuous in its centre and changes no faster than the centre over the
zone's width. The law grows with each of its factors, so the products of their least and of their
largest values bound it. The bounds meet as r goes to 0, with an error in proportion to r.
"""

from typing import Any, NamedTuple

import numpy as np

from ..arrays import Numbers, root
from ..solids.beams import NIL, FromPose
from .aspect import Aspect, Extent, Vertical, bulge, step_to_axis, zone_centre
from .detectors import Detectors
from .law import Lit, lit, overlap


class Ends(NamedTuple):
    """Bounds of the law over balls."""

    low: Any
    """Lower bound of ``law.strength``."""
    high: Any
    """Upper bound of it."""
    slack: Any
    """Distance within which the piece's nearest part stays, m."""
    narrow: Lit
    """Lower bound of what is lit within the beam, and upper bound of that within a zone, m."""
    wide: Lit
    """The other ends."""


def ends(
    a: Aspect, at: FromPose, up: Vertical, of: Detectors, piece: Extent, reach: Numbers
) -> Ends:
    """Return bounds of the law over balls of radius ``reach`` m.

    Args:
        a: how the piece stands at the centres of the balls.
        at: the centres in the frames of the beams, m.
        up: the vertical there.
        of: the sensors.
        piece: its size.
        reach: radius of the balls, m.
    """
    step, slope = step_to_axis(at, up)
    down, above = (
        np.clip(step + s * reach * slope, -piece.height / 2, piece.height / 2) for s in (-1, 1)
    )
    drift = np.maximum(above - a.step, a.step - down)
    rise = [f(down * up.along, above * up.along) for f in (np.minimum, np.maximum)]
    depths = at.along - reach + rise[0], at.along + reach + rise[1]
    near, far = (np.maximum(d, NIL) for d in depths)
    least, most = _fill(a, depths, of, reach, drift)
    nearest, farthest = _distance(a, depths, piece, reach)
    full = np.maximum(of.reach, 0.0)
    first, last = lit(near, a.cross, of, piece), lit(far, a.cross, of, piece)
    low = least * (full / np.maximum(farthest, NIL)) ** 2
    high = most * (full / np.maximum(nearest, NIL)) ** 2
    return Ends(
        np.where((nearest >= of.least) & (a.clear > reach), low, 0.0),
        np.where((farthest >= of.least) & (a.clear > -reach), high, 0.0),
        reach + drift,
        Lit(first.within, last.zone),
        Lit(last.within, first.zone),
    )


def _fill(
    a: Aspect, depths: tuple[Any, Any], of: Detectors, reach: Numbers, drift: Any
) -> tuple[Any, Any]:
    """Return bounds of ``law.fill``: the depth of the nearest part lies between ``depths``, and it
    moves along the piece by ``drift`` at most. Where a piece begins beyond a side of the beam, its
    share is 0."""
    near, far = (np.maximum(d, NIL) for d in depths)
    high: np.ndarray = np.where(depths[1] > 0, 1.0, 0.0)
    low: np.ndarray = np.ones_like(high)
    lean = np.maximum(a.sine - abs(a.steep), 0.0)
    for side, moved in ((a.cross, reach), (a.strip, reach + lean * drift)):
        left, right = _tangents(side.centre, moved, near, far)
        middle, per_zone = (left + right) / 2, side.zones / (2 * side.edge)
        slack = (right - left) / 2 * per_zone
        least = overlap(middle, side.half / far, side.edge, side.zones) - slack
        most = overlap(middle, side.half / near, side.edge, side.zones) + slack
        most = np.minimum(np.minimum(most, 2 * side.half / near * per_zone), 1.0)
        low = low * np.maximum(least, 0.0)
        high = high * np.where(abs(side.centre) - moved - side.half <= side.edge * far, most, 0.0)
    low = np.where(depths[0] > 0, low, 0.0)
    return np.where(of.flat, low, 1.0), np.where(of.flat, high, 1.0)


def _tangents(x: Any, moved: Any, near: Any, far: Any) -> tuple[Any, Any]:
    """Return bounds of the tangents of places within ``moved`` m of x at depths between both, m."""
    left, right = x - moved, x + moved
    return left / np.where(left > 0, far, near), right / np.where(right > 0, near, far)


def _distance(a: Aspect, depths: tuple[Any, Any], piece: Extent, reach: Numbers) -> tuple[Any, Any]:
    """Return bounds of ``aspect.nearest``. The distance of a tangent from the middle of the best
    zone is 1-Lipschitz."""
    near, far = (np.maximum(d, NIL) for d in depths)
    cross = a.cross
    left, right = _tangents(cross.centre, reach, near, far)
    t, slack = (left + right) / 2, (right - left) / 2
    off = abs(t - zone_centre(t, cross.edge, cross.zones))
    fronts = np.maximum(off - slack, 0.0) * near, (off + slack) * far
    aside = np.maximum(abs(cross.centre) - reach, 0.0), abs(cross.centre) + reach
    along = np.maximum(abs(a.lengthwise) - reach, 0.0), abs(a.lengthwise) + reach
    each = []
    for i in range(2):
        beside = np.maximum(aside[i] - piece.width / 2, 0.0)
        front = np.maximum(depths[i] - bulge(fronts[i], a.sine, piece), 0.0)
        each.append(root(beside * beside + along[i] * along[i] + front * front))
    return each[0], each[1]
