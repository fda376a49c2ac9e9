"""Parameters of a placement: the free segments of every link, and the map from a box of values to
ring positions that satisfy all rules.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from ..coverage.arrays import Array, namespace
from ..coverage.pytrees import tree
from ..coverage.rings.ring_kinematics import RingArrays
from .scene import CoreScene

# share of a link: files round positions to it, so bounds and spacings are rounded to the safe side
GRAIN = 1e-6


@dataclass(frozen=True)
class Segment:
    """An interval of a link on which rings may sit."""

    link: str
    """Name of the link."""
    low: float
    """Lower end, in [0, 1] along the mount axis."""
    high: float
    """Upper end, in [0, 1] along the mount axis."""
    room: int
    """Maximum number of rings on the segment, if there are none on its neighbours."""
    gap: float
    """Minimum spacing of two rings as a share of the link."""


def _inward(low: float, high: float) -> tuple[float, float]:
    return math.ceil(low / GRAIN - 1e-9) * GRAIN, math.floor(high / GRAIN + 1e-9) * GRAIN


def _without(
    stretches: list[tuple[float, float]], cut: tuple[float, float]
) -> list[tuple[float, float]]:
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
) -> list[tuple[float, float]]:
    """Return the intersection of two lists of intervals."""
    shared = [(max(a, c), min(b, d)) for a, b in stretches for c, d in others]
    return [(low, high) for low, high in sorted(shared) if low <= high]


@dataclass(frozen=True)
class Room:
    """Room for the bodies of new rings on a link."""

    clear: Sequence[tuple[float, float]]
    """Intervals of position on which a ring is clear."""
    spacing: float
    """Minimum distance of two rings, m."""


def segments(scene: CoreScene, rooms: Mapping[str, Room] | None = None) -> list[Segment]:
    """Return all segments of all links on which new rings may sit.

    Limits, keep-outs, joints and fixed rings bound them, and where rings have bodies also the
    ``rooms`` on each link. Every legal place lies on a segment. Two segments of a link may be
    nearer to each other than the spacing of rings: see ``fits`` and ``stretch``.
    """
    free, rules = [], scene.rules
    for mount in scene.robot.mounts:
        limits, fixed = (
            scene.limits_of(mount.link),
            [r.position for r in rules.fixed if r.link == mount.link],
        )
        if mount.length == 0:
            barred = rooms is not None and not rooms[mount.link].clear
            if (
                not fixed
                and not barred
                and not any(low <= 0 <= high for low, high in limits.keep_out)
            ):
                free.append(Segment(mount.link, 0.0, 0.0, 1, 0.0))
            continue
        margin = rules.from_joints / mount.length
        apart = rules.spacing if rooms is None else rooms[mount.link].spacing
        gap = math.ceil(apart / mount.length / GRAIN + 1e-9) * GRAIN
        stretches = [(max(limits.position[0], margin), min(limits.position[1], 1 - margin))]
        if rooms is not None:
            stretches = _common(stretches, rooms[mount.link].clear)
        for cut in (*limits.keep_out, *((p - gap, p + gap) for p in fixed)):
            stretches = _without(stretches, cut)
        for low, high in (_inward(*s) for s in sorted(stretches)):
            if low <= high:
                room = rules.max_rings_per_link if gap == 0 else int((high - low) / gap + 1e-9) + 1
                free.append(
                    Segment(mount.link, low, high, min(room, rules.max_rings_per_link), gap)
                )
    return free


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


def _occupied(
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


@tree
@dataclass(frozen=True)
class Interval:
    """The segment of each of R rings, as arrays (R,)."""

    segment: Int[Array, "*batch R"]
    """Index of the segment."""
    low: Float[Array, "*batch R"]
    """Lower end of the segment."""
    free: Float[Array, "*batch R"]
    """Length of the segment less the spacings of its rings."""
    gap: Float[Array, "*batch R"]
    """Spacing of two rings on the segment."""
    tilt_of: Int[Array, "*batch R"]
    """Index of the ring whose tilt each ring takes."""
    sign: Float[Array, "*batch R"]
    """Sign of that tilt."""


# the rings of a setup and the segments on which they sit
SetupArrays = tuple[RingArrays, Interval]


def stretch(
    found: list[Segment],
    which: Int[np.ndarray, " R"],
    shared: Float[np.ndarray, " R"] | None = None,
) -> Interval:
    """Return the segments of rings as arrays.

    Segments that hold rings are kept apart by the spacing: rings on them keep it for any values.

    Args:
        found: the available segments.
        which: index (R,) of each ring's segment; -1 for a slot without a ring.
        shared: sign (R,) of the tilt that all rings share; None if each ring has its own tilt.
    """
    none, ends = Segment("", 0.0, 0.0, 0, 0.0), _occupied(found, which)
    each = [replace(found[i], low=ends[i][0], high=ends[i][1]) if i >= 0 else none for i in which]
    rings = np.array([max(np.count_nonzero(which == i), 1) for i in which])
    gap = np.array([s.gap for s in each])
    free = np.array([s.high - s.low for s in each]) - (rings - 1) * gap
    number = np.where(which >= 0, which, -1 - np.arange(len(which)))
    tilt_of = np.arange(len(which)) if shared is None else np.zeros(len(which), int)
    sign = np.ones(len(which)) if shared is None else np.asarray(shared, float)
    return Interval(
        number, np.array([s.low for s in each]), np.maximum(free, 0.0), gap, tilt_of, sign
    )


def decode(where: Interval, values: Float[Array, "3 R"]) -> Float[Array, "3 R"]:
    """Return positions, tilts and phases (3, R) for values in a box.

    The first row of the values runs from 0 to 1 over the free length of each ring's segment. The
    rings of a segment are ranked by that row, and each ring is shifted by one spacing for every
    ring below it. All rings thus keep the spacing for any values, and every such placement can be
    reached.
    """
    xp = namespace(values)
    along = values[0]
    each = xp.arange(along.shape[0])
    below = (along[None] < along[:, None]) | (
        (along[None] == along[:, None]) & (each[None] < each[:, None])
    )
    rank = xp.sum(below & (where.segment[None] == where.segment[:, None]), axis=1)
    position = where.low + along * where.free + rank * where.gap
    placed: Array = xp.stack([position, where.sign * values[1][where.tilt_of], values[2]])
    return placed


def value_slopes(
    where: Interval,
    position: Float[np.ndarray, " R"],
    tilt: Float[np.ndarray, " R"],
    phase: Float[np.ndarray, " R"],
) -> Float[np.ndarray, "3 R"]:
    """Return the gradient (3, R) by the values that ``decode`` reads.

    Args:
        where: the rings' segments.
        position: gradient (R,) by the positions.
        tilt: gradient (R,) by the tilts.
        phase: gradient (R,) by the phases.
    """
    return np.stack(
        [position * where.free, np.bincount(where.tilt_of, where.sign * tilt, len(tilt)), phase]
    )


def encode(where: Interval, position: Float[np.ndarray, " R"]) -> Float[np.ndarray, " R"]:
    """Return the first row of the values whose positions are nearest to ``position``."""
    order = np.lexsort((np.arange(len(position)), position))
    rank = np.zeros(len(position), int)
    for place, i in enumerate(order):
        rank[i] = sum(where.segment[j] == where.segment[i] for j in order[:place])
    free = np.asarray(where.free)
    along = (position - where.low - rank * np.asarray(where.gap)) / np.where(free > 0, free, 1.0)
    return np.clip(np.where(free > 0, along, 0.0), 0.0, 1.0)
