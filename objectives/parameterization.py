"""Parameters of a placement: the map from a box of values to ring positions that satisfy all
rules."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..coverage.arrays import Array
from ..coverage.pytrees import tree
from ..coverage.rings.ring_kinematics import RingArrays
from .link_segments import ABOVE, BELOW, HIGH, LOW, TILTS, Segment, occupied

_STEP = float(TILTS[1] - TILTS[0])


@tree
@dataclass(frozen=True)
class Interval:
    """The segment of each of R rings, as arrays (R, ...)."""

    segment: Int[Array, "*batch R"]
    """Index of the segment."""
    by_tilt: Float[Array, "*batch R 4 T"]
    """Ends of the segment and extents of the ring, by tilt; see ``Segment``."""
    least: Float[Array, "*batch R"]
    """Minimum spacing of two rings on the segment by the rules, as a share of the link."""
    tilt_of: Int[Array, "*batch R"]
    """Index of the ring whose tilt each ring takes."""
    sign: Float[Array, "*batch R"]
    """Sign of that tilt."""

    @property
    def loose(self) -> Bool[np.ndarray, "*batch R"]:
        """Whether each ring can move along its link at any tilt."""
        loose: np.ndarray = np.any(self.by_tilt[..., HIGH, :] > self.by_tilt[..., LOW, :], axis=-1)
        return loose

    def some(self, which: Int[np.ndarray, " N"]) -> "Interval":
        """Return the segments of the rings ``which`` (N,), for ``positions``."""
        each = np.arange(len(which))
        return Interval(
            self.segment[which], self.by_tilt[which], self.least[which], each, self.sign[which]
        )

    def hold(self, some: Sequence[int], positions: Sequence[float]) -> None:
        """Set the positions of the rings ``some``, which have no segment."""
        for i, position in zip(some, positions, strict=True):
            self.by_tilt[i] = 0.0
            self.by_tilt[i, [LOW, HIGH]] = position


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
    by_tilt, least = np.zeros((len(which), 4, len(TILTS))), np.zeros(len(which))
    for i, (low, high) in occupied(found, which).items():
        table, here = found[i].by_tilt.copy(), which == i
        if low > found[i].low:
            table[LOW] = np.maximum(table[LOW], low)
        if high < found[i].high:
            table[HIGH] = np.minimum(table[HIGH], high)
        by_tilt[here], least[here] = table, found[i].least
    number = np.where(which >= 0, which, -1 - np.arange(len(which)))
    tilt_of = np.arange(len(which)) if shared is None else np.zeros(len(which), int)
    sign = np.ones(len(which)) if shared is None else np.asarray(shared, float)
    return Interval(number, by_tilt, least, tilt_of, sign)


class _Chain(NamedTuple):
    """The rings of each segment from proximal to distal, and the range of each ring's position."""

    upto: Bool[np.ndarray, "*batch R R"]
    """Whether ring j is ring k or below it on the same segment, [k, j]."""
    previous: Bool[np.ndarray, "*batch R R"]
    """Whether ring j is the next ring below ring k, [k, j]."""
    binding: Bool[np.ndarray, "*batch R"]
    """Whether the envelopes, not the rules, set the spacing of a ring from the next one below."""
    offset: Float[np.ndarray, "*batch R"]
    """Sum of the spacings from the lowest ring of the segment up to each ring."""
    lowest: Float[np.ndarray, "*batch R R"]
    """Lower end of ring j less its offset where ring j is ring k or below it, [k, j]."""
    highest: Float[np.ndarray, "*batch R R"]
    """Upper end of ring j less its offset where ring j is ring k or above it, [k, j]."""

    @property
    def low(self) -> Float[np.ndarray, "*batch R"]:
        """Lowest position of each ring less its offset."""
        low: np.ndarray = self.lowest.max(axis=-1)
        return low

    @property
    def free(self) -> Float[np.ndarray, "*batch R"]:
        """Length of the range of each ring's position."""
        free: np.ndarray = np.maximum(self.highest.min(axis=-1) - self.low, 0.0)
        return free


def _cells(tilt: Float[np.ndarray, "*batch R"]) -> tuple[np.ndarray, np.ndarray]:
    """Return the cell of the table in which each tilt lies, and its place there, 0 to 1."""
    at = np.maximum((tilt - TILTS[0]) / _STEP, 0.0)
    cell = np.minimum(at, len(TILTS) - 2.0).astype(int)
    at = np.minimum(at, len(TILTS) - 1.0)
    return cell, at - cell


def _chain(
    where: Interval,
    below: Bool[np.ndarray, "*batch R R"],
    tilt: Float[np.ndarray, "*batch R"],
) -> _Chain:
    """Return the chains of rings of which each is preceded by the rings ``below`` [k, j]."""
    each = np.arange(tilt.shape[-1])
    cell, place = _cells(tilt)
    table = where.by_tilt[each, :, cell]  # (*batch, R, 4)
    table = table + place[..., None] * (where.by_tilt[each, :, cell + 1] - table)
    below = below & (where.segment[:, None] == where.segment)
    rank = below.sum(axis=-1)
    previous = below & (rank[..., None, :] == (rank - 1)[..., None])
    envelopes = (previous @ table[..., ABOVE, None])[..., 0] + table[..., BELOW]
    spacing = np.maximum(envelopes, where.least) * (rank > 0)
    upto = below | (each[:, None] == each)
    offset = (upto @ spacing[..., None])[..., 0]
    low, high = (table[..., LOW] - offset), (table[..., HIGH] - offset)
    return _Chain(
        upto,
        previous,
        (rank > 0) & (envelopes > where.least),
        offset,
        np.where(upto, low[..., None, :], -np.inf),
        np.where(np.swapaxes(upto, -1, -2), high[..., None, :], np.inf),
    )


def positions(
    where: Interval, along: Float[np.ndarray, "*batch R"], tilt: Float[np.ndarray, "*batch R"]
) -> Float[np.ndarray, "*batch R"]:
    """Return the positions of rings for values ``along`` from 0 to 1 and tilts, rad.

    The rings of a segment are ranked by ``along``. Each one's range of position is what its own
    tilt and the spacings from the rings below and above it leave, and ``along`` is its place there.
    All rings thus keep the spacing for any values.
    """
    chain = _chain(where, _ranked(along), tilt)
    position: np.ndarray = chain.offset + chain.low + along * chain.free
    return position


def _ranked(along: Float[np.ndarray, "*batch R"]) -> Bool[np.ndarray, "*batch R R"]:
    """Return whether ring j comes before ring k, [k, j]; of equal values the first one does."""
    one, other, each = along[..., :, None], along[..., None, :], np.arange(along.shape[-1])
    ranked: np.ndarray = (other < one) | ((other == one) & (each < each[:, None]))
    return ranked


def _tilts(where: Interval, values: Float[np.ndarray, "3 R"]) -> Float[np.ndarray, " R"]:
    tilt: np.ndarray = where.sign * values[1][where.tilt_of]
    return tilt


def decode(where: Interval, values: Float[np.ndarray, "3 R"]) -> Float[np.ndarray, "3 R"]:
    """Return positions, tilts and phases (3, R) for values in a box; see ``positions``."""
    tilt = _tilts(where, values)
    return np.stack([positions(where, values[0], tilt), tilt, values[2]])


def value_slopes(
    where: Interval,
    values: Float[np.ndarray, "3 R"],
    position: Float[np.ndarray, " R"],
    tilt: Float[np.ndarray, " R"],
    phase: Float[np.ndarray, " R"],
) -> Float[np.ndarray, "3 R"]:
    """Return the gradient (3, R) by the values that ``decode`` reads.

    Args:
        where: the rings' segments.
        values: the values (3, R).
        position: gradient (R,) by the positions.
        tilt: gradient (R,) by the tilts.
        phase: gradient (R,) by the phases.
    """
    along, own, n = values[0], _tilts(where, values), len(tilt)
    chain = _chain(where, _ranked(along), own)
    # position = offset + (1 - along) (low - offset) of one ring + along (high - offset) of another
    by_low = np.bincount(chain.lowest.argmax(axis=1), (1 - along) * position, n)
    by_high = np.bincount(chain.highest.argmin(axis=1), along * position, n)
    by_spacing = chain.binding * ((position - by_low - by_high) @ chain.upto)
    by_row = np.zeros((n, 4))
    by_row[:, LOW], by_row[:, HIGH] = by_low, by_high
    by_row[:, ABOVE], by_row[:, BELOW] = by_spacing @ chain.previous, by_spacing
    each, (cell, _) = np.arange(n), _cells(own)
    change = (where.by_tilt[each, :, cell + 1] - where.by_tilt[each, :, cell]) / _STEP
    by_tilt = tilt + (by_row * change).sum(axis=1)
    return np.stack(
        [position * chain.free, np.bincount(where.tilt_of, where.sign * by_tilt, n), phase]
    )


def encode(
    where: Interval, values: Float[np.ndarray, "3 R"], position: Float[np.ndarray, " R"]
) -> Float[np.ndarray, " R"]:
    """Return the first row of the values whose positions are nearest to ``position``, where the
    other rows are those of ``values``."""
    chain = _chain(where, _ranked(position), _tilts(where, values))
    free = chain.free
    along = (position - chain.offset - chain.low) / np.where(free > 0, free, 1.0)
    along = np.clip(np.where(free > 0, along, 0.0), 0.0, 1.0)
    # rings of a segment keep their order
    kept: np.ndarray = np.where(chain.upto, along, 0.0).max(axis=1)
    return kept
