"""Free segments of the links: intervals of position on which new rings may sit, as functions of the
ring's tilt.

The envelope of a real ring depends on its tilt, and so do the ends of a free interval and the
distance of two rings. Both are tabulated at the tilts ``TILTS`` and interpolated between them. A
table's value holds for all tilts up to its two neighbours in ``TILTS``, so an interpolated value
errs on the safe side.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, reduce
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from .scene import Scene

# share of a link: files round positions to it, so bounds and spacings are rounded to the safe side
GRAIN = 1e-6
TILTS = np.radians(np.arange(-90.0, 90.1, 2.5))
"""Tilts (T,) at which segments are tabulated, rad, evenly spaced."""
LOW, HIGH, ABOVE, BELOW = range(4)
"""Rows of a segment's table: its lower and its upper end, and the extents of a ring's envelope from
the plane of its lenses towards distal and towards proximal, as shares of the link. ABOVE includes
the clearance of envelopes."""
Table = Float[np.ndarray, "4 T"]
Stretches = list[tuple[float, float]]


@dataclass(frozen=True)
class Segment:
    """An interval of a link on which rings may sit."""

    link: str
    """Name of the link."""
    low: float
    """Lower end for any tilt, in [0, 1] along the mount axis."""
    high: float
    """Upper end for any tilt, in [0, 1] along the mount axis."""
    room: int
    """Maximum number of rings on the segment, if there are none on its neighbours."""
    gap: float
    """Minimum spacing of two rings of any tilts as a share of the link."""
    least: float
    """Minimum spacing of two rings by the rules as a share of the link."""
    by_tilt: Table = field(compare=False, repr=False)
    """Ends and extents (4, T) by tilt."""

    @cached_property
    def loose(self) -> bool:
        """Whether a ring can move on the segment at any tilt."""
        return bool(np.any(self.by_tilt[HIGH] > self.by_tilt[LOW]))


@dataclass(frozen=True)
class Room:
    """Room for the bodies of new rings on a link."""

    clear: Sequence[Sequence[tuple[float, float]]]
    """Intervals of position on which a ring is clear, for each of ``TILTS``."""
    extents: Float[np.ndarray, "2 T"]
    """Extents of a ring's envelope towards distal, with the clearance, and towards proximal, m."""


def segments(scene: Scene, rooms: Mapping[str, Room] | None = None) -> list[Segment]:
    """Return all segments of all links on which new rings may sit.

    Limits, keep-outs, joints and fixed rings bound them, and where rings have bodies also the
    ``rooms`` on each link. Every place that is legal for all tilts lies on a segment. Two segments
    of a link may be nearer to each other than the spacing of rings: see ``fits`` and ``stretch``.
    """
    free, rules = list[Segment](), scene.rules
    for mount in scene.robot.mounts:
        limits, link, length = scene.limits_of(mount.link), mount.link, mount.length
        fixed = [r.position for r in rules.fixed if r.link == link]
        clear = rooms[link].clear if rooms is not None else [[(-math.inf, math.inf)]]
        if length == 0:
            kept_out = any(low <= 0 <= high for low, high in limits.keep_out)
            if not fixed and not kept_out and all(clear):
                free.append(Segment(link, 0.0, 0.0, 1, 0.0, 0.0, np.zeros((4, len(TILTS)))))
            continue
        extents = np.zeros((2, len(TILTS))) if rooms is None else rooms[link].extents / length
        margin = rules.from_joints / length
        least = math.ceil(rules.spacing / length / GRAIN + 1e-9) * GRAIN
        gap = max(least, math.ceil(extents.max(axis=1).sum() / GRAIN + 1e-9) * GRAIN)
        allowed = [(max(limits.position[0], margin), min(limits.position[1], 1 - margin))]
        for cut in (*limits.keep_out, *((p - least, p + least) for p in fixed)):
            allowed = _without(allowed, cut)
        by_tilt = [[_inward(*s) for s in _common(allowed, some)] for some in clear]
        ends = [(low, high) for low, high in reduce(_common, by_tilt) if low <= high]
        tables = _apart(ends, [_around(end, by_tilt) for end in ends], gap)
        for (low, high), table in zip(ends, tables, strict=True):
            room = rules.max_rings_per_link if gap == 0 else int((high - low) / gap + 1e-9) + 1
            room = min(room, rules.max_rings_per_link)
            some = np.concatenate([table, extents])
            free.append(Segment(link, low, high, room, gap, least, some))
    return free


def _inward(low: float, high: float) -> tuple[float, float]:
    return math.ceil(low / GRAIN - 1e-9) * GRAIN, math.floor(high / GRAIN + 1e-9) * GRAIN


def _without(stretches: Stretches, cut: tuple[float, float]) -> Stretches:
    """Return the intervals less the interval ``cut``.

    The ends of ``cut`` stay in the remainder unless they would be its only points.
    """
    remainder = []
    for low, high in stretches:
        if cut[1] <= low or cut[0] >= high:
            remainder.append((low, high))
        else:
            remainder += [(a, b) for a, b in ((low, cut[0]), (cut[1], high)) if a < b]
    return remainder


def _common(
    stretches: Sequence[tuple[float, float]], others: Sequence[tuple[float, float]]
) -> Stretches:
    """Return the intersection of two lists of intervals."""
    shared = [(max(a, c), min(b, d)) for a, b in stretches for c, d in others]
    return [(low, high) for low, high in sorted(shared) if low <= high]


def _around(end: tuple[float, float], by_tilt: Sequence[Stretches]) -> Float[np.ndarray, "2 T"]:
    """Return, for each tilt, the interval that contains the interval ``end``."""
    each = [next(s for s in some if s[0] <= end[0] and end[1] <= s[1]) for some in by_tilt]
    return np.broadcast_to(np.array(each).T, (2, len(TILTS))).copy()


def _apart(
    ends: Stretches, tables: list[Float[np.ndarray, "2 T"]], gap: float
) -> list[Float[np.ndarray, "2 T"]]:
    """Limit the tables of a link's segments so that rings on two segments that keep the spacing for
    all tilts keep it for each tilt."""
    for (a, b), (one, other) in zip(pairwise(ends), pairwise(tables), strict=True):
        more = math.floor(max(b[0] - a[1] - gap, 0.0) / 2 / GRAIN) * GRAIN
        one[HIGH] = np.minimum(one[HIGH], a[1] + more)
        other[LOW] = np.maximum(other[LOW], b[0] - more)
    return tables


def _near(a: Segment, b: Segment) -> bool:
    """Return whether ``b`` begins nearer to the end of ``a`` than the spacing of rings."""
    return a.link == b.link and b.low - a.high < a.gap - GRAIN / 2


def near_segments(some: Sequence[Segment]) -> frozenset[int]:
    """Return the numbers of the segments that are nearer to another one than the spacing."""
    near = set[int]()
    for i, (a, b) in enumerate(pairwise(some)):
        if _near(a, b):
            near |= {i, i + 1}
    return frozenset(near)


def fits(some: Sequence[Segment], which: Sequence[int]) -> bool:
    """Return whether rings on the segments ``which`` can keep the spacing.

    Each ring is put as low as possible, which leaves the most room for the others.
    """
    last: dict[str, float] = {}
    for i in sorted(k for k in which if k >= 0):
        s = some[i]
        place = max(s.low, last.get(s.link, -math.inf) + s.gap)
        if place > s.high + GRAIN / 2:
            return False
        last[s.link] = place
    return True


def most_rings(some: Sequence[Segment], link: str, most: int) -> int:
    """Return the largest number of rings, up to ``most``, that the segments of a link hold."""
    which: list[int] = []
    for i, s in enumerate(some):
        if s.link == link:
            which += [i] * s.room
            while len(which) > most or not fits(some, which):
                which.pop()
    return len(which)


def occupied(
    some: Sequence[Segment], which: Int[np.ndarray, " R"]
) -> dict[int, tuple[float, float]]:
    """Return the ends of the segments that hold rings, kept apart from each other.

    Where two of them are nearer than the spacing, each gives way by half, as far as its own rings
    leave room and no further than the others need.
    """
    count = {int(i): int(np.count_nonzero(which == i)) for i in sorted({*which.tolist()} - {-1})}
    ends = {i: (some[i].low, some[i].high) for i in count}
    pairs = [(i, j) for i, j in pairwise(count) if _near(some[i], some[j])]
    for i, j in reversed(pairs):  # the last place of a segment that leaves room for those above
        low, high = ends[i]
        ends[i] = low, min(high, ends[j][1] - count[j] * some[j].gap)
    for i, j in pairs:
        (low, high), (above, top), gap = ends[i], ends[j], some[j].gap
        if above - high < gap - GRAIN / 2:
            middle = math.floor((high + above - gap) / 2 / GRAIN + 1e-9) * GRAIN
            high = min(max(middle, low + (count[i] - 1) * gap), high)
            ends[i], ends[j] = (low, high), (max(above, high + gap), top)
    return ends
