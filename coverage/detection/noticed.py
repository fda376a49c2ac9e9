"""The probability that sensors among occluders detect a test piece at a place.

Over all places it is a function with values from 0 to 1, as a solid's is 1 inside and 0 outside.
``Noticed`` is that function as a union of the sensors' parts: the octree drops the sensors that do
not matter to a cell, and the mean of the function in a cube has bounds, so a guaranteed interval of
its mean over a target is computed as that of a share covered.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import Array, Index, cross, dot, root, rows
from ..occlusion.occluded_beams import OccludedBeams
from ..occlusion.occluders import Occluders, beams
from ..occlusion.occlusion_mode import Occlusion
from ..solids.base import CubePairs, Decision, Part, Parts, Points
from ..solids.beams import NIL, Beams, FromPose, InBeam
from ..solids.cones import Cones, around
from ..solids.volume_fraction import VolumeFraction
from .aspect import LEVEL, Extent, Vertical, aspect
from .detection import Detection
from .detectors import Detectors
from .law import Lit, at_least, fill, in_time, lit, per_frame, strength, view
from .law_bounds import ends

NEGLIGIBLE = 1e-6
"""Probability up to which a sensor is left out, and from 1 less which a place counts as certain."""
_ENDS, _STEPS = (1e-9, 1e4), 60  # of signals and depths (m), and bisections between


class Chances(NamedTuple):
    """Bounds of the probability that sensors detect a piece in balls, for P pairs of both, by L
    assumptions."""

    low: Float[np.ndarray, "L P"]
    """Lower bounds."""
    high: Float[np.ndarray, "L P"]
    """Upper bounds."""
    matters: Bool[np.ndarray, " P"]
    """Where an upper bound exceeds ``NEGLIGIBLE``."""


@dataclass(frozen=True)
class Noticed(Parts):
    """Places by the probability that at least ``at_least`` of K sensors detect a piece there.

    L assumptions share the geometry: the first is that of the solid.
    """

    cones: Beams
    """Beams of the sensors; cones and pyramids end where the piece is no longer detected."""
    up: Float[np.ndarray, "K 3"]
    """Unit vectors across the axes, those of the beams that have one."""
    seen: Parts
    """What occluders leave of the beams; the beams themselves without occluders."""
    of: Detectors
    """What the sensors need."""
    rates: tuple[Detectors, ...]
    """The same by each of the assumptions, of which only the probability of a signal counts."""
    extent: Extent
    """Size of the piece, m."""
    at_least: int
    """Number of sensors that must detect it."""
    faint: Float[np.ndarray, "L K"]
    """Signals of the probability ``NEGLIGIBLE``."""

    def __len__(self) -> int:
        return len(self.cones)

    def part(self, points: Array, index: Index) -> Any:
        """Return the function of a ball about the apex beyond which the sensor detects nothing."""
        v = points - rows(self.cones.apex, index)
        return root(dot(v, v)) - self._farthest[index]

    @property
    def _farthest(self) -> Float[np.ndarray, " K"]:
        """Distance from the apex up to which the sensors may detect the piece, m."""
        half = np.hypot(self.extent.width, self.extent.height) / 2
        looks = around(self.cones)
        edge = np.hypot(looks.range_m, looks.range_m * np.tan(looks.half_angle) + half)
        beyond = half if self.cones.size is None else half + self.cones.size
        return np.where(self.of.flat, edge, self.cones.range_m + beyond)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        live = self.cones.range_m > 0
        if not live.any():
            return np.zeros((2, 3))
        apex, reach = self.cones.apex[live], self._farthest[live, None]
        return np.stack([(apex - reach).min(axis=0), (apex + reach).max(axis=0)])

    def _place(self, points: Array, index: Int[np.ndarray, " P"]) -> FromPose:
        """Return the places of points (..., P, 3) m in the beams of sensors (P,)."""
        apex, axis, up = (rows(a, index) for a in (self.cones.apex, self.cones.axis, self.up))
        return FromPose(points, apex, axis, up)

    def _vertical(self, index: Int[np.ndarray, " P"]) -> Vertical:
        axis, up = rows(self.cones.axis, index), rows(self.up, index)
        return Vertical(axis[..., 2], cross(up, axis)[..., 2], up[..., 2])

    def _outside(
        self, points: Float[np.ndarray, "Q P 3"], index: Int[np.ndarray, " P"], least: np.ndarray
    ) -> Float[np.ndarray, "Q P"]:
        """Return the function of what is in view of sensors at points, m; values up to ``least``
        (P,) may be any as low."""
        outside: np.ndarray = np.full(points.shape[:2], -np.inf)
        if isinstance(self.seen, OccludedBeams):
            outside = self.seen.unhidden(points, index, least)
        edged = np.flatnonzero(~self.of.flat[index])
        if len(edged):
            value = self.cones.part(rows(points, edged), index[edged])
            outside[:, edged] = np.maximum(outside[:, edged], value)
        return outside

    def _chance(self, s: Any, index: Int[np.ndarray, " P"]) -> Float[np.ndarray, "L *Q P"]:
        """Return the probabilities of signals of sensors, by each of the assumptions."""
        each = [_rows(rates, index) for rates in self.rates]
        return np.stack([in_time(per_frame(s, of), of) for of in each])

    def chance(
        self, points: Float[np.ndarray, "Q P 3"], index: Int[np.ndarray, " P"]
    ) -> Float[np.ndarray, "L Q P"]:
        """Return the probability that sensors detect a piece in time, Q places for each; by each of
        the assumptions.

        Args:
            points: places, m; Q places close to each other take less time than others.
            index: the sensors.
        """
        at, of = self._place(points, index), _rows(self.of, index)
        a = aspect(at, self._vertical(index), of, self.extent)
        s = strength(a, of, self.extent)
        bright = s > self.faint[:, None, index]
        some = np.flatnonzero(bright.any(axis=(0, 1)))
        width = lit(np.maximum(a.part.along, NIL), a.cross, of, self.extent)
        width = Lit(*(np.broadcast_to(w, s.shape)[:, some] for w in width))
        raised, index = _raised(rows(points, some), a.step[:, some]), index[some]
        outside = self._outside(raised, index, (width.within / 2 - width.zone).min(axis=0))
        p: np.ndarray = np.zeros(bright.shape)
        p[..., some] = self._chance(s[:, some] * view(outside, width), index)
        p[~bright] = 0.0
        return p

    def chances(self, points: Points, index: Int[np.ndarray, " P"], reach: float) -> Chances:
        """Return bounds of ``chance`` in balls of radius ``reach`` m about points."""
        at, up, of = self._place(points, index), self._vertical(index), _rows(self.of, index)
        a = aspect(at, up, of, self.extent)
        low, high, slack, narrow, wide = ends(a, at, up, of, self.extent, reach)
        bright = [s > self.faint[:, index] for s in (low, high)]
        some = np.flatnonzero(bright[1].any(axis=0))
        raised, index = _raised(rows(points, some), a.step[some]), index[some]
        outside = self._outside(raised[None], index, np.full(len(some), -np.inf))[0]
        matters, each = np.zeros(len(points), bool), np.zeros((2, *bright[0].shape))
        for i, (s, sign, width) in enumerate(((low, 1, narrow), (high, -1, wide))):
            shown = view(outside + sign * slack[some], Lit(*(w[some] for w in width)))
            s = s[some] * shown
            each[i][:, some] = self._chance(s, index)
            each[i][~bright[i]] = 0.0
        matters[some] = (s > self.faint[:, index]).any(axis=0)
        return Chances(each[0], each[1], matters)

    def together(
        self, chance: Float[np.ndarray, "*Q P"], cell: Int[np.ndarray, " P"], cells: int
    ) -> Float[np.ndarray, "*Q C"]:
        """Return the probability that enough sensors detect the piece in each cell, from those of
        pairs of an ascending cell and a sensor."""
        count = np.bincount(cell, minlength=cells)
        rank = np.arange(len(cell)) - np.repeat(np.cumsum(count) - count, count)
        each = np.zeros((max(count.max(initial=0), 1), *chance.shape[:-1], cells))
        each[rank, ..., cell] = np.moveaxis(chance, -1, 0)
        p: np.ndarray = np.clip(at_least(self.at_least, np.moveaxis(each, 0, -1)), 0.0, 1.0)
        return p

    def at(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Return the probability that enough sensors detect a piece at points, m."""
        point, sensor = np.divmod(np.arange(len(points) * len(self)), max(len(self), 1))
        matters = self.chances(rows(points, point), sensor, 0.0).matters
        point, sensor = point[matters], sensor[matters]
        chance = self.chance(points[None, point], sensor)[:1]
        p: np.ndarray = self.together(chance, point, len(points))[0, 0]
        return p

    def decide(self, points: Points, cell: Part, index: Part, reach: float) -> Decision:
        """See ``Parts.decide``: a sensor matters that may detect the piece in the ball; none makes
        it certain in the whole ball."""
        return self.chances(points, index, reach).matters, np.zeros(len(index), bool)

    def shares(self, pairs: CubePairs) -> VolumeFraction:
        """Return bounds of the mean probability in each cube, up to the sensors left out; as those
        of a share, they combine with the shares of other solids."""
        each = self.chances(pairs.points, pairs.part, 3**0.5 / 2 * pairs.side + pairs.slack)
        low, high = (self.together(p[0], pairs.cell, pairs.cubes) for p in (each.low, each.high))
        return VolumeFraction(low, high)


def _raised(points: np.ndarray, step: np.ndarray) -> Float[np.ndarray, "*Q P 3"]:
    """Return points (..., 3) moved up, m."""
    raised = points.copy(order="K")
    raised[..., 2] += step
    return raised


def _rows(of: Detectors, index: Int[np.ndarray, " P"]) -> Detectors:
    return Detectors(*(a[index] for a in of))


def noticed(
    cones: Beams,
    occluders: Occluders,
    occlusion: Occlusion,
    of: Detectors,
    detection: Detection,
    *others: Detectors,
) -> Noticed:
    """Return where sensors detect a test piece among occluders.

    Args:
        cones: beams of K sensors, 64-bit NumPy.
        occluders: bodies and obstacles at the same pose.
        occlusion: the model of occlusion.
        of: what the sensors need, of the same order.
        detection: the piece, and how many sensors must detect it.
        others: what the sensors need by other assumptions.
    """
    rates = of, *others
    extent, r = detection.extent, detection.piece.width_m / 2
    faint = np.stack([_faint(each) for each in rates])
    up = np.asarray(cones.sides(np.arange(len(cones)))[1])
    farthest = _farthest(of, extent, faint.min(axis=0))
    farthest += extent.height / 2 * np.abs(cones.axis[:, 2])
    cones = replace(cones, range_m=np.where(of.flat, farthest, cones.range_m))
    # Seen from an apex outside a convex body K, what K hides meets a convex set that holds the apex
    # just if K does. That set holds the places from which the piece reaches into the beam, and all
    # within r of them, where the shadow may hide a part of it: a cone moved back along its axis.
    looks = around(cones)
    edge = r + np.where(of.flat, np.hypot(extent.width, extent.height) / 2, 0.0)
    back = edge / np.sin(looks.half_angle)
    looks = Cones(
        looks.apex - back[:, None] * looks.axis,
        looks.axis,
        looks.half_angle,
        looks.range_m + back + edge,
    )
    seen = beams(cones, occluders, occlusion, looks=looks)
    if isinstance(seen, OccludedBeams):  # a sensor inside a body sees nothing
        cones = seen.cones
        of = of._replace(reach=np.where(cones.range_m > 0, of.reach, -np.inf))
    return Noticed(cones, up, seen, of, rates, extent, detection.at_least, faint)


def _faint(of: Detectors) -> Float[np.ndarray, " K"]:
    """Return the signals of the probability ``NEGLIGIBLE``, from below."""
    return _last(lambda s: in_time(per_frame(s, of), of) <= NEGLIGIBLE, len(of.reach))[0]


def _farthest(
    of: Detectors, piece: Extent, faint: Float[np.ndarray, " K"]
) -> Float[np.ndarray, " K"]:
    """Return the depth of the nearest part up to which sensors may detect a piece, m: that of the
    largest silhouette in the centre of a zone."""
    middle, radius = of.middle, piece.width / 2
    largest = Extent(2**0.5 * piece.width, piece.height + piece.width)

    def bright(d: Any) -> Any:
        at = InBeam(d, middle[:, 0] * d, middle[:, 1] * d)
        share = fill(aspect(at, LEVEL, of, largest), of)
        return share * (np.maximum(of.reach, 0.0) / np.maximum(d - radius, NIL)) ** 2 > faint

    return _last(bright, len(of.reach))[1]


def _last(holds: Callable[[Any], Any], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return neighbouring values (count,), at the first of which ``holds`` is true and at the
    second not, for what holds up to a value between the ends."""
    low, high = (np.full(count, end) for end in _ENDS)
    for _ in range(_STEPS):
        middle = np.sqrt(low * high)
        more = holds(middle)
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    return low, high
