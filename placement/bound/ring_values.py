"""What a ring of each size can collect at most from a price field, over all of its places.

The integral of a price field over a beam is V(position, tilt, azimuth). Along each coordinate
V'' >= -M with known M (``BlurredBeam.bends``), so V plus M x^2 / 2 is convex along it, and between
two values of the coordinate V is at most M h^2 / 8 above the larger one, with h their distance.
Applied to one coordinate after the other: inside a box V is at most the largest value at its
corners plus the sum of M h^2 / 8. The same holds for the sum over the sensors of a ring, which have
one position, one tilt, and azimuths that turn together.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from ...coverage.processors import processors
from .blurred_beam import BlurredBeam
from .families import Family
from .price_field import PriceField

AZIMUTHS = 180
"""Azimuths at which a sensor is evaluated for a bound."""
BOXES = 0.1, math.radians(5)
"""Sides of the first boxes, m and rad."""
_BENDS = math.radians(2.5)  # step of the tilts at which the bends are computed


def shares(
    beam: BlurredBeam,
    field: PriceField,
    apex: Float[np.ndarray, "A 3"],
    look: Float[np.ndarray, "A 3"],
) -> Float[np.ndarray, "A J"]:
    """Return the share of each of a field's Gaussians in each beam, 32 bits."""
    x, y, z = field.points.T.astype(np.float32)

    def product(v: np.ndarray) -> np.ndarray:
        # a product with three columns: a matrix product spends its time on starting threads
        a, b, c = v.astype(np.float32).T[:, :, None]
        total: np.ndarray = a * x
        total += b * y
        total += c * z
        return total

    along = product(look)
    along -= (apex * look).sum(axis=1).astype(np.float32)[:, None]
    square = product(-2 * apex)
    square += x * x + y * y + z * z
    square += (apex * apex).sum(axis=1).astype(np.float32)[:, None]
    square -= along * along
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


def _split(interval: tuple[float, float], step: float, size: float) -> Float[np.ndarray, " N"]:
    low, high = interval
    return np.linspace(low, high, max(math.ceil((high - low) * size / step - 1e-9), 1) + 1)


class RingMaxima:
    """Upper bounds of what a ring of each size on a link collects from a field of prices.

    Boxes of position and tilt cover the family. ``refine`` splits those that hold the largest
    bounds, so the bounds never rise.
    """

    def __init__(
        self,
        family: Family,
        beam: BlurredBeam,
        field: PriceField,
        prices: Float[np.ndarray, " J"],
        boxes: tuple[float, float] = BOXES,
    ) -> None:
        """Evaluate the corners of the first boxes; ``prices`` are at most 1."""
        self.family, self._beam, self._field = family, beam, field
        self._prices = (prices * field.worth).astype(np.float32)
        self._sums = RingSums(family.counts)
        self._counts = np.array(family.counts)
        low, high = family.tilt
        # between these tilts the bends change by far less than the margin of 2 % in them
        tilts = np.linspace(low, high, max(math.ceil((high - low) / _BENDS), 1) + 1)
        bends = beam.bends(tilts, family.radius) * float(prices.max(initial=0.0))
        self._bends = bends / field.grid.volume
        self._nodes = dict[tuple[float, float], Float[np.ndarray, " C"]]()
        length = family.mount.length
        first = []
        for interval in family.positions:
            p = _split(interval, boxes[0], length)
            t = _split(family.tilt, boxes[1], 1.0)
            first += [(a, b, c, d) for a, b in pairwise(p) for c, d in pairwise(t)]
        self._boxes: Float[np.ndarray, "B 4"] = np.array(first)
        self._bounds = self._bounded(self._boxes)

    @property
    def nodes(self) -> int:
        """Number of places that were evaluated."""
        return len(self._nodes)

    @property
    def bound(self) -> Float[np.ndarray, " C"]:
        """Upper bound for each number of sensors of the family, as a share of the target."""
        return np.asarray(self._bounds.max(axis=0))

    @property
    def reached(self) -> Float[np.ndarray, " C"]:
        """Largest value at an evaluated place for each number of sensors."""
        return np.asarray(np.max(list(self._nodes.values()), axis=0))

    def refine(self, index: Int[np.ndarray, " _"], most: int) -> None:
        """Split the boxes that hold the bounds for the sizes ``index``, at most ``most`` boxes."""
        if not len(index) or not most:
            return
        bound, reached = self.bound[index], self.reached[index]
        room = np.maximum(bound - reached, 1e-12)
        height = ((self._bounds[:, index] - reached) / room).max(axis=1)
        chosen = np.argsort(-height, kind="stable")[:most]
        chosen = chosen[height[chosen] > 0.3]
        a, b, c, d = self._boxes[chosen].T
        p, t = (a + b) / 2, (c + d) / 2
        still = b - a <= 0
        new = np.concatenate(
            [np.stack(box, axis=1) for box in ((a, p, c, t), (a, p, t, d))]
            + [np.stack(box, axis=1)[~still] for box in ((p, b, c, t), (p, b, t, d))]
        )
        parents = np.concatenate([chosen, chosen, chosen[~still], chosen[~still]])
        bounds = np.minimum(self._bounded(new), self._bounds[parents])
        keep = np.ones(len(self._boxes), bool)
        keep[chosen] = False
        self._boxes = np.concatenate([self._boxes[keep], new])
        self._bounds = np.concatenate([self._bounds[keep], bounds])

    def _bounded(self, boxes: Float[np.ndarray, "B 4"]) -> Float[np.ndarray, "B C"]:
        """Return the bounds of boxes, as rows of lowest and highest position and tilt."""
        a, b, c, d = boxes.T
        corners = [list(zip(p, t, strict=True)) for p in (a, b) for t in (c, d)]
        self._evaluate([place for some in corners for place in some])
        values = np.stack([[self._nodes[place] for place in some] for some in corners])
        by_position, by_tilt, by_azimuth = self._bends
        bend = by_position * ((b - a) * self.family.mount.length) ** 2
        bend = bend + by_tilt * (d - c) ** 2 + by_azimuth * (2 * math.pi / AZIMUTHS) ** 2
        most: np.ndarray = values.max(axis=0) + bend[:, None] / 8 * self._counts
        for i, (low, high) in enumerate(self.family.tilts[n] for n in self.family.counts):
            most[(d < low) | (c > high), i] = 0.0  # no ring of this size has such a tilt
        return most

    def _evaluate(self, places: list[tuple[float, float]]) -> None:
        azimuths = np.arange(AZIMUTHS) * (2 * math.pi / AZIMUTHS)

        def value(place: tuple[float, float]) -> np.ndarray:
            apex, look = self.family.beams(*place, azimuths)
            return shares(self._beam, self._field, apex, look) @ self._prices

        new = [p for p in dict.fromkeys(places) if p not in self._nodes]
        if not new:
            return
        with ThreadPoolExecutor(processors()) as pool:
            values = np.stack(list(pool.map(value, new)))
        for place, most in zip(new, self._sums.most(values).astype(float), strict=True):
            self._nodes[place] = most
