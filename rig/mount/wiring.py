"""Which sensor is which: the places in a ring's frames against the seats on the ring, by what each
should see.

All hypotheses are judged by one table, the cost of each wire in each seat: what was read at all
stops against what that seat should read, squares of standard deviations, none above a cap, as jumps
and lost readings are no more than that unlikely.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import linear_sum_assignment

CAP = 25.0  # squares of standard deviations, of one reading
_MISSED = 9.0  # of a reading where there should be none, and the other way round
_SURE = 40.0  # by which another seating must be better: twice the logarithm of a likelihood ratio
_TIE = 0.02  # of the best cost: the order that was meant wins such a tie


@dataclass(frozen=True)
class Order:
    """All wires in a row: wire s on seat (shift + direction s) mod n. flipped: the ring is mounted
    the other way round, so that its sensors tilt the other way."""

    direction: int = 1
    shift: int = 0
    flipped: bool = False

    def seat(self, count: int) -> Int[np.ndarray, " n"]:
        """Of each wire the seat."""
        return (self.shift + self.direction * np.arange(count)) % count


def costs(
    measured: Float[np.ndarray, "P n"],
    wanted: Float[np.ndarray, "P n"],
    sigma: Float[np.ndarray, "P n"] | float,
) -> Float[np.ndarray, "n n"]:
    """The cost of each wire (row) in each seat (column).

    Args:
        measured: of wires at P stops, m; nan where there was no target.
        wanted: of seats, m; infinite where there should be none.
        sigma: standard deviations of the seats' readings, m.
    """
    sigma = np.broadcast_to(sigma, wanted.shape)
    read, there = np.isfinite(measured), np.isfinite(wanted)
    total = np.zeros((measured.shape[1], wanted.shape[1]))
    for m, r, w, t, s in zip(measured, read, wanted, there, sigma, strict=True):
        with np.errstate(invalid="ignore"):
            z = (m[:, None] - w[None]) / s[None]
        both, one = r[:, None] & t[None], r[:, None] != t[None]
        total += np.where(both, np.minimum(z * z, CAP), np.where(one, _MISSED, 0.0))
    return total


def best_order(
    tables: dict[bool, Float[np.ndarray, "n n"]], silent: Int[np.ndarray, " s"]
) -> Order:
    """The likeliest order of all wires, by tables of costs for a ring mounted as meant (False) and
    the other way round (True); ``silent`` wires tell nothing."""
    found: dict[Order, float] = {}
    for flipped, table in tables.items():
        n = len(table)
        wires = np.setdiff1d(np.arange(n), silent)
        for direction in (-1,) if flipped else (1, -1):
            for shift in range(n):
                order = Order(direction, shift, flipped)
                found[order] = float(table[wires, order.seat(n)[wires]].sum())
    best, meant = min(found, key=lambda o: found[o]), Order()
    return meant if found[meant] <= found[best] * (1 + _TIE) + _SURE else best


def reseated(
    table: Float[np.ndarray, "n n"], seat: Int[np.ndarray, " n"], silent: Int[np.ndarray, " s"]
) -> Int[np.ndarray, " n"]:
    """The seat of each wire, other than ``seat`` where exchanges among some wires are surely
    likelier; ``silent`` wires fit anywhere. The best assignment differs from ``seat`` by cycles,
    each of which must be worth it by itself."""
    table = table.copy()
    table[silent] = 0.0
    wire, best = linear_sum_assignment(
        table + 1e-6 * (np.arange(len(table))[None] != seat[:, None])
    )
    other = np.empty(len(table), int)
    other[wire] = best
    found, holder = seat.copy(), np.argsort(seat)
    for cycle in _cycles(holder[other]):
        if table[cycle, seat[cycle]].sum() - table[cycle, other[cycle]].sum() > _SURE:
            found[cycle] = other[cycle]
    return found


def _cycles(step: Int[np.ndarray, " n"]) -> list[list[int]]:
    """The cycles of a permutation that move anything."""
    left, found = set(range(len(step))), []
    while left:
        cycle = [left.pop()]
        while (after := int(step[cycle[-1]])) != cycle[0]:
            cycle.append(after)
            left.remove(after)
        if len(cycle) > 1:
            found.append(cycle)
    return found


def mixed(order: Order, seat: Int[np.ndarray, " n"]) -> list[tuple[int, ...]]:
    """The wires that sit elsewhere than ``order`` says, exchange by exchange: pairs are swapped,
    more go round.
    """
    holder = np.argsort(order.seat(len(seat)))
    return sorted(tuple(sorted(cycle)) for cycle in _cycles(holder[seat]))


def told(order: Order, mixed_up: Sequence[tuple[int, ...]]) -> list[str]:
    """What is wrong with a ring's wiring, in words."""
    found = []
    if order.flipped:
        found.append("is mounted the other way round")
    elif order.direction < 0:
        found.append("is wired in reverse")
    if order.shift:
        found.append(
            f"begins with sensor {order.shift}: turned, or wired, by {order.shift} sensors"
        )
    return found + [
        f"sensors {' and '.join(map(str, cycle))} are"
        f" {'swapped' if len(cycle) == 2 else 'mixed up'}"
        for cycle in mixed_up
    ]
