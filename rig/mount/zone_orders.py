"""Test whether the zone grids of a ring's sensors fit any turn or mirror image at all.

Firmware and adapters also mix zones otherwise: they swap the columns of each pair, say, or start
one zone too late. The best of eight turns is then wrong too, and what is fitted to it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import linear_sum_assignment

from ...simulation.twin.zone_grid import every_turn
from ..sensing.readings import Stops
from .channel_assignment import CAP, SURE, reading_costs

_TOLERANCE = 0.03  # m; of the readings of a fitted ring's zones
# mean cost of a zone's reading, above which a grid fits no turn, although the sensor's first return
# has no more than the other; a chip's zones may read farther than the nearest ray by centimetres
_MISFIT, _NEAREST = 8.0, 4.0
_CLEARLY = 0.8  # of the cost of the best stated order, below which columns or rows are mixed anyhow


@dataclass(frozen=True)
class ZoneOrder:
    """An order in which the zones of a sensor may arrive, by mistake."""

    text: str
    """What is mixed."""
    index: Int[np.ndarray, " Z"]
    """The zone whose reading arrives at each place."""


def zone_orders(rows: int, columns: int) -> list[ZoneOrder]:
    """Return the orders that are tried for grids of ``rows`` times ``columns`` zones."""
    number = np.arange(rows * columns).reshape(rows, columns)
    found = [("grid starts one zone too late or too early", np.roll(number, s)) for s in (1, -1)]
    for axis, count, name, halves in (
        (1, columns, "columns", "left and right halves"),
        (0, rows, "rows", "upper and lower halves"),
    ):
        at = np.arange(count)
        if count % 2 == 0:
            found.append((f"{name} of each pair are swapped", np.take(number, at ^ 1, axis)))
        if count > 2 and count % 2 == 0:
            found.append((f"{halves} are swapped", np.roll(number, count // 2, axis)))
        shifts = (1, -1) if count > 2 else ()
        found += [(f"{name} are shifted by one", np.roll(number, s, axis)) for s in shifts]
    return [ZoneOrder(text, grid.ravel()) for text, grid in found]


@dataclass(frozen=True)
class GridFit:
    """How well the turns explain the grid of one sensor, and how well the best other order."""

    turn: float
    """Mean cost of a zone's reading in the best turn."""
    other: float
    """The same for the best other order, in any turn."""
    text: str
    """That order."""
    nearest: float
    """Mean cost of the sensor's first return, which depends on no order."""
    readings: int
    """Number of readings of zones that count."""

    def misfit(self, rows: int) -> str | None:
        """Return what is mixed if the grid fits no turn and no mirror, "" if it is unknown, and
        None if it fits one.
        """
        gain = (self.turn - self.other) * self.readings / rows  # neighbours see the same
        if gain > SURE and self.other <= self.turn / 2:
            return self.text
        unknown = self.turn > _MISFIT and self.nearest < _NEAREST and self.readings >= rows
        return "" if unknown else None


def grid_fit(wanted: Float[np.ndarray, "P r c"], stops: Stops, wire: int) -> GridFit:
    """Compare the readings of one wire's zones with those of its seat (P, r, c), m, including the
    offset of its sensors, in each turn and each other order.
    """
    rows, columns = wanted.shape[1:]
    turns = [turn.arrives(wanted).reshape(len(wanted), -1) for turn in every_turn(rows, columns)]
    read, heard = stops.distance[:, wire], stops.total[:, wire] > 0

    def cost(want: Float[np.ndarray, "P Z"]) -> float:
        return float((reading_costs(read, want, _TOLERANCE) * heard).sum())

    orders = zone_orders(rows, columns)
    # rounded: of orders that are the same but for a turn, that without one counts
    others = [
        (round(cost(turn[:, order.index]), 6), number, order.text)
        for order in orders
        for number, turn in enumerate(turns)
    ]
    shape = (len(wanted), rows, columns)
    mixed = min(
        _mixed(read.reshape(shape), heard.reshape(shape), turn.reshape(shape)) for turn in turns
    )
    count = int((heard & np.isfinite(read)).sum())
    best, _, text = min(others)
    if mixed[0] < _CLEARLY * best:
        best, text = mixed
    number = max(count, 1)
    near = [np.where(np.isfinite(grid), grid, np.inf).min(axis=1) for grid in (read, turns[0])]
    both = np.isfinite(near[0]) & np.isfinite(near[1])
    off = (near[0][both] - near[1][both]) / _TOLERANCE
    nearest = float(np.minimum(off * off, CAP).mean()) if both.any() else CAP
    return GridFit(min(map(cost, turns)) / number, best / number, text, nearest, count)


def _mixed(
    read: Float[np.ndarray, "P r c"],
    heard: Bool[np.ndarray, "P r c"],
    want: Float[np.ndarray, "P r c"],
) -> tuple[float, str]:
    """Return the cost of the best order of the columns, or of the rows, and which it mixes."""
    found = []
    for axis, name in ((2, "columns"), (1, "rows")):
        a, h, b = (np.moveaxis(grid, axis, 1) for grid in (read, heard, want))
        cost = reading_costs(a[:, :, None], b[:, None], _TOLERANCE)
        table = (cost * h[:, :, None]).sum(axis=(0, 3))
        found.append((float(table[linear_sum_assignment(table)].sum()), f"{name} are mixed"))
    return min(found)
