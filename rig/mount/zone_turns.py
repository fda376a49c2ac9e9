"""Find how the zone grids of a ring's sensors arrive: turned by quarter turns, or mirrored.

The sensors' first returns do not depend on it, so mounting errors and seats are found before. Here
each wire is compared with each seat in each turn, over all zones at all stops: the cost is that of
``channel_assignment``. A picture that looks the same after a turn settles nothing.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ...coverage.rings.ring import Ring, Setup
from ...objectives.scene import Scene
from ...simulation.twin.zone_grid import GridTurn, every_turn, stated_turn, zone_grid
from ..sensing.readings import Stops
from ..sensing.zone_targets import expected_zones
from .channel_assignment import SURE, Order, reading_costs

_TOLERANCE = 0.03  # m; of the readings of a fitted ring's zones
_UPSIDE_DOWN = GridTurn(180)


@dataclass(frozen=True)
class ZoneTurns:
    """How the zone grids of a ring arrive."""

    stated: GridTurn
    """As the proposal states it."""
    turn: GridTurn
    """As the readings show it for most sensors; ``stated`` if they do not show it."""
    turned: dict[int, GridTurn]
    """How the sensors that differ from the others are turned besides, by their wire."""
    unknown: tuple[int, ...]
    """Wires whose readings do not show their turn."""

    def stated_in(self, ring: Ring) -> Ring:
        """Return ``ring`` with the turn that the readings show."""
        turned: Any = self.turn.turn_deg
        return replace(ring, zone_turn_deg=turned, zone_mirrored=self.turn.mirrored)

    def faults(self, ring: int, link: str) -> list[str]:
        """Describe each difference from the proposal, and what to set or turn, one line each."""
        found = []
        if self.turn != self.stated:
            mirrored = f", zone_mirrored = {str(self.turn.mirrored).lower()}"
            found.append(
                f"the zones of its sensors are {self.turn.text()}, not {self.stated.text()}: set"
                f" zone_turn_deg = {self.turn.turn_deg}"
                + mirrored * (self.turn.mirrored or self.stated.mirrored)
                + f" in [[rings]] {ring} ({link}) of the proposal"
            )
        for wire, turn in sorted(self.turned.items()):
            back = (
                "90° counter-clockwise" if turn.turn_deg == 270 else f"{turn.turn_deg}° clockwise"
            )
            advice = f"turn it back by {back}, as seen along its axis"
            if turn.mirrored:
                advice = "its columns arrive in the opposite order"
            found.append(f"sensor {wire} is {turn.text()} about its own axis: {advice}")
        return found


def turn_costs(
    scene: Scene, built: Ring, stops: Stops, joints: Float[np.ndarray, "P J"], offset: float
) -> tuple[list[GridTurn], Float[np.ndarray, "g n n"]]:
    """Return the turns, and the cost of each wire (row) in each seat (column) at each turn.

    Args:
        scene: with the known cell.
        built: the ring as fitted.
        stops: readings of its zones, by wire.
        joints: (P, J) rad, the stops.
        offset: what its sensors read too much, m.
    """
    rows, columns = zone_grid(built.sensor)
    wanted = expected_zones(scene, Setup((built,)), 0, joints)[..., 0] + offset
    turns = every_turn(rows, columns)
    heard = stops.total > 0
    table = np.zeros((len(turns), built.count, built.count))
    for g, turn in enumerate(turns):
        seats = turn.arrives(wanted).reshape(*wanted.shape[:2], -1)  # (P, n, Z)
        for p in range(len(joints)):
            cost = reading_costs(stops.distance[p][:, None], seats[p][None], _TOLERANCE)
            table[g] += (cost * heard[p][:, None]).sum(axis=2)
    return turns, table / rows  # neighbours see the same: as much weight as a row


def zone_turns(
    ring: Ring,
    order: Order,
    seat: Int[np.ndarray, " n"],
    turns: list[GridTurn],
    table: Float[np.ndarray, "g n n"],
    silent: Int[np.ndarray, " s"],
) -> ZoneTurns:
    """Return how the grids of a ring arrive, from the costs of each turn; ``silent`` wires show
    nothing.
    """
    stated = stated_turn(ring)
    if order.flipped:
        stated = stated.after(_UPSIDE_DOWN)
    wires = np.setdiff1d(np.arange(ring.count), silent)
    each = table[:, wires, seat[wires]]  # (g, wires)
    meant = turns.index(stated)
    votes = each.argmin(axis=0)
    common = meant
    clear = each[meant] - each.min(axis=0) > SURE
    if clear.sum() * 2 > len(wires):
        common = int(np.bincount(votes[clear], minlength=len(turns)).argmax())
    turned, unknown = dict[int, GridTurn](), list[int]()
    for k, wire in enumerate(wires):
        others = np.delete(each[:, k], votes[k])
        if others.min() - each[votes[k], k] <= SURE:
            unknown.append(int(wire))
        if votes[k] != common and each[common, k] - each[votes[k], k] > SURE:
            turned[int(wire)] = _besides(turns[votes[k]], turns[common])
    return ZoneTurns(stated, turns[common], turned, tuple(unknown))


def nearest_zones(
    scene: Scene,
    built: Ring,
    stops: Stops,
    joints: Float[np.ndarray, "P J"],
    seat: Int[np.ndarray, " n"],
    turns: ZoneTurns,
) -> tuple[Float[np.ndarray, "P n"], Float[np.ndarray, "P n"]]:
    """Return the reading of the zone of each wire that should be nearest, m, nan without one; and
    its expected reading without the ring's offset, m, infinite without a target.

    The least of all zones is less on average, because it is chosen by its noise.
    """
    wanted = expected_zones(scene, Setup((built,)), 0, joints)[..., 0]
    read = np.full((len(joints), built.count), np.nan)
    nearest = wanted.min(axis=(2, 3))[:, seat]
    for wire, at in enumerate(seat):
        turn = turns.turn.after(turns.turned.get(wire, GridTurn()))
        zone = turn.arrives(wanted[:, at]).reshape(len(joints), -1).argmin(axis=1)
        read[:, wire] = stops.distance[np.arange(len(joints)), wire, zone]
    return read, nearest


def _besides(turn: GridTurn, common: GridTurn) -> GridTurn:
    """Return the turn that, before ``common``, gives ``turn``."""
    return next(g for g in every_turn(2, 2) if common.after(g) == turn)
