"""Repair of candidates in which rings of different links collide.

No segment keeps such rings apart. The last candidates of a search are therefore checked, and their
rings are moved apart where all of them collide.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from ...objectives.feasibility.mounting import Standing, meeting
from .design import Candidate, Space
from .feasible_set import InfeasibleError, Rng
from .moves import fresh

_MOVES = 100  # attempts to move the rings of one candidate apart, by growing distances
_NEAR, _FAR = 0.02, 1.0  # distances of the first and last attempt, as a share of the free interval
_DRAWS = 100  # random candidates to try where no move is enough


def apart(space: Space, some: Sequence[Candidate], rng: Rng) -> list[Candidate]:
    """Return the candidates of ``some`` (at least one) whose rings do not collide at any pose.

    If all collide, their rings are moved along their links as little as necessary; if that fails,
    random candidates replace them.

    Raises:
        InfeasibleError: if every candidate collides; the message names the rings.
    """
    kept = [c for c in some if not collisions(space, c)]
    kept = kept or [m for m in (moved(space, c, rng) for c in some) if m is not None]
    if not kept:
        drawn = (fresh(space, rng) for _ in range(_DRAWS))
        kept = list(islice((c for c in drawn if not collisions(space, c)), len(some)))
    if not kept:
        text, allowed = (
            collisions(space, some[0])[0].text,
            'use fewer rings, other limits, or mount = "free"',
        )
        raise InfeasibleError(f"{text}, and rings collide at every placement tried; {allowed}")
    return kept


def collisions(space: Space, c: Candidate) -> list[Standing]:
    """Return the collisions of rings of different links at any pose, except those among fixed
    rings; none where rings have no bodies."""
    if space.clear is None:
        return []
    rings = space.setup(c).rings
    held = {i for i, ring in enumerate(rings) if ring in space.fixed}
    return [one for one in meeting(space.clear, rings) if not set(one.rings) <= held]


def colliding_links(space: Space, c: Candidate) -> tuple[str, ...]:
    """Return the links whose rings collide, in the order of the rings."""
    rings = space.setup(c).rings
    which = sorted({i for one in collisions(space, c) for i in one.rings})
    return tuple(dict.fromkeys(rings[i].link for i in which))


def moved(space: Space, c: Candidate, rng: Rng, attempts: int = _MOVES) -> Candidate | None:
    """Return the candidate with its colliding rings moved along their links; the first attempt
    without collisions, or None."""
    links = colliding_links(space, c)
    which = [i for i in c.rings if space.segments[c.segment[i]].link in links]
    low, high = (edge[0, : space.places] for edge in space.box(c))
    for reach in np.geomspace(_NEAR, _FAR, attempts):
        values = c.values.copy()
        values[0, which] += reach * rng.uniform(-1, 1, len(which))
        there = replace(c, values=np.concatenate([np.clip(values[:1], low, high), values[1:]]))
        if not collisions(space, there):
            return there
    return None
