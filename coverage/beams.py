"""What sensors see past the robot's bodies and the cell's obstacles: cones, less shadows, cut where they are blinded.

A beam is one cone, or pyramid, and what stands in it: the largest of its function, of minus that of each shadow in it, and,
where the sensor is blinded, of the distance from the apex less that of the nearest thing. Bodies that do not meet a cone
(of a pyramid the cone around it) are sorted out once; a cell of the octree asks only for the shadows of the cones it still
knows.

A sensor of one zone reports the nearest thing in its beam, and is blinded beyond: one with a square beam by what is in the
cone around it, which blinds it a little too soon, never too late. Each of many zones reports the nearest thing in itself:
what stands in some leaves the others as they are, and ``blind`` does to the beam what ``shadow`` does.
"""

from dataclasses import dataclass, replace
from typing import Any

import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from .arrays import dot, root, rows
from .blinding import MARGIN, Beam, capsule_gap, capsule_in_beam, polyhedron_in_beam
from .blocks import Grid, Words, within, words
from .capsules import Capsules, gap_to_capsules
from .occlusion import Occlusion, Shadow, behind, capsule_shadow, nearest_ball, way
from .optics import Optics
from .polyhedra import Polyhedron, largest, planes_share, polyhedron_shadow
from .shadow_words import free_of_planes, free_of_shadows
from .share import Share, distance_tangent, either
from .solids import Cones, Parts

INSIDE = 1e-6  # m, an apex this near to a body's surface counts as within


@dataclass(frozen=True)
class Occluders:
    """What stands in the way at one pose: the robot's bodies, one axis of capsules, and convex obstacles."""

    bodies: Capsules | None = None
    obstacles: tuple[Polyhedron, ...] = ()

    def holds(self, apex: Float[np.ndarray, "K 3"]) -> tuple[Int[np.ndarray, " K"], Float[np.ndarray, " K"]]:
        """In which body or obstacle (K,) each apex stands deepest, bodies numbered first; -1: in none; and how deep, m."""
        gaps = [np.full((len(apex), 1), np.inf)]
        if self.bodies is not None:
            start, end, radius = (a[None] for a in self.bodies)
            each = [gap_to_capsules(apex, start[:, [i]], end[:, [i]], radius[:, [i]]) for i in range(radius.shape[1])]
            gaps.append(np.stack(each, axis=-1))
        gaps += [body(apex)[:, None] for body in self.obstacles]
        gap = np.concatenate(gaps[1:] or gaps, axis=1)
        least = gap.min(axis=1)
        return np.where(least <= INSIDE, gap.argmin(axis=1), -1), np.maximum(-least, 0.0)


@dataclass(frozen=True)
class Beams(Parts):
    """A union of beams of K sensors.

    cones: of K sensors, or ``Optics`` where some are pyramids; one that stands in something has the range minus infinity
    and sees nothing. stop, late (K,) m: distance from the apex where a sensor is blinded, infinite where it is not; the two
    bracket it where that was asked. shadows (S), first_shadow (K + 1,): those of sensor k are first_shadow[k] up to the
    next. normal (T, M, 3), offset (T, M) m, first_planes (K + 1,): the same of obstacles.
    """

    cones: Cones
    stop: Float[np.ndarray, " K"]
    late: Float[np.ndarray, " K"]
    shadows: Shadow
    first_shadow: Int[np.ndarray, " K1"]
    normal: Float[np.ndarray, "T M 3"]
    offset: Float[np.ndarray, "T M"]
    first_planes: Int[np.ndarray, " K1"]

    def __len__(self) -> int:
        return len(self.cones)

    def part(self, points: Any, index: Any) -> Any:
        value = self._past(points, index, self.cones.part(points, index))
        return np.maximum(value, self._beyond(points, index, self.stop))

    def _beyond(self, points: Any, index: Any, stop: Any) -> Any:
        if not np.isfinite(stop).any():
            return -np.inf
        v = points - rows(self.cones.apex, index)
        return root(dot(v, v)) - stop[index]

    def _past(self, points: Any, index: Any, value: Any, limit: float = np.inf) -> Any:
        """The larger of ``value`` and of what the shadows say; what is above ``limit`` is not looked at any more."""
        if np.ndim(index) == 0:
            return self._past_one(points, int(index), value)
        value = value.copy()
        for first, behind_of in ((self.first_shadow, self._behind), (self.first_planes, self._behind_planes)):
            count = (first[1:] - first[:-1])[index]
            for rank in range(int(count.max(initial=0))):
                some = count > rank
                if limit < np.inf:
                    some &= (value <= limit).reshape(-1, len(index)).any(axis=0)
                todo = np.flatnonzero(some)
                if len(todo):
                    deep = behind_of(rows(points, todo), first[index[todo]] + rank)
                    value[..., todo] = np.maximum(value[..., todo], -deep)
        return value

    def _past_one(self, points: Any, index: int, value: Any) -> Any:
        for entry in range(self.first_shadow[index], self.first_shadow[index + 1]):
            value = np.maximum(value, -self._behind(points, entry))
        for entry in range(self.first_planes[index], self.first_planes[index + 1]):
            value = np.maximum(value, -self._behind_planes(points, entry))
        return value

    def _behind(self, points: Any, entry: Any) -> Any:
        return behind(points, self.shadows.rows(entry))

    def _behind_planes(self, points: Any, entry: Any) -> Any:
        return largest(points, self.normal[entry], self.offset[entry])

    def decide(
        self, points: Any, cell: Any, index: Any, reach: float
    ) -> tuple[Bool[np.ndarray, " P"], Bool[np.ndarray, " P"]]:
        """See ``Parts.decide``."""
        value = self.cones.part(points, index)
        value = np.maximum(value, self._beyond(points, index, self.late))
        value = self._past(points, index, value, reach)
        sure = value if self.late is self.stop else np.maximum(value, self._beyond(points, index, self.stop))
        return value <= reach, sure < -reach

    def shares(self, points: Any, cell: Any, index: Any, cubes: int, side: float, slack: float) -> Share:
        """See ``Parts.shares``. A shadow is convex: its share is bounded as that of any convex body, and what is left is the
        rest. A point of it lies as far from the ball that says its value at the cube's centre as from no other."""
        each, value, normal = self.cones.each_share(points, index, side, slack)
        if np.isfinite(self.late).any():
            v = points - rows(self.cones.apex, index)
            for stop, keep in ((self.stop[index], "low"), (self.late[index], "high")):
                cut = np.flatnonzero(np.sqrt(dot(v, v)) > stop - side - slack)
                ball = distance_tangent(v[cut], stop[cut], side).share(side, slack)
                both = each.only(cut) & ball
                getattr(each, keep)[cut] = getattr(both, keep)
        reach = 3**0.5 / 2 * side + slack
        for first, share_of in ((self.first_shadow, self._share), (self.first_planes, self._planes_share)):
            count = (first[1:] - first[:-1])[index]
            for rank in range(int(count.max(initial=0))):
                todo = np.flatnonzero(count > rank)
                entry = first[index[todo]] + rank
                near, hidden = share_of(rows(points, todo), entry, side, slack, reach)
                todo = todo[near]
                both = each.only(todo) & -hidden
                each.low[todo], each.high[todo] = both.low, both.high
        return either(cell, cubes, each, value, normal, side, slack)

    def _share(self, points: Any, entry: Any, side: float, slack: float, reach: float) -> tuple[Any, Share]:
        """Which cubes a shadow may reach, and the share of these that it holds."""
        shadow = self.shadows.rows(entry)
        ball = nearest_ball(points, shadow)
        near = np.flatnonzero(ball.distance() <= reach)
        return near, distance_tangent(way(ball, shadow)[near], ball.radius[near], side).share(side, slack)

    def _planes_share(self, points: Any, entry: Any, side: float, slack: float, reach: float) -> tuple[Any, Share]:
        near = np.flatnonzero(self._behind_planes(points, entry) <= reach)
        return near, planes_share(points[near], self.normal[entry[near]], self.offset[entry[near]], side, slack)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Box of the cones of those that see at all."""
        live = np.flatnonzero(self.cones.range_m > 0)
        if len(live) == 0:
            return np.zeros((2, 3))
        return jax.tree.map(lambda a: a[live], self.cones).bounds()


@words.register
def _(parts: Beams, grid: Grid, points: Any, index: Any) -> Words:
    """Voxels of blocks about ``points`` that lie in beam ``index``: those of the cone, of the ball where it is blinded, and
    of no shadow."""
    found = words(parts.cones, grid, points, index)
    stop = parts.stop[index]
    cut = np.flatnonzero(np.isfinite(stop))
    if len(cut):
        ball = grid.words(within(stop[cut], points[cut] - rows(parts.cones.apex, index[cut])))
        found.sure[cut] &= ball.sure
        found.maybe[cut] &= ball.maybe
    for first, planes in ((parts.first_shadow, False), (parts.first_planes, True)):
        count = (first[1:] - first[:-1])[index]
        for rank in range(int(count.max(initial=0))):
            todo = np.flatnonzero((count > rank) & (found.maybe != 0))
            if len(todo):
                entry = first[index[todo]] + rank
                if planes:
                    free = free_of_planes(grid, points[todo], parts.normal[entry], parts.offset[entry])
                else:
                    free = free_of_shadows(grid, points[todo], parts.shadows.rows(entry))
                found.sure[todo] &= free.sure
                found.maybe[todo] &= free.maybe
    return found


def beams(cones: Cones, occluders: Occluders, occlusion: Occlusion, bracketed: bool = False) -> Parts:
    """What the sensors of ``cones`` see under ``occlusion``: the cones themselves where nothing stands in the way.

    Obstacles shadow under ``ignore``, too, which ignores the robot alone; they blind, as the robot does, under ``blind``. A
    sensor that stands within something sees nothing. Sensors of many zones are shadowed under ``blind``, too: none of them
    is blinded as a whole.

    Args:
        cones: of K sensors, or ``Optics``, 64-bit NumPy.
        occluders: bodies and obstacles at the same pose.
        occlusion: ``ignore`` leaves out the robot's bodies.
        bracketed: keep bounds of where sensors are blinded, for the certified rule.
    """
    bodies = occluders.bodies if occlusion != "ignore" else None
    occluders = Occluders(bodies, occluders.obstacles)
    if bodies is None and not occluders.obstacles:
        return cones
    within_, _ = occluders.holds(np.asarray(cones.apex))
    live = within_ < 0
    cones = replace(cones, range_m=np.where(live, cones.range_m, -np.inf))
    stops = occlusion == "blind" and live & ~_zoned(cones)
    stop, late = _stops(cones, np.flatnonzero(stops), occluders, bracketed)
    return _beams(cones, stop, late, *_shadows(cones, np.flatnonzero(live & ~stops), occluders))


def _zoned(cones: Cones) -> Any:
    """Which of the beams are read zone by zone (K,)."""
    return np.asarray(cones.zoned) if isinstance(cones, Optics) else np.zeros(len(cones), bool)


def _looks(cones: Cones, k: Any) -> Beam:
    """The cones around beams ``k`` (K,)."""
    around = cones.around()
    return Beam(*(np.asarray(a)[k] for a in vars(around).values()))


def _in_capsules(function: Any, looks: Beam, bodies: Capsules | None, margin: float) -> Any:
    """What ``function`` of beam and capsule finds first (K, N)."""
    if bodies is None:
        return np.full((len(looks.apex), 0), np.inf)
    beam = Beam(*(a[:, None] for a in looks))
    return function(beam, bodies.start[None], bodies.end[None], bodies.radius[None], margin)[0]


def _in_obstacles(looks: Beam, occluders: Occluders, margin: float) -> Any:
    """Distances of what obstacles and beams have in common (K, O) m; infinite if nothing."""
    each = [polyhedron_in_beam(looks, body, margin) for body in occluders.obstacles]
    return np.stack(each, axis=1) if each else np.full((len(looks.apex), 0), np.inf)


def _stops(cones: Cones, k: Any, occluders: Occluders, bracketed: bool) -> tuple[Any, Any]:
    """Where sensors are blinded (K,) m, of which ``k`` can be: early and late, the same array where not bracketed."""
    looks, stops = _looks(cones, k), []
    for margin in (MARGIN, -MARGIN) if bracketed and len(k) else (0.0,):
        stop = np.full(len(cones), np.inf)
        if len(k):
            bodies = _in_capsules(capsule_in_beam, looks, occluders.bodies, margin)
            found = np.concatenate([bodies, _in_obstacles(looks, occluders, margin)], axis=1)
            stop[k] = found.min(axis=1, initial=np.inf) - margin
        stops.append(stop)
    return stops[0], stops[-1]


def _shadows(cones: Cones, k: Any, occluders: Occluders) -> tuple[Shadow | None, list, list]:
    """The shadows in beams ``k``: of bodies, the sensor of each, and of obstacles (sensor, normal, offset)."""
    if len(k) == 0:
        return None, [], []
    looks, bodies, wide = _looks(cones, k), occluders.bodies, 10 * MARGIN
    apex = np.asarray(looks.apex)
    meets = _in_capsules(capsule_gap, looks, bodies, wide) <= 0
    met = np.isfinite(_in_obstacles(looks, occluders, wide))
    sensor, body = np.nonzero(meets)
    shadows = None
    if bodies is not None:
        shadows = capsule_shadow(apex[sensor], bodies.start[body], bodies.end[body], bodies.radius[body])
    planes = [polyhedron_shadow(apex, body) for body in occluders.obstacles]
    entries = [(k[s], planes[o][0][s], planes[o][1][s]) for s, o in zip(*np.nonzero(met), strict=True)]
    return shadows, list(k[sensor]), entries


def _beams(cones: Cones, stop: Any, late: Any, shadows: Shadow | None, sensor: list, planes: list) -> Beams:
    """Shadows of ``sensor`` (S,) and planes (sensor, normal, offset) in the order of their sensors."""
    count = len(cones)
    if shadows is None:
        none = np.zeros((0, 3))
        shadows = capsule_shadow(none, none, none, np.zeros(0))
    most = max((int((offset < 1e8).sum()) for _, _, offset in planes), default=1)
    normal, offset = np.zeros((len(planes), most, 3)), np.full((len(planes), most), 1e9)
    for i, (_, n, o) in enumerate(planes):
        real = o < 1e8
        normal[i, : real.sum()], offset[i, : real.sum()] = n[real], o[real]
    first = [np.searchsorted(np.array(of, int), np.arange(count + 1)) for of in (sensor, [s for s, _, _ in planes])]
    return Beams(cones, stop, late, shadows, first[0], normal, offset, first[1])
