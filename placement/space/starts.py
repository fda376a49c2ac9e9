"""Starts of a search: random candidates, and those like given setups. In none of them do rings of
different links collide."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...coverage.rings.ring import Setup
from ...objectives.named_layouts import ring_layout
from .design import Candidate, Space
from .feasible_set import InfeasibleError, Rng

PAPER_TILTS_DEG = (55.0, 25.0, 0.0)
_TRIES = 200  # draws of links with room for all rings
_DRAWS = 100  # random candidates of which one has rings that do not collide
_MOVES = 10  # attempts to move the rings of one candidate apart, by growing distances


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


def feasible(space: Space, c: Candidate, rng: Rng) -> Candidate | None:
    """Return the candidate if none of its rings collide, else one with all values a little other,
    or more; None if that is not enough."""
    low, high = (edge[:, : space.places] for edge in space.box(c))
    for reach in np.linspace(0.0, 0.5, _MOVES):
        off = reach * rng.standard_normal(c.values.shape) * (high - low)
        there = replace(c, values=np.clip(c.values + off, low, high))
        if space.apart(there):
            return there
    return None


def fresh(space: Space, rng: Rng) -> Candidate:
    """Return a random candidate that satisfies all rules and uses all sensors.

    Raises:
        InfeasibleError: if rings of different links collide in every candidate that was tried.
    """
    for _ in range(_DRAWS):
        drawn = _drawn(space, rng)
        if (c := feasible(space, drawn, rng)) is not None:
            return c
    raise InfeasibleError(
        f"{space.collision(drawn)}, and rings collide at every placement tried; use fewer rings,"
        ' other limits, or mount = "free"'
    )


def _drawn(space: Space, rng: Rng) -> Candidate:
    """Return a random candidate, whose rings may collide."""
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
