"""Repair of candidates in which rings of different links collide.

No segment keeps such rings apart. The last candidates of a search are therefore checked, and their
rings are moved apart where all of them collide.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...objectives.feasibility.clearance import MountClearance
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
    clear = space.clear
    if clear is None:
        return list(some)
    kept = [c for c in some if not _meeting(clear, space, c)]
    kept = kept or [m for m in (_moved(clear, space, c, rng) for c in some) if m is not None]
    if not kept:
        drawn = (fresh(space, rng) for _ in range(_DRAWS))
        kept = [c for c in drawn if not _meeting(clear, space, c)][: len(some)]
    if not kept:
        text, allowed = (
            _meeting(clear, space, some[0])[0].text,
            'use fewer rings, other limits, or mount = "free"',
        )
        raise InfeasibleError(f"{text}, and rings collide at every placement tried; {allowed}")
    return kept


def _meeting(clear: MountClearance, space: Space, c: Candidate) -> list[Standing]:
    """Return the collisions at any pose, except those among fixed rings."""
    rings = space.setup(c).rings
    held = {i for i, ring in enumerate(rings) if ring in space.fixed}
    return [collision for collision in meeting(clear, rings) if not set(collision.rings) <= held]


def _moved(clear: MountClearance, space: Space, c: Candidate, rng: Rng) -> Candidate | None:
    """Return the candidate with its colliding rings moved along their links; the first attempt
    without collisions, or None."""
    rings = space.setup(c).rings
    links = {rings[i].link for collision in _meeting(clear, space, c) for i in collision.rings}
    which = [i for i in c.rings if space.segments[c.segment[i]].link in links]
    low, high = (edge[0, : space.places] for edge in space.box(c))
    for reach in np.geomspace(_NEAR, _FAR, _MOVES):
        values = c.values.copy()
        values[0, which] += reach * rng.uniform(-1, 1, len(which))
        moved = replace(c, values=np.concatenate([np.clip(values[:1], low, high), values[1:]]))
        if not _meeting(clear, space, moved):
            return moved
    return None
