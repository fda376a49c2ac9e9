"""Prices of places: multipliers for which the dual bound is low.

Any prices give a bound, so this part need not be exact. It looks for good ones by the Frank-Wolfe
method on the relaxed problem (Frank and Wolfe 1956; Jaggi 2013). There each point of the lattice
counts by how much of it layouts cover on average, up to all of it. The function min(1, u) is
smoothed to a parabola about 1, and its derivative is the price. Each step adds the layout that
collects most at the current prices, from a grid of rings; the smoothing narrows.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .blurred_beam import BlurredBeam
from .families import Budget, Family
from .link_cylinder import LinkCylinder
from .price_field import PriceField
from .ring_values import RingSums

_AZIMUTHS = 120
_TILT = math.radians(5)  # step of the grid
_STEP = 0.9  # side of the cells, in standard deviations of a Gaussian
_WIDTHS = 0.6, 0.06  # first and last half width of the smoothing
_NARROWING = 0.98
_MEAN = 0.06  # weight of the newest prices in their running mean
_CORRECTIONS = 8  # pairwise steps after each new layout
_EVERY = 4  # steps between evaluations of the mean
_LAST = 25  # steps without a better bound after which the search ends


class _Grid:
    """Rings of a family on a grid of places."""

    def __init__(self, family: Family, beam: BlurredBeam, field: PriceField) -> None:
        """Prepare the grid of a family."""
        self._family, self._beam, self._field = family, beam, field
        self._cylinder = LinkCylinder(family, beam, field, _STEP * field.sigma, _AZIMUTHS)
        low, high = family.tilt
        self._tilts = np.linspace(low, high, max(math.ceil((high - low) / _TILT), 1) + 1)
        self._kernels = [self._cylinder.kernel(t) for t in self._tilts]
        self._sums = RingSums(family.counts, _AZIMUTHS)

    def best(
        self, prices: Float[np.ndarray, " J"]
    ) -> tuple[Float[np.ndarray, " C"], Callable[[int], Float[np.ndarray, " J"]]]:
        """Return the largest value of a ring of each size, and a function that returns the mass of
        each Gaussian in such a ring."""
        self._cylinder.load(prices)
        pairs = zip(self._tilts, self._kernels, strict=True)
        values = np.stack([self._cylinder.collected(t, kernel) for t, kernel in pairs])
        tilts, places, _ = values.shape
        most, where, weights = self._sums.best(values.reshape(tilts * places, -1))
        masses = dict[int, np.ndarray]()

        def mass(i: int) -> np.ndarray:
            if i not in masses:
                tilt, place = divmod(int(where[i]), places)
                used = np.flatnonzero(weights[i])
                turn = used * (2 * math.pi / _AZIMUTHS)
                apex, look = self._family.beams(
                    self._cylinder.places[place], self._tilts[tilt], turn
                )
                masses[i] = self._mass(apex, look, weights[i][used])
            return masses[i]

        return most.astype(float), mass

    def _mass(
        self,
        apex: Float[np.ndarray, "A 3"],
        look: Float[np.ndarray, "A 3"],
        weight: Float[np.ndarray, " A"],
    ) -> Float[np.ndarray, " J"]:
        """Return the mass of each Gaussian in the parts of beams that lie in the target."""
        points, volumes = self._beam.profile.cloud
        side = np.cross(look, np.eye(3)[np.abs(look).argmin(axis=1)])
        side /= np.linalg.norm(side, axis=1, keepdims=True)
        frame = np.stack([side, np.cross(look, side), look], axis=1)
        where = (points @ frame + apex[:, None]).reshape(-1, 3)
        inside = self._field.grid.inside(where)
        return self._field.gathered(where, np.outer(weight, volumes).ravel() * inside)


def _slopes(filled: Float[np.ndarray, " J"], width: float) -> Float[np.ndarray, " J"]:
    """Return the derivative of the smoothed min(1, u)."""
    slope: np.ndarray = np.clip((1 + width - filled) / (2 * width), 0.0, 1.0)
    return slope


@dataclass(frozen=True)
class FoundPrices:
    """Prices, and how low bounds by prices can be."""

    values: Float[np.ndarray, " J"]
    """Price of each point of the lattice, at most ``field.most``."""
    bound: float
    """Their bound on a grid of rings. It is no bound for rings between the grid's places."""
    covered: float
    """What layouts in fractions cover: no prices on the lattice have a lower bound."""


class _Mixture:
    """Layouts used in fractions: how much of each Gaussian they cover on average."""

    def __init__(self, held: Float[np.ndarray, " J"], start: Float[np.ndarray, " J"]) -> None:
        """Start with one layout that covers ``start`` of the Gaussians' masses ``held``."""
        self._held = held
        self.filled = start / held
        """Mean coverage of each Gaussian."""
        self._layouts = np.zeros((16, len(held)), np.float32)
        self._layouts[0] = self.filled
        self._weights = np.array([1.0])

    @property
    def covered(self) -> float:
        """What the layouts cover on average, as a share of the target."""
        return float(self._held @ np.minimum(self.filled, 1.0))

    def add(self, layout: Float[np.ndarray, " J"], width: float) -> None:
        """Mix in a layout by the fraction that is best (Frank-Wolfe)."""
        n = len(self._weights)
        if n == len(self._layouts):
            self._layouts = np.concatenate([self._layouts, np.zeros_like(self._layouts)])
        self._layouts[n] = layout / self._held
        way = self._layouts[n] - self.filled
        part = self._step(way, width, 1.0)
        self.filled = self.filled + part * way
        self._weights = np.append(self._weights * (1 - part), part)

    def correct(self, width: float) -> None:
        """Move weight from the worst layout to the best (pairwise steps, Lacoste-Julien and Jaggi
        2015)."""
        n = len(self._weights)
        slopes = (_slopes(self.filled, width) * self._held).astype(np.float32)
        scores = self._layouts[:n] @ slopes
        used = np.flatnonzero(self._weights > 0)
        best, worst = int(scores.argmax()), int(used[scores[used].argmin()])
        if best == worst:
            return
        way = (self._layouts[best] - self._layouts[worst]).astype(float)
        part = self._step(way, width, float(self._weights[worst]))
        self.filled = self.filled + part * way
        self._weights[best] += part
        self._weights[worst] = max(self._weights[worst] - part, 0.0)

    def _step(self, way: Float[np.ndarray, " J"], width: float, most: float) -> float:
        """Return the step up to ``most`` along ``way`` after which the smoothed coverage is
        largest."""
        low, high = 0.0, most
        for _ in range(12):
            middle = (low + high) / 2
            rising = float(_slopes(self.filled + middle * way, width) @ (self._held * way)) > 0
            low, high = (middle, high) if rising else (low, middle)
        return high if low > 0.99 * most else low


def find_prices(
    some: tuple[Family, ...],
    beams: list[BlurredBeam],
    field: PriceField,
    budget: Budget,
    standing: Float[np.ndarray, " J"],
    seen: int,
    steps: int,
    enough: float = math.inf,
) -> FoundPrices:
    """Return prices whose bound on a grid of rings is the lowest.

    Args:
        some: families of rings.
        beams: beam of each family's sensor.
        field: the lattice.
        budget: what a layout may consist of.
        standing: mass of each Gaussian in the beams of sensors that stay, as a share of the target.
        seen: number of sensors that must cover a point.
        steps: most steps.
        enough: what layouts in fractions cover, at which the search for prices ends.
    """
    grids = [_Grid(f, b, field) for f, b in zip(some, beams, strict=True)]
    mixture = _Mixture(field.held, standing / seen)
    width, mean = _WIDTHS[0], np.zeros(len(field.held))
    least, best, since = math.inf, np.full(len(field.held), field.most), 0
    for step in range(steps):
        now = _slopes(mixture.filled, width) * field.most
        mean += (now - mean) * max(_MEAN, 1 / (step + 1))
        for prices in (now, mean) if step % _EVERY == 0 else (now,):
            each = [grid.best(prices) for grid in grids]
            value, rings = budget.best([most for most, _ in each])
            bound = field.uncollected(prices) + (value + float(standing @ prices)) / seen
            if bound < least - 1e-5:
                least, best, since = bound, prices.copy(), 0
            if prices is now:
                added = sum((each[f][1](i) for f, i in rings), standing) / seen
        since += 1
        if (since > _LAST and width <= _WIDTHS[1]) or mixture.covered >= enough:
            break
        mixture.add(added, width)
        for _ in range(_CORRECTIONS):
            mixture.correct(width)
        width = max(width * _NARROWING, _WIDTHS[1])
    return FoundPrices(best, least, mixture.covered)
