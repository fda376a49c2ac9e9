"""Find which sensor is which: assign the places in a ring's frames to the seats on the ring, from
the readings that each seat should have.

All hypotheses use one table, the cost of each wire in each seat: the squared difference between
actual and expected readings at all stops, in standard deviations. Each term is capped, because
jumps and lost readings are not less likely than that.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import linear_sum_assignment

COARSE = 0.04  # m; tolerance for the readings of a ring with small mounting errors
CAP = 25.0  # squares of standard deviations, of one reading
MISSED = 9.0  # cost of a reading where none is expected, and of a missing one
SURE = 40.0  # required advantage of another assignment: twice a log likelihood ratio
_TIE = 0.02  # of the best cost: within this, the proposed order wins


@dataclass(frozen=True)
class Order:
    """Order of all wires: wire s is on seat (shift + direction s) mod n."""

    direction: int = 1
    """1, or -1 for a ring that is wired in reverse."""
    shift: int = 0
    """Seat of wire 0."""
    flipped: bool = False
    """Whether the ring is mounted the other way round, so that its sensors tilt the other way."""

    def seat(self, count: int) -> Int[np.ndarray, " n"]:
        """Return the seat of each wire."""
        return (self.shift + self.direction * np.arange(count)) % count


def reading_costs(
    read: Float[np.ndarray, "*#n"],
    wanted: Float[np.ndarray, "*#n"],
    sigma: Float[np.ndarray, "*#n"] | float,
) -> Float[np.ndarray, "*n"]:
    """Return the cost of each reading (...) m, nan without a target, where ``wanted`` (...) m is
    expected, infinite without one, by its standard deviation (...) m.
    """
    has, there = np.isfinite(read), np.isfinite(wanted)
    with np.errstate(invalid="ignore"):
        z = (read - wanted) / sigma
    return np.where(has & there, np.minimum(z * z, CAP), np.where(has ^ there, MISSED, 0.0))


def costs(
    measured: Float[np.ndarray, "P n"],
    wanted: Float[np.ndarray, "P n"],
    sigma: Float[np.ndarray, "P n"] | float,
) -> Float[np.ndarray, "n n"]:
    """Return the cost of each wire (row) in each seat (column).

    Args:
        measured: readings of the wires at P stops, m; nan without a target.
        wanted: expected readings of the seats, m; infinite without a target.
        sigma: standard deviations of the seats' readings, m.
    """
    sigma = np.broadcast_to(sigma, wanted.shape)
    total = np.zeros((measured.shape[1], wanted.shape[1]))
    for m, w, s in zip(measured, wanted, sigma, strict=True):
        total += reading_costs(m[:, None], w[None], s[None])
    return total


def best_order(
    tables: dict[bool, Float[np.ndarray, "n n"]], silent: Int[np.ndarray, " s"]
) -> Order:
    """Return the most likely order of all wires. ``tables`` has the costs for a ring mounted as
    proposed (False) and the other way round (True); ``silent`` wires are ignored.
    """
    total: dict[Order, float] = {}
    for flipped, table in tables.items():
        n = len(table)
        wires = np.setdiff1d(np.arange(n), silent)
        for direction in (-1,) if flipped else (1, -1):
            for shift in range(n):
                order = Order(direction, shift, flipped)
                total[order] = float(table[wires, order.seat(n)[wires]].sum())
    best, meant = min(total, key=lambda o: total[o]), Order()
    return meant if total[meant] <= total[best] * (1 + _TIE) + SURE else best


def least_cost(
    measured: Float[np.ndarray, "P n"], wanted: Sequence[Float[np.ndarray, "P n"]]
) -> float:
    """Return the cost of the readings of a ring in the best order of its wires.

    Args:
        measured: readings of the wires at P stops, m.
        wanted: expected readings of the ring as proposed, and mounted the other way round, m.
    """
    silent = np.flatnonzero(~np.isfinite(measured).any(axis=0))
    tables = {bool(i): costs(measured, distance, COARSE) for i, distance in enumerate(wanted)}
    order = best_order(tables, silent)
    wires = np.setdiff1d(np.arange(measured.shape[1]), silent)
    return float(tables[order.flipped][wires, order.seat(measured.shape[1])[wires]].sum())


def reseated(
    table: Float[np.ndarray, "n n"], seat: Int[np.ndarray, " n"], silent: Int[np.ndarray, " s"]
) -> Int[np.ndarray, " n"]:
    """Return the seat of each wire, which differs from ``seat`` only where exchanging some wires is
    clearly more likely; ``silent`` wires fit anywhere. The best assignment differs from ``seat`` by
    cycles, and each cycle must be worthwhile on its own.
    """
    table = table.copy()
    table[silent] = 0.0
    wire, best = linear_sum_assignment(
        table + 1e-6 * (np.arange(len(table))[None] != seat[:, None])
    )
    other = np.empty(len(table), int)
    other[wire] = best
    seats, holder = seat.copy(), np.argsort(seat)
    for cycle in _cycles(holder[other]):
        if table[cycle, seat[cycle]].sum() - table[cycle, other[cycle]].sum() > SURE:
            seats[cycle] = other[cycle]
    return seats


def _cycles(step: Int[np.ndarray, " n"]) -> list[list[int]]:
    """Return the cycles of a permutation longer than one."""
    left, cycles = set(range(len(step))), []
    while left:
        cycle = [left.pop()]
        while (after := int(step[cycle[-1]])) != cycle[0]:
            cycle.append(after)
            left.remove(after)
        if len(cycle) > 1:
            cycles.append(cycle)
    return cycles


def mixed(order: Order, seat: Int[np.ndarray, " n"]) -> list[tuple[int, ...]]:
    """Return the wires whose seat differs from ``order``, cycle by cycle: two swapped wires, or
    more that are permuted.
    """
    holder = np.argsort(order.seat(len(seat)))
    return sorted(tuple(sorted(cycle)) for cycle in _cycles(holder[seat]))


def wiring_faults(order: Order, mixed_up: Sequence[tuple[int, ...]]) -> list[str]:
    """Describe the faults of a ring's wiring."""
    faults = []
    if order.flipped:
        faults.append("is mounted the other way round")
    elif order.direction < 0:
        faults.append("is wired in reverse")
    if order.shift:
        faults.append(
            f"starts at sensor {order.shift}: rotated, or wired with a shift, by {order.shift}"
            " sensors"
        )
    return faults + [
        f"sensors {' and '.join(map(str, cycle))} are"
        f" {'swapped' if len(cycle) == 2 else 'mixed up'}"
        for cycle in mixed_up
    ]
