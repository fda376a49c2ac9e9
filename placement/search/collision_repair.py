"""Rings of different links that would meet: no segment keeps these apart, so that the last
candidates of a search are looked at, and moved apart where all of them have such rings."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...objectives.feasibility.clearance import MountClearance
from ...objectives.feasibility.mounting import Standing, meeting
from .design import Candidate, Space
from .feasible_set import InfeasibleError, Rng
from .moves import fresh

_MOVES = 100  # tries to move the rings of one candidate apart, ever further
_NEAR, _FAR = 0.02, 1.0  # how far the first and the last go, as a share of what is free
_DRAWS = 100  # candidates drawn anew where no move was enough


def apart(space: Space, some: Sequence[Candidate], rng: Rng) -> list[Candidate]:
    """Those of ``some`` (one at least) whose rings do not meet at any pose. Where all do: each with
    its rings moved along their links no further than it takes; or else others, drawn anew.

    Raises:
        InfeasibleError: if none was found; the text names the rings that meet.
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
            'fewer rings, other limits, or mount = "free"',
        )
        raise InfeasibleError(
            f"{text}, and so do rings wherever they were tried; allowed: {allowed}"
        )
    return kept


def _meeting(clear: MountClearance, space: Space, c: Candidate) -> list[Standing]:
    """What meets at some pose, but for fixed rings among themselves."""
    rings = space.setup(c).rings
    held = {i for i, ring in enumerate(rings) if ring in space.fixed}
    return [found for found in meeting(clear, rings) if not set(found.rings) <= held]


def _moved(clear: MountClearance, space: Space, c: Candidate, rng: Rng) -> Candidate | None:
    """The candidate with rings of the links that meet moved along them, the first that is clear of
    ever further moves.
    """
    rings = space.setup(c).rings
    links = {rings[i].link for found in _meeting(clear, space, c) for i in found.rings}
    which = [i for i in c.rings if space.segments[c.segment[i]].link in links]
    low, high = (edge[0, : space.places] for edge in space.box(c))
    for reach in np.geomspace(_NEAR, _FAR, _MOVES):
        values = c.values.copy()
        values[0, which] += reach * rng.uniform(-1, 1, len(which))
        moved = replace(c, values=np.concatenate([np.clip(values[:1], low, high), values[1:]]))
        if not _meeting(clear, space, moved):
            return moved
    return None
