"""What a ring of each size can collect at most from a price field, over all of its places.

The field is a smooth field of prices inside the target and 0 outside. Its integral over a beam is
V(position, tilt, azimuth), evaluated at nodes along each coordinate (``link_cylinder``). Between
two nodes at a distance h, V exceeds the larger of their values by at most h/4 times the integral of
the negative part of V'' between them, and by at most M h^2 / 8 if V'' >= -M. Applied to one
coordinate after the other: between nodes V is at most their largest value plus the sum of these
excesses. The same holds for the sum over the sensors of a ring, which have one position, one tilt,
and azimuths that turn together.

The smooth field bends V by at most a known M (``BlurredBeam.bends``). Where a beam's surface
crosses that of the target, the step of the price to 0 adds the integral of |v| |v . n| price over
the curve where they cross (``LinkCylinder.edges``). It is taken at the nodes and with h^2 / 4: an
estimate on the safe side, not a proof.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from .blurred_beam import BlurredBeam
from .families import Family
from .link_cylinder import LinkCylinder
from .price_field import PriceField

AZIMUTHS = 360
"""Azimuths at which a sensor is evaluated for a bound."""
FIRST = math.radians(4)
"""Step of the first tilts, rad."""
STEP = 0.3
"""Side of the cells of a bound, in standard deviations of a Gaussian."""
LARGEST = 0.03
"""Largest side of these cells, m."""
_LEAST = math.radians(0.25)  # step of the tilts that is not halved
_BENDS = math.radians(2.5)  # step of the tilts at which the bends are computed


def shares(
    beam: BlurredBeam,
    field: PriceField,
    apex: Float[np.ndarray, "A 3"],
    look: Float[np.ndarray, "A 3"],
) -> Float[np.ndarray, "A J"]:
    """Return the share of each of a field's Gaussians in each beam, 32 bits."""
    side = np.cross(look, np.eye(3)[np.abs(look).argmin(axis=1)])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    x, y, z = field.points.T.astype(np.float32)

    def component(v: np.ndarray) -> np.ndarray:
        # a product with three columns: a matrix product spends its time on starting threads
        a, b, c = v.astype(np.float32).T[:, :, None]
        total: np.ndarray = a * x
        total += b * y
        total += c * z
        total -= (apex * v).sum(axis=1).astype(np.float32)[:, None]
        return total

    # no squared distance less a square: over 12 m that loses millimetres in 32 bits
    along, square = component(look), component(side) ** 2
    square += component(np.cross(look, side)) ** 2
    return beam.share(along, square)


def turns(count: int, azimuths: int = AZIMUTHS) -> Float[np.ndarray, "F A"]:
    """Return weights (F, A) that sum a function of the azimuth over the sensors of a ring.

    The function is known at A azimuths and linear between them. The sum is piecewise linear in the
    phase, so it is largest where a sensor stands at one of these azimuths. By symmetry that is any
    sensor of the ring, so the first one may stand there, at each of the A azimuths.
    """
    steps = np.arange(count) * (azimuths / count)
    low, part = np.floor(steps + 1e-9).astype(int), 0.0
    first = np.zeros(azimuths)
    part = np.clip(steps - low, 0.0, 1.0)
    np.add.at(first, low % azimuths, 1 - part)
    np.add.at(first, (low + 1) % azimuths, part)
    rows = azimuths // count if azimuths % count == 0 else azimuths
    return np.stack([np.roll(first, i) for i in range(rows)])


class RingSums:
    """Largest sum of a function of the azimuth over the sensors of a ring, over all phases."""

    def __init__(self, counts: Sequence[int], azimuths: int = AZIMUTHS) -> None:
        """Prepare the sums for rings of these numbers of sensors."""
        each = [turns(count, azimuths) for count in counts]
        self._rows = np.concatenate(each).astype(np.float32)
        self._first = np.cumsum([0, *(len(rows) for rows in each[:-1])])

    def most(self, values: Float[np.ndarray, "N A"]) -> Float[np.ndarray, "N C"]:
        """Return the largest sum for each count, for N functions at A azimuths."""
        sums = values @ self._rows.T
        most: np.ndarray = np.maximum.reduceat(sums, self._first, axis=1)
        return most

    def best(
        self, values: Float[np.ndarray, "N A"]
    ) -> tuple[Float[np.ndarray, " C"], Int[np.ndarray, " C"], Float[np.ndarray, "C A"]]:
        """Return for each count the largest sum of all functions, the number of its function, and
        the weights of the azimuths in it."""
        sums = values @ self._rows.T
        most = np.maximum.reduceat(sums, self._first, axis=1)
        where = most.argmax(axis=0)
        ends = [*self._first[1:], len(self._rows)]
        rows = [
            first + sums[n, first:end].argmax()
            for n, first, end in zip(where, self._first, ends, strict=True)
        ]
        return most.max(axis=0), where, self._rows[rows]


class RingMaxima:
    """Upper bounds of what a ring of each size on a link collects from a field of prices.

    Intervals of tilt cover the family. ``refine`` splits those that hold the largest bounds, so the
    bounds never rise.
    """

    def __init__(
        self,
        family: Family,
        beam: BlurredBeam,
        field: PriceField,
        prices: Float[np.ndarray, " J"],
        step: float = STEP,
    ) -> None:
        """Evaluate the ends of the first intervals.

        Args:
            family: the rings.
            beam: beam of their sensor.
            field: lattice of the prices.
            prices: prices, at most 1.
            step: side of the cells, in standard deviations of a Gaussian.
        """
        self.family, self._counts = family, np.array(family.counts)
        side = min(step * field.sigma, LARGEST)
        self._cells = LinkCylinder(family, beam, field, side, AZIMUTHS)
        self._cells.load(prices)
        self._edges = LinkCylinder(family, beam, field, 2 * side, AZIMUTHS // 3)
        self._edges.load(prices, surface=True)
        self._sums = RingSums(family.counts)
        low, high = family.tilt
        # between these tilts the bends change by far less than the margin of 2 % in them
        tilts = np.linspace(low, high, max(math.ceil((high - low) / _BENDS), 1) + 1)
        bends = beam.bends(tilts, family.radius) * float(prices.max(initial=0.0))
        by_position, by_tilt, by_azimuth = bends / field.grid.volume / 8
        flat = by_position * self._cells.step**2 * (family.mount.length > 0)
        self._flat = flat + by_azimuth * (2 * math.pi / AZIMUTHS) ** 2 + self._cells.error
        self._by_tilt = float(by_tilt)
        self._nodes = dict[float, tuple[np.ndarray, np.ndarray]]()
        ends = np.linspace(low, high, max(math.ceil((high - low) / FIRST), 1) + 1)
        self._intervals: Float[np.ndarray, "B 2"] = np.array(list(pairwise(ends)))
        self._bounds = self._bounded(self._intervals)

    @property
    def nodes(self) -> int:
        """Number of tilts that were evaluated."""
        return len(self._nodes)

    @property
    def bound(self) -> Float[np.ndarray, " C"]:
        """Upper bound for each number of sensors of the family, as a share of the target."""
        return np.asarray(self._bounds.max(axis=0))

    def refine(self, index: Int[np.ndarray, " _"], most: int) -> None:
        """Halve the intervals that hold the bounds for the sizes ``index``, at most ``most``."""
        narrow = self._intervals[:, 1] - self._intervals[:, 0] <= 2 * _LEAST
        height = self._bounds[:, index] - self.bound[index]
        near = (height + self._by_tilt * FIRST**2 * self._counts[index] / 4).max(axis=1)
        near[narrow] = -1.0
        chosen = np.argsort(-near, kind="stable")[:most]
        chosen = chosen[near[chosen] >= 0]
        if not len(chosen):
            return
        a, b = self._intervals[chosen].T
        new = np.concatenate([np.stack([a, (a + b) / 2], 1), np.stack([(a + b) / 2, b], 1)])
        bounds = np.minimum(self._bounded(new), np.tile(self._bounds[chosen], (2, 1)))
        keep = np.ones(len(self._intervals), bool)
        keep[chosen] = False
        self._intervals = np.concatenate([self._intervals[keep], new])
        self._bounds = np.concatenate([self._bounds[keep], bounds])

    def _bounded(self, intervals: Float[np.ndarray, "B 2"]) -> Float[np.ndarray, "B C"]:
        """Return the bounds of intervals of tilt, as rows of lowest and highest."""
        low, high = intervals.T
        ends = [[self._node(float(t)) for t in end] for end in (low, high)]
        value, edge = np.max(np.array(ends), axis=0).transpose(1, 0, 2)
        square = ((high - low) ** 2)[:, None]
        most: np.ndarray = value + edge * square
        most += (self._by_tilt * square + self._flat) * self._counts
        for i, (least, most_tilt) in enumerate(self.family.tilts[n] for n in self.family.counts):
            most[(high < least) | (low > most_tilt), i] = 0.0  # no ring of this size tilts so
        return most

    def _node(self, tilt: float) -> tuple[np.ndarray, np.ndarray]:
        """Return for each size the most that a ring of a tilt collects at the evaluated places,
        and the bend of its value by the tilt at the target's surface."""
        if tilt not in self._nodes:
            collected = self._cells.collected(tilt)
            turn = 2 * math.pi / AZIMUTHS
            apart = np.abs(self._cells.places[:, None] - self._edges.places)
            rows, columns = apart.argmin(axis=1), np.rint(np.arange(AZIMUTHS) / 3).astype(int)
            flat, by_tilt = (
                each[rows][:, columns % (AZIMUTHS // 3)]
                for each in self._edges.edges(tilt, self._cells.step, turn)
            )
            some = [collected + flat, by_tilt]
            most = [self._sums.most(v.astype(np.float32)).max(axis=0).astype(float) for v in some]
            self._nodes[tilt] = most[0], most[1]
        return self._nodes[tilt]
