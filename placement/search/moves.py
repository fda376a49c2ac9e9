"""Random candidates, and random variations of a candidate: one ring, or the division of sensors
among rings."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...coverage.rings.ring import Setup
from .design import Candidate, Space
from .feasible_set import Rng
from .layout import ring_layout

PAPER_TILTS_DEG = (55.0, 25.0, 0.0)
_TRIES = 200
# probabilities of a redrawn ring and of the moves of sensors below, where the number of rings is
# free and where it is stated
_ODDS = np.array([0.1, 0.2, 0.1, 0.1, 0.1, 0.1, 0.3])
_ODDS_OF_RINGS = np.array([0.1, 0.3, 0.0, 0.0, 0.2, 0.1, 0.3])


def _numbers(rng: Rng, total: int, parts: int, least: int, most: int) -> list[int]:
    """Return ``total`` as a sum of ``parts`` integers between ``least`` and ``most``, mostly of
    similar size."""
    even = rng.uniform() < 0.5
    weights = np.ones(parts) if even else rng.dirichlet(np.full(parts, 4.0)) * parts
    numbers = np.clip(np.round(weights * total / parts).astype(int), least, most)
    while (lack := total - numbers.sum()) != 0:
        can = np.flatnonzero(numbers < most if lack > 0 else numbers > least)
        numbers[rng.choice(can)] += int(np.sign(lack))
    listed: list[int] = numbers.tolist()
    return listed


def fresh(space: Space, rng: Rng) -> Candidate:
    """Return a random candidate that satisfies all rules and uses all sensors."""
    for _ in range(_TRIES):
        if space.layout:
            wanted = [(ring.link, ring.count) for ring in space.layout.rings]
        elif space.free == 0:
            wanted = []
        else:
            fewest = space.rings or math.ceil(space.free / space.most)
            rings = int(rng.integers(fewest, space.places + 1)) if space.places > fewest else fewest
            wanted = [("", n) for n in _numbers(rng, space.free, rings, space.least, space.most)]
        segment: list[int] = []
        for link, _ in wanted:
            free = space.room(segment, link or None, wanted[len(segment)][1])
            if not free:
                break
            segment.append(space.pick(rng, free))
        if len(segment) == len(wanted):
            return _filled(space, segment, [n for _, n in wanted], rng)
    return _filled(space, *_largest_first(space), rng)


def _largest_first(space: Space) -> tuple[list[int], list[int]]:
    """Return segments and counts of the fewest rings that hold all sensors, or of the stated number
    of rings, where the largest ring differs from link to link."""
    segment: list[int] = []
    most: list[int] = []
    while (
        (sum(most) < space.free or space.rings is not None)
        and len(most) < space.places
        and (free := space.room(segment))
    ):
        caps = [space.most_on(space.segments[i].link) for i in free]
        segment.append(free[int(np.argmax(caps))])
        most.append(max(caps))
    count, rest = [space.least] * len(most), space.free - space.least * len(most)
    for i, cap in enumerate(most):
        more = min(rest, cap - count[i])
        count[i], rest = count[i] + more, rest - more
    if rest or any(n > cap for n, cap in zip(count, most, strict=True)):
        raise RuntimeError("no candidate satisfies the rules")
    return segment, count


def _filled(space: Space, segment: Sequence[int], count: Sequence[int], rng: Rng) -> Candidate:
    spare = space.places - len(segment)
    c = Candidate(
        np.array([*segment, *[-1] * spare], int),
        np.array([*count, *[0] * spare], int),
        np.zeros((3, space.places)),
        rng.choice([-1.0, 1.0], space.places),
    )
    low, high = (edge[:, : space.places] for edge in space.box(c))
    return replace(c, values=rng.uniform(low, high))


def papers(space: Space) -> list[Candidate]:
    """Return the layout with each of the paper's tilts, where the rules leave room for it."""
    if space.layout is None:
        return []
    candidates = []
    even = ring_layout(space.scene, 1, 1) if not space.layout.rings else space.layout
    for tilt_deg in PAPER_TILTS_DEG:
        rings = []
        for ring in even.rings:
            low, high = space.scene.limits_of(ring.link).position
            toward = np.sign(round((low + high) / 2 - ring.position, 9)) * (
                space.scene.robot.mount(ring.link).length > 0
            )
            rings.append(replace(ring, tilt=float(toward * math.radians(tilt_deg))))
        c = space.candidate(replace(even, rings=tuple(rings)))
        candidates += [c] if c is not None else []
    return candidates


def fitted(space: Space, setup: Setup) -> Candidate | None:
    """Return the candidate most similar to a setup with another sensor count.

    The largest rings give sensors first, the smallest receive first. The result is None if the
    rules leave no place for the rings.
    """
    rings = [ring for ring in setup.rings if ring not in space.fixed]
    if space.layout is None:
        while rings and (len(rings) > space.places or len(rings) * space.least > space.free):
            rings.remove(min(rings, key=lambda ring: ring.count))
        counts = [min(max(ring.count, space.least), space.most) for ring in rings]
        while rings and (lack := space.free - sum(counts)) != 0:
            can = [
                i for i, n in enumerate(counts) if (n < space.most if lack > 0 else n > space.least)
            ]
            if not can:
                return None
            most = max(can, key=lambda i: counts[i] if lack < 0 else -counts[i])
            counts[most] += 1 if lack > 0 else -1
        rings = [replace(ring, count=n) for ring, n in zip(rings, counts, strict=True)]
    if not rings and space.free > 0:
        return None
    return space.candidate(Setup(tuple(rings)))


def vary(space: Space, c: Candidate, rng: Rng) -> Candidate:
    """Return a candidate that differs from ``c`` in one ring, or in the division of a few sensors.

    One changed ring is often enough to get from a good combination of rings to a better one.
    """
    if not len(c.rings):
        return c
    odds = _ODDS if space.rings is None else _ODDS_OF_RINGS
    move = 0 if space.layout else int(rng.choice(len(odds), p=odds))
    varied = (_ring, _shift, _split, _merge, _move, _swap, _resize)[move](space, c, rng)
    return _ring(space, c, rng) if varied is None or not space.holds(varied) else varied


def _drawn(space: Space, c: Candidate, i: int, rng: Rng) -> Candidate:
    """Return ``c`` with random values of ring ``i``."""
    low, high = space.limits(int(c.segment[i]), int(c.count[i]))
    values, sign = c.values.copy(), c.sign.copy()
    values[:, i], sign[i] = rng.uniform(low, high), rng.choice([-1.0, 1.0])
    if space.scene.rules.shared_tilt:
        values[1] = c.values[1]
    return replace(c, values=values, sign=sign)


def _ring(space: Space, c: Candidate, rng: Rng) -> Candidate:
    """Redraw the values of one ring."""
    return _drawn(space, c, int(rng.choice(c.rings)), rng)


def _move(space: Space, c: Candidate, rng: Rng) -> Candidate | None:
    """Move one ring to another segment."""
    i = int(rng.choice(c.rings))
    others = [int(s) for j, s in enumerate(c.segment) if j != i]
    free = space.room(others, count=int(c.count[i]))
    if not free:
        return None
    segment = c.segment.copy()
    segment[i] = space.pick(rng, free)
    return _drawn(space, replace(c, segment=segment), i, rng)


def _shift(space: Space, c: Candidate, rng: Rng) -> Candidate | None:
    """Move a few sensors from one ring to another."""
    if len(c.rings) < 2:
        return None
    a, b = rng.choice(c.rings, 2, replace=False)
    n = min(int(rng.integers(1, 5)), int(c.count[a]) - space.least, space.most - int(c.count[b]))
    if n <= 0:
        return None
    count = c.count.copy()
    count[a], count[b] = count[a] - n, count[b] + n
    return _turned(space, replace(c, count=count))


def _turned(space: Space, c: Candidate) -> Candidate:
    """Clip phases and tilts to the bounds that hold for the rings' counts."""
    low, high = (edge[:, : space.places] for edge in space.box(c))
    values = c.values.copy()
    values[2] = np.clip(values[2], low[2], high[2])
    moved = [0] if space.scene.rules.shared_tilt else c.rings
    values[1, moved] = np.clip(values[1, moved], low[1, moved], high[1, moved])
    return replace(c, values=values)


def _split(space: Space, c: Candidate, rng: Rng) -> Candidate | None:
    """Split one ring into two."""
    spare = np.flatnonzero(c.segment < 0)
    wide = [i for i in c.rings if c.count[i] >= 2 * space.least]
    free = space.room(c.segment.tolist())
    if not len(spare) or not wide or not free:
        return None
    i, j = int(rng.choice(wide)), int(spare[0])
    segment, count = c.segment.copy(), c.count.copy()
    part = int(rng.integers(space.least, count[i] - space.least + 1))
    segment[j], count[j], count[i] = space.pick(rng, free), part, count[i] - part
    return _drawn(space, _turned(space, replace(c, segment=segment, count=count)), j, rng)


def _merge(space: Space, c: Candidate, rng: Rng) -> Candidate | None:
    """Remove one ring and give its sensors to the others, starting with one random ring."""
    if len(c.rings) < 2:
        return None
    a, b = (int(i) for i in rng.choice(c.rings, 2, replace=False))
    rest = int(c.count[a])
    segment, count = c.segment.copy(), c.count.copy()
    segment[a], count[a], values = -1, 0, c.values.copy()
    if not space.scene.rules.shared_tilt:
        values[1, a] = 0.0
    values[0, a] = values[2, a] = 0.0
    for i in [b, *rng.permutation([int(i) for i in c.rings if i not in (a, b)])]:
        more = min(rest, space.most - int(count[i]))
        count[i], rest = count[i] + more, rest - more
    return None if rest else _turned(space, replace(c, segment=segment, count=count, values=values))


def _swap(space: Space, c: Candidate, rng: Rng) -> Candidate | None:
    """Exchange the sensor counts of two rings."""
    if len(c.rings) < 2:
        return None
    a, b = rng.choice(c.rings, 2, replace=False)
    count = c.count.copy()
    count[a], count[b] = count[b], count[a]
    return _turned(space, replace(c, count=count))


def _resize(space: Space, c: Candidate, rng: Rng) -> Candidate | None:
    """Give each ring of one size a sensor, or take one from each; other rings make up for it.

    Rings of one size fill each other's gaps, with phases half a spacing apart. One that changes
    alone loses that, so they change together, and phases stay the same share of a spacing.
    """
    sizes, rings = np.unique(c.count[c.rings], return_counts=True)
    if not (rings > 1).any():
        return None
    size, step = int(rng.choice(sizes[rings > 1])), int(rng.choice([-1, 1]))
    if not space.least <= size + step <= space.most:
        return None
    like = c.count == size
    count, values = c.count + step * like, c.values.copy()
    values[2, like] *= size / (size + step)
    for _ in range(int(like.sum())):
        after = count - step
        can = (c.segment >= 0) & ~like & (space.least <= after) & (after <= space.most)
        if not can.any():
            return None
        count[rng.choice(np.flatnonzero(can))] -= step
    return _turned(space, replace(c, count=count, values=values))
