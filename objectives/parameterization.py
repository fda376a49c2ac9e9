"""Parameters of a placement: the map from a box of values to ring positions that satisfy all
rules."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..coverage.arrays import Array, namespace
from ..coverage.pytrees import tree
from ..coverage.rings.ring_kinematics import RingArrays
from .link_segments import ABOVE, BELOW, HIGH, LOW, TILTS, Segment, occupied

_STEP = float(TILTS[1] - TILTS[0])
_APART = 1e-12  # least difference of the values of two rings of a segment


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
    segments: list[Segment],
    which: Int[np.ndarray, " R"],
    shared: Float[np.ndarray, " R"] | None = None,
) -> Interval:
    """Return the segments of rings as arrays.

    Segments that hold rings are kept apart by the spacing: rings on them keep it for any values.

    Args:
        segments: the available segments.
        which: index (R,) of each ring's segment; -1 for a slot without a ring.
        shared: sign (R,) of the tilt that all rings share; None if each ring has its own tilt.
    """
    by_tilt, least = np.zeros((len(which), 4, len(TILTS))), np.zeros(len(which))
    for i, (low, high) in occupied(segments, which).items():
        table, here = segments[i].by_tilt.copy(), which == i
        if low > segments[i].low:
            table[LOW] = np.maximum(table[LOW], low)
        if high < segments[i].high:
            table[HIGH] = np.minimum(table[HIGH], high)
        by_tilt[here], least[here] = table, segments[i].least
    number = np.where(which >= 0, which, -1 - np.arange(len(which)))
    tilt_of = np.arange(len(which)) if shared is None else np.zeros(len(which), int)
    sign = np.ones(len(which)) if shared is None else np.asarray(shared, float)
    return Interval(number, by_tilt, least, tilt_of, sign)


class _Chain(NamedTuple):
    """R rings, segment by segment and on each from proximal to distal; all fields are in this
    order, which sorting gives: the work grows as R log R."""

    order: Int[np.ndarray, "*batch R"]
    """Index of each ring."""
    parts: tuple[slice, ...]
    """The rings of each segment that holds several."""
    offset: Float[np.ndarray, "*batch R"]
    """Sum of the spacings from the lowest ring of the segment up to each ring."""
    low: Float[np.ndarray, "*batch R"]
    """Lowest position of each ring less its offset, as it and the rings below it allow."""
    high: Float[np.ndarray, "*batch R"]
    """Highest position of each ring less its offset, as it and the rings above it allow."""

    @property
    def free(self) -> Float[np.ndarray, "*batch R"]:
        """Length of the range of each ring's position."""
        free: np.ndarray = np.maximum(self.high - self.low, 0.0)
        return free

    def sorted(self, values: Float[np.ndarray, "*batch R"]) -> Float[np.ndarray, "*batch R"]:
        """Return values of the rings in this order."""
        return _taken(values, self.order)

    def back(self, values: Float[np.ndarray, "*batch R"]) -> Float[np.ndarray, "*batch R"]:
        """Return values in this order by the rings' indices."""
        each = np.empty_like(values)
        if self.order.ndim == 1:
            each[..., self.order] = values
        else:
            np.put_along_axis(each, self.order, values, axis=-1)
        return each


def _taken(
    values: Float[np.ndarray, "*batch R"], order: Int[np.ndarray, "*batch R"]
) -> Float[np.ndarray, "*batch R"]:
    """Return values in an order along the last axis; one row takes a tenth of the time of
    ``take_along_axis``."""
    there: np.ndarray = (
        values[..., order] if order.ndim == 1 else np.take_along_axis(values, order, axis=-1)
    )
    return there


def _cells(tilt: Float[Array, "*batch R"]) -> tuple[Any, Any]:
    """Return the cell of the table in which each tilt lies, and its place there, 0 to 1."""
    xp = namespace(tilt)
    at = xp.maximum((tilt - float(TILTS[0])) / _STEP, 0.0)
    cell = xp.minimum(at, len(TILTS) - 2.0).astype(int)
    at = xp.minimum(at, len(TILTS) - 1.0)
    return cell, at - cell


def at_tilt(
    tables: Float[Array, "S 4 T"],
    index: Int[Array, "*batch R"],
    tilt: Float[Array, "*batch R"],
) -> Any:
    """Return rows (*batch, R, 4) of segments' tables at tilts; see ``Segment``. NumPy or JAX.

    Args:
        tables: tables of S segments.
        index: the segment of each row.
        tilt: the tilt of each row, rad.
    """
    cell, place = _cells(tilt)
    before = tables[index, :, cell]
    return before + place[..., None] * (tables[index, :, cell + 1] - before)


def tilt_slope(
    tables: Float[np.ndarray, "S 4 T"],
    index: Int[np.ndarray, "*batch R"],
    tilt: Float[np.ndarray, "*batch R"],
) -> Float[np.ndarray, "*batch R 4"]:
    """Return the slopes of rows by the tilt, 1/rad; for the arguments see ``at_tilt``."""
    cell, _ = _cells(tilt)
    slope: np.ndarray = (tables[index, :, cell + 1] - tables[index, :, cell]) / _STEP
    return slope


def _running(
    f: np.ufunc, values: Float[np.ndarray, "*batch R"], parts: Sequence[slice], down: bool = False
) -> Float[np.ndarray, "*batch R"]:
    """Return ``f`` accumulated over the rings of each segment, from the lowest up or from the
    highest down."""
    running: np.ndarray = values.copy()
    for part in parts:
        some = values[..., part]
        running[..., part] = (
            f.accumulate(some[..., ::-1], axis=-1)[..., ::-1] if down else f.accumulate(some, -1)
        )
    return running


def _chain(
    where: Interval, rank: Float[np.ndarray, "*batch R"], tilt: Float[np.ndarray, "*batch R"]
) -> _Chain:
    """Return the chains of rings that are ordered by ``rank`` on each segment; of equal ranks the
    first ring comes first."""
    segment = np.asarray(where.segment)
    order = np.lexsort((rank, np.broadcast_to(segment, rank.shape)), axis=-1)
    of_order = np.sort(segment)
    before = np.concatenate([of_order[:1] - 1, of_order[:-1]])
    first = np.flatnonzero(of_order != before)
    ends = np.append(first[1:], len(segment))
    parts = tuple(slice(a, b) for a, b in zip(first, ends, strict=False) if b > a + 1)
    ordered = _taken(tilt, order)
    table = at_tilt(np.asarray(where.by_tilt), order, ordered)  # (*batch, R, 4)
    least = np.asarray(where.least)[order]
    envelopes = table[..., BELOW].copy()
    envelopes[..., 1:] += table[..., :-1, ABOVE]
    envelopes[..., first], least[..., first] = 0.0, 0.0
    offset = _running(np.add, np.maximum(envelopes, least), parts)
    low, high = table[..., LOW] - offset, table[..., HIGH] - offset
    return _Chain(
        order,
        parts,
        offset,
        _running(np.maximum, low, parts),
        _running(np.minimum, high, parts, down=True),
    )


def positions(
    where: Interval, along: Float[np.ndarray, "*batch R"], tilt: Float[np.ndarray, "*batch R"]
) -> Float[np.ndarray, "*batch R"]:
    """Return the positions of rings for values ``along`` from 0 to 1 and tilts, rad.

    The rings of a segment are ranked by ``along``. Each one's range of position is what its own
    tilt and the spacings from the rings below and above it leave, and ``along`` is its place there.
    All rings thus keep the spacing for any values.
    """
    chain = _chain(where, along, tilt)
    return chain.back(chain.offset + chain.low + chain.sorted(along) * chain.free)


def _tilts(where: Interval, values: Float[np.ndarray, "3 R"]) -> Float[np.ndarray, " R"]:
    tilt: np.ndarray = where.sign * values[1][where.tilt_of]
    return tilt


def decode(where: Interval, values: Float[np.ndarray, "3 R"]) -> Float[np.ndarray, "3 R"]:
    """Return positions, tilts and phases (3, R) for values in a box; see ``positions``."""
    tilt = _tilts(where, values)
    return np.stack([positions(where, values[0], tilt), tilt, values[2]])


def encode(
    where: Interval, values: Float[np.ndarray, "3 R"], position: Float[np.ndarray, " R"]
) -> Float[np.ndarray, " R"]:
    """Return the first row of the values whose positions are nearest to ``position``, where the
    other rows are those of ``values``."""
    chain = _chain(where, position, _tilts(where, values))
    free = chain.free
    along = (chain.sorted(position) - chain.offset - chain.low) / np.where(free > 0, free, 1.0)
    along = np.clip(np.where(free > 0, along, 0.0), 0.0, 1.0)
    along = _running(np.maximum, along, chain.parts)
    for part in chain.parts:  # rings of a segment keep their order, also at its ends
        rank = np.arange(part.stop - part.start)
        along[..., part] = along[..., part] * (1 - len(rank) * _APART) + rank * _APART
    return chain.back(along)
