"""A quick guess of which points the sensors of a ring have in sight.

It ranks the ring's places, and in the first rounds of a search it also decides.

The sensor that sees a point is the one nearest to it in azimuth. Whether bodies hide the point from
that sensor depends mostly on the ring's height. The guess is the line of sight from the place on
the ring's circle at the azimuth of the point, at the nearest of some heights.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from .line_of_sight import LinkOccluders
from .mount_points import MountPoints

_STEP = 0.03  # m, between two heights
_AT_ONCE = 1 << 13  # points in one batch, so that their arrays stay in cache


class Outlook:
    """Guessed lines of sight from rings on one link to N points; rows are computed on demand."""

    def __init__(self, points: MountPoints, past: LinkOccluders, radius: float) -> None:
        """Store points and occluders in the coordinates of the link's mount, and the rings' radius,
        m."""
        self._points, self._past, self._radius = points, past, np.float32(radius)
        self._rows = dict[int, Bool[np.ndarray, " N"]]()

    def clear(
        self, height: Float[np.ndarray, " K"], index: Int[np.ndarray, " M"] | None = None
    ) -> Bool[np.ndarray, "K M"]:
        """Return whether rings at the heights (K,), m, probably have the points ``index``, by
        default all, in sight."""
        rows, which = np.unique(np.rint(height / _STEP).astype(int), return_inverse=True)
        each = [self._row(r) for r in rows.tolist()]
        clear: np.ndarray = np.stack([r if index is None else r.take(index) for r in each])[which]
        return clear

    def _row(self, row: int) -> Bool[np.ndarray, " N"]:
        if row not in self._rows:
            n = len(self._points.x)
            clear = np.zeros(n, bool)
            for k in range(0, n, _AT_ONCE):
                some = self._points.some(np.arange(k, min(k + _AT_ONCE, n)))
                apex = [
                    self._radius * np.cos(some.azimuth),
                    self._radius * np.sin(some.azimuth),
                    np.full(len(some.x), row * _STEP, np.float32),
                ]
                way = [v - a for v, a in zip((some.x, some.y, some.height), apex, strict=True)]
                clear[k : k + _AT_ONCE] = self._past.clear(apex, way, some.pose)
            self._rows[row] = clear
        return self._rows[row]
