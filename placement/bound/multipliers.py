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
from .price_field import PriceField
from .ring_values import RingSums, shares

_AZIMUTHS = 48
_POSITION, _TILT = 0.1, math.radians(6)  # m and rad, steps of the grid
_WIDTHS = 0.6, 0.06  # first and last half width of the smoothing
_NARROWING = 0.98
_MEAN = 0.06  # weight of the newest prices in their running mean
_EVERY = 4  # steps between evaluations of the mean
_LAST = 25  # steps without a better bound after which the search ends


@dataclass(frozen=True)
class _Grid:
    """Rings of a family on a grid of places."""

    sums: RingSums
    """Sums over the sensors of a ring of each size."""
    shares: Float[np.ndarray, "N A J"]
    """Mass of each Gaussian in a sensor's beam at each place and azimuth, as a share of the
    target."""

    @staticmethod
    def of(family: Family, beam: BlurredBeam, field: PriceField) -> "_Grid":
        """Evaluate the grid of a family."""
        azimuths = np.arange(_AZIMUTHS) * (2 * math.pi / _AZIMUTHS)
        length, (low, high) = family.mount.length, family.tilt
        tilts = np.linspace(low, high, max(math.ceil((high - low) / _TILT), 1) + 1)
        positions = [
            p
            for a, b in family.positions
            for p in np.linspace(a, b, max(math.ceil((b - a) * length / _POSITION), 1) + 1)
        ]
        each = [
            shares(beam, field, *family.beams(p, t, azimuths))
            for p in dict.fromkeys(positions)
            for t in tilts
        ]
        scaled = np.stack(each) * np.float32(field.worth)
        return _Grid(RingSums(family.counts, _AZIMUTHS), scaled)

    def best(
        self, prices: Float[np.ndarray, " J"]
    ) -> tuple[Float[np.ndarray, " C"], Callable[[int], Float[np.ndarray, " J"]]]:
        """Return the largest value of a ring of each size, and a function that returns the mass of
        each Gaussian in such a ring."""
        values = self.shares @ prices.astype(np.float32)
        most, where, weights = self.sums.best(values)
        return most.astype(float), lambda i: weights[i] @ self.shares[where[i]]


def _slopes(filled: Float[np.ndarray, " J"], width: float) -> Float[np.ndarray, " J"]:
    """Return the derivative of the smoothed min(1, u)."""
    slope: np.ndarray = np.clip((1 + width - filled) / (2 * width), 0.0, 1.0)
    return slope


def _step(
    filled: Float[np.ndarray, " J"],
    way: Float[np.ndarray, " J"],
    held: Float[np.ndarray, " J"],
    width: float,
) -> float:
    """Return the step in [0, 1] along ``way`` after which the smoothed coverage is largest."""
    low, high = 0.0, 1.0
    for _ in range(20):
        middle = (low + high) / 2
        rising = float(_slopes(filled + middle * way, width) @ (held * way)) > 0
        low, high = (middle, high) if rising else (low, middle)
    return low


def find_prices(
    some: tuple[Family, ...],
    beams: list[BlurredBeam],
    field: PriceField,
    budget: Budget,
    standing: Float[np.ndarray, " J"],
    seen: int,
    steps: int,
) -> Float[np.ndarray, " J"]:
    """Return prices, at most ``field.most``, whose bound on a grid of rings is the lowest.

    Args:
        some: families of rings.
        beams: beam of each family's sensor.
        field: the lattice.
        budget: what a layout may consist of.
        standing: mass of each Gaussian in the beams of sensors that stay, as a share of the target.
        seen: number of sensors that must cover a point.
        steps: most steps.
    """
    grids = [_Grid.of(f, b, field) for f, b in zip(some, beams, strict=True)]
    covered = standing / seen
    width, mean = _WIDTHS[0], np.zeros(len(field.held))
    least, best, since = math.inf, np.full(len(field.held), field.most), 0
    for step in range(steps):
        now = _slopes(covered / field.held, width) * field.most
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
        if since > _LAST and width <= _WIDTHS[1]:
            break
        way = (added - covered) / field.held
        covered = covered + _step(covered / field.held, way, field.held, width) * (added - covered)
        width = max(width * _NARROWING, _WIDTHS[1])
    return best
