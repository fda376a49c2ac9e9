"""Places for single rings: anywhere in the feasible set, or near those of a candidate."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ...objectives.link_segments import ABOVE, BELOW, HIGH, LOW
from ...objectives.parameterization import at_tilt, decode
from ..space.design import Candidate, Space
from ..space.feasible_set import Rng, segment_length

SPREADS = (0.3, 1.0)  # standard deviations of the places near a ring, in units of the scale
_RECOUNTED = 0.6  # share of the places near a ring with another number of sensors
_EXCHANGED = 0.25  # share of the places near a ring at the position of another ring
_PACKED = 0.3  # share of the places anywhere that lie some spacings from an end
_STEPS = 4  # spacings, from 0
_RECOUNT = 2  # sensors by which that number differs at most


class SinglePlaces(NamedTuple):
    """K places for single rings."""

    segment: Int[np.ndarray, " K"]
    """Number of the segment."""
    sensors: Int[np.ndarray, " K"]
    """Number of sensors of the ring."""
    position: Float[np.ndarray, " K"]
    """Position along the link, in [0, 1]."""
    tilt: Float[np.ndarray, " K"]
    """Tilt, rad."""
    phase: Float[np.ndarray, " K"]
    """Phase, rad."""

    def some(self, index: Int[np.ndarray, " M"] | Bool[np.ndarray, " K"]) -> "SinglePlaces":
        """Return the places with these indices."""
        return SinglePlaces(*(a[index] for a in self))


def joined(each: Sequence[SinglePlaces]) -> SinglePlaces:
    """Return several lists of places as one."""
    return SinglePlaces(*(np.concatenate(column) for column in zip(*each, strict=True)))


def places_anywhere(
    space: Space, rng: Rng, number: int, tilts: Float[np.ndarray, " T"] | None = None
) -> SinglePlaces:
    """Draw places in the feasible set, on links by their length; ``tilts``: sizes of the tilts from
    which to choose, by default any."""
    size = np.array([segment_length(space.scene, s) for s in space.segments])
    segment = rng.choice(len(size), number, p=size / size.sum())
    count = rng.integers(space.least, _most(space, segment) + 1)
    fit = _fitting(space, segment, count)
    segment, count = segment[fit], count[fit]
    low, high = _limits(space, segment, count)  # (K, 3)
    if tilts is not None:
        size = rng.choice(tilts, len(segment))
        fit = size <= high[:, 1]
        segment, count, low, high, size = (a[fit] for a in (segment, count, low, high, size))
    along, tilt, phase = rng.uniform(low, high).T
    if tilts is not None:
        tilt = size * rng.choice([-1.0, 1.0], len(segment))
    first, last, spacing = _room(space, segment, tilt)
    position = first + along * (last - first)
    packed = rng.uniform(size=len(segment)) < _PACKED
    steps = rng.integers(_STEPS, size=len(segment)) * spacing
    end = np.where(rng.uniform(size=len(segment)) < 0.5, first + steps, last - steps)
    position = np.where(packed & (end >= first) & (end <= last), end, position)
    return SinglePlaces(segment, count, position, tilt, phase)


def places_near(
    space: Space, rng: Rng, rings: SinglePlaces, number: int, scale: float
) -> SinglePlaces:
    """Draw ``number`` places near each ring; about half of them differ in one value only."""
    some = rings.some(np.repeat(np.arange(len(rings.sensors)), number))
    other = rng.integers(-_RECOUNT, _RECOUNT + 1, len(some.sensors))
    other *= rng.uniform(size=len(other)) < _RECOUNTED
    count = np.clip(some.sensors + other, space.least, _most(space, some.segment))
    fit = _fitting(space, some.segment, count)
    some, count, n = some.some(fit), count[fit], int(fit.sum())
    low, high = _limits(space, some.segment, count)
    off = scale * rng.choice(SPREADS, (n, 1)) * rng.standard_normal((n, 2))
    alone = rng.integers(4, size=n)
    off[(alone[:, None] != np.arange(2)) & (alone[:, None] < 2)] = 0.0
    tilt = some.tilt
    if not space.scene.rules.shared_tilt:
        tilt = np.clip(tilt + off[:, 1] * (high - low)[:, 1], low[:, 1], high[:, 1])
    first, last, _ = _room(space, some.segment, tilt)
    middle = _elsewhere(space, rng, rings, some)
    position = np.clip(middle + off[:, 0] * (last - first), first, last)
    turned = rng.uniform(low[:, 2], high[:, 2])
    phase = np.where(rng.uniform(size=n) < 0.5, some.phase, turned)
    return SinglePlaces(some.segment, count, position, tilt, phase)


def _elsewhere(
    space: Space, rng: Rng, rings: SinglePlaces, some: SinglePlaces
) -> Float[np.ndarray, " K"]:
    """Return the position of each place, for some of them that of another ring on the segment, so
    that two rings can change places, or as close to it as another ring may be."""
    n = len(some.sensors)
    other = rings.some(rng.integers(len(rings.sensors), size=n))
    moved = (rng.uniform(size=n) < _EXCHANGED) & (other.segment == some.segment)
    _, _, spacing = _room(space, some.segment, some.tilt)
    step = rng.integers(-1, 2, n) * spacing
    where: np.ndarray = np.where(moved, other.position + step, some.position)
    return where


def places_of(space: Space, c: Candidate) -> SinglePlaces:
    """Return the places of a candidate's rings."""
    position, tilt, phase = decode(space.stretch(c), space.values(c))[:, : space.places]
    i = c.rings
    return SinglePlaces(c.segment[i], c.count[i], position[i], tilt[i], phase[i])


def _fitting(
    space: Space, segment: Int[np.ndarray, " K"], count: Int[np.ndarray, " K"]
) -> Bool[np.ndarray, " K"]:
    """Return which rings have boards that fit."""
    pairs = zip(segment.tolist(), count.tolist(), strict=True)
    return np.array([space.tilts(space.segments[s].link, n) is not None for s, n in pairs], bool)


def _limits(
    space: Space, segment: Int[np.ndarray, " K"], count: Int[np.ndarray, " K"]
) -> tuple[Float[np.ndarray, "K 3"], Float[np.ndarray, "K 3"]]:
    """Return the bounds of rings' values; see ``FeasibleSet.limits``."""
    pairs, which = np.unique(np.stack([segment, count]), axis=1, return_inverse=True)
    which = which.ravel()
    each = np.array([space.limits(s, n) for s, n in pairs.T.tolist()]).reshape(-1, 2, 3)
    return each[which, 0], each[which, 1]


def rows_at_tilt(
    space: Space, segment: Int[np.ndarray, " K"], tilt: Float[np.ndarray, " K"]
) -> Float[np.ndarray, "K 4"]:
    """Return the rows of the segments' tables at tilts, rad; see ``Segment``."""
    tables = np.array([s.by_tilt for s in space.segments])
    row: np.ndarray = at_tilt(tables, segment, tilt)
    return row


def _most(space: Space, segment: Int[np.ndarray, " K"]) -> Int[np.ndarray, " K"]:
    """Return the largest number of sensors of a ring on each segment."""
    most = np.array([space.most_on(s.link) for s in space.segments])
    largest: np.ndarray = np.maximum(most, space.least)[segment]
    return largest


def _room(
    space: Space, segment: Int[np.ndarray, " K"], tilt: Float[np.ndarray, " K"]
) -> tuple[Float[np.ndarray, " K"], Float[np.ndarray, " K"], Float[np.ndarray, " K"]]:
    """Return the lowest and highest position of a ring alone on its segment, and the distance of
    two like rings there, as shares of the link.
    """
    table, least = rows_at_tilt(space, segment, tilt), np.array([s.least for s in space.segments])
    return (
        table[:, LOW],
        table[:, HIGH],
        np.maximum(table[:, ABOVE] + table[:, BELOW], least[segment]),
    )
