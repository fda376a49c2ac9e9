"""Diversity of candidates: the share of sensors that sit elsewhere."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ...objectives.parameterization import decode
from .design import Candidate, Space

_POSITIONS, _TILTS = 7, 13  # size of the grid on which candidates are compared


def features(space: Space, c: Candidate) -> Float[np.ndarray, " F"]:
    """Return the distribution of a candidate's sensors over a grid of links, positions and tilts.

    Each ring is spread over the four nearest grid nodes. Half the sum of absolute differences of
    two such vectors is the share of sensors that sit elsewhere.
    """
    links = space.scene.robot.links
    grid = np.zeros((len(links), _POSITIONS + 1, _TILTS + 1))
    position, tilt, _ = decode(space.stretch(c), space.values(c))
    for i in c.rings:
        x, y = (
            np.clip(position[i], 0, 1) * (_POSITIONS - 1),
            (tilt[i] / math.pi + 0.5) * (_TILTS - 1),
        )
        a, b = int(x), int(y)
        share = c.count[i] / space.sensors
        link = links.index(space.segments[c.segment[i]].link)
        for dx, u in ((0, a + 1 - x), (1, x - a)):
            for dy, v in ((0, b + 1 - y), (1, y - b)):
                grid[link, a + dx, b + dy] += share * u * v
    return grid.ravel()


def unlike_first(
    space: Space, some: Sequence[Candidate], apart: float, known: Sequence[Candidate] = ()
) -> list[Candidate]:
    """Reorder candidates so that diverse ones come first: those that differ from all ``known`` and
    from all before them.

    Two candidates differ if more than a share ``apart`` of their sensors sit elsewhere.
    """
    if not some:
        return []
    kinds = np.stack([features(space, c) for c in some])
    unlike, first = np.ones(len(some), bool), np.zeros(len(some), bool)
    for other in known:
        unlike &= np.abs(kinds - features(space, other)).sum(axis=1) / 2 > apart
    for i in range(len(some)):
        if unlike[i]:
            first[i] = True
            unlike &= np.abs(kinds - kinds[i]).sum(axis=1) / 2 > apart
    return [some[i] for i in np.argsort(~first, kind="stable")]
