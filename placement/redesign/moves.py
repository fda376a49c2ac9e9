"""Random changes to one more ring of a setup: place, tilt, phase, number of sensors."""

import math
from dataclasses import replace

import numpy as np

from ...coverage.rings.ring import Ring
from ..space.feasible_set import Rng, segment_length
from .changes import Touched
from .problem import RedesignProblem

# probabilities: new tilt, new place, both, another link
_WHERE = np.array([0.2, 0.2, 0.4, 0.2])
_COUNT = 0.5  # probability of moving sensors between rings where that is possible


def touched(work: RedesignProblem, t: Touched, place: int, rng: Rng) -> Touched | None:
    """Touch one more place of ``t`` at random; return None if that is impossible.

    This function applies the rules on sensor counts; ``RedesignProblem.placed`` applies those on
    place and tilt.
    """
    free, before = tuple(sorted((*t.free, place))), work.before[place]
    if before is None:
        return _added(work, replace(t, free=free), place, rng)
    rings = list(t.rings)
    rings[place] = _drawn(work, free, before, rng)
    t = replace(t, rings=tuple(rings), free=free)
    return _shifted(work, t, place, rng) if rng.uniform() < _COUNT else t


def _drawn(work: RedesignProblem, free: tuple[int, ...], ring: Ring, rng: Rng) -> Ring:
    """Return a ring at a random place."""
    how = int(rng.choice(len(_WHERE), p=_WHERE))
    links = [s.link for s in work.segments(free)]
    if how == 3 and set(links) - {ring.link}:
        return _somewhere(work, free, replace(ring, link=""), rng)
    drawn = _somewhere(work, free, ring, rng) if ring.link in links else ring
    if how == 0:
        drawn = replace(drawn, position=ring.position)
    return replace(drawn, tilt=ring.tilt) if how == 1 else drawn


def _somewhere(work: RedesignProblem, free: tuple[int, ...], ring: Ring, rng: Rng) -> Ring:
    """Return a ring with random place, tilt and phase, on its own link or, without a link,
    on any."""
    segments = [s for s in work.segments(free) if ring.link in ("", s.link)]
    length = np.array([segment_length(work.scene, s) for s in segments])
    s = segments[int(rng.choice(len(segments), p=length / length.sum()))]
    place, tilt = rng.uniform(s.low, s.high), rng.uniform(*work.scene.limits_of(s.link).tilt)
    phase = rng.uniform(0, 2 * math.pi / ring.count)
    if work.clear is not None and (
        s.link != ring.link or ring.radius < work.scene.least_radius(s.link)
    ):
        ring = replace(ring, radius=work.radii[s.link])
    return replace(ring, link=s.link, position=float(place), tilt=float(tilt), phase=float(phase))


def _added(work: RedesignProblem, t: Touched, place: int, rng: Rng) -> Touched | None:
    """Add a new ring with spare sensors or with sensors of another touched ring."""
    least, most = work.scene.rules.sensors
    spare = work.sensors - t.sensors
    counts = {i: ring.count for i in t.free if (ring := t.rings[i]) is not None}
    # ring that gives, fewest sensors, most sensors
    gifts = [(i, max(1, least - spare, n - most), min(n - least, most)) for i, n in counts.items()]
    gifts = [gift for gift in gifts if gift[1] <= gift[2]]
    if gifts and (spare < least or rng.uniform() < _COUNT):
        giver, low, high = gifts[int(rng.choice(len(gifts)))]
        given = int(rng.integers(low, high + 1))
        t, spare = _with_counts(t, {giver: -given}), spare + given
    if spare < least or not work.segments(t.free):
        return None
    ring = Ring("", 0.0, min(spare, most), 0.0, 0.0, work.scene.default_radius, work.scene.sensor)
    ring = _somewhere(work, t.free, ring, rng)
    ring = replace(ring, sensor=work.scene.sensor_of(ring.link))
    like = next((r for r in work.mounted.rings if r.link == ring.link), ring)
    rings = list(t.rings)
    rings[place] = replace(ring, radius=work.radii[ring.link], sensor=like.sensor)
    return replace(t, rings=tuple(rings))


def _with_counts(t: Touched, more: dict[int, int]) -> Touched:
    """Add sensors ``more`` to the rings at some places; a ring left without sensors is removed."""
    rings = list(t.rings)
    for i, n in more.items():
        if (ring := rings[i]) is not None:
            rings[i] = replace(ring, count=ring.count + n) if ring.count + n else None
    return replace(t, rings=tuple(rings))


def _shifted(work: RedesignProblem, t: Touched, place: int, rng: Rng) -> Touched:
    """Give the ring at ``place`` sensors that are spare or come from another touched ring, or move
    some or all of its sensors to another; return ``t`` if none can move."""
    least, most = work.scene.rules.sensors
    counts = {i: ring.count for i in t.free if (ring := t.rings[i]) is not None}
    here, others = counts[place], [i for i in counts if i != place]
    # ring that gives (-1: the spare sensors), ring that receives, fewest sensors, most sensors
    gifts = [(-1, place, max(1, least - here), min(work.sensors - t.sensors, most - here))]
    for giver, taker in [*((i, place) for i in others), *((place, i) for i in others)]:
        a, b = counts[giver], counts[taker]
        gifts.append((giver, taker, max(1, least - b, a - most), min(a - least, most - b)))
        # all sensors: the ring that gives is removed
        gifts.append((giver, taker, max(a, least - b), min(a, most - b)))
    gifts = [gift for gift in gifts if gift[2] <= gift[3]]
    if not gifts:
        return t
    giver, taker, low, high = gifts[int(rng.choice(len(gifts)))]
    given = int(rng.integers(low, high + 1))
    if giver < 0:  # it is mostly best to use all spare sensors
        return _with_counts(t, {taker: high if rng.uniform() < _COUNT else given})
    return _with_counts(t, {giver: -given, taker: given})
