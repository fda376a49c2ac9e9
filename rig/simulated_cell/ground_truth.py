"""Mounting errors and faults of a simulated rig, drawn by a seed, which a check must detect."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.choices import Faults
from ...coverage.rings.ring import Setup
from ...formats.firmware.ring_pace import RingPace
from ...objectives.scene import Scene
from ...simulation.twin.zone_grid import GridTurn, every_turn, zone_grid, zoned
from ..mount.cell_frame import turned
from ..mount.mounting_error_model import LIMITS, free, moved
from ..mount.ring_fit import RingFit
from .world import DEAD, World

# minimum of sensors of a ring, to distinguish a swap or a reversed order from a rotation
_FEWEST = 4
_LATE = 0.4  # cycles by which a ring loses the step


@dataclass(frozen=True)
class Injected:
    """Errors and faults of a simulated rig with R rings and K sensors. A fault is None if no ring
    is large enough for it, or none was wanted. Single sensors have neither.
    """

    setup: Setup
    """The rings as proposed."""
    errors: Float[np.ndarray, "R 4"]
    """Errors of each ring by ``NAMES``."""
    reversed_ring: int | None
    """Ring that is reversed."""
    flipped: bool
    """Whether that ring is mounted the other way round, instead of wired in reverse."""
    swapped_in: int | None
    """Ring with two swapped wires."""
    pair: tuple[int, ...]
    """The swapped wires."""
    dead: int | None
    """Sensor of a ring that never answers, counted over all rings as wired."""
    seat: Int[np.ndarray, " K"]
    """As in ``World``."""
    turns_deg: Int[np.ndarray, " K"]
    """As in ``World``: one sensor with zones is turned about its own axis."""
    turned_cell: bool = False
    """Whether the cell stands turned by 180° about z of the base."""

    def world(self, scene: Scene) -> World:
        """Return the rig with all errors and faults."""
        scene = turned(scene) if self.turned_cell else scene
        rings = list(self.setup.rings)
        if self.flipped and self.reversed_ring is not None:
            rings[self.reversed_ring] = replace(
                rings[self.reversed_ring], tilt=-rings[self.reversed_ring].tilt
            )
        built = tuple(moved(scene, r, e) for r, e in zip(rings, self.errors, strict=True))
        offset = np.pad(self.errors[:, 3], (0, len(self.setup.singles)))  # of rings only
        turns = self.turns_deg.copy()
        if self.flipped:  # what is upside down has its pictures upside down
            turns[self.setup.ring_of_sensor == self.reversed_ring] += 180
        mounted = replace(self.setup, rings=built)
        return World(scene, mounted, self.seat, offset, turns_deg=turns % 360)

    @property
    def alive(self) -> Bool[np.ndarray, " K"]:
        """Whether the sensor of each seat answers."""
        alive = np.ones(len(self.seat), bool)
        alive[np.setdiff1d(np.arange(len(self.seat)), self.seat)] = False
        return alive

    def found(self, fits: Sequence[RingFit]) -> dict[str, bool]:
        """Return for each fault whether the check found it, and no other one of its kind."""
        ring_of, at = self.setup.ring_of_sensor, (-1, -1)
        if self.dead is not None:
            at = self.setup.labels[self.dead]
        orders = [(f.order.direction, f.order.flipped, f.order.shift) for f in fits]
        wanted = [(1, False, 0)] * len(fits)
        if self.reversed_ring is not None:
            wanted[self.reversed_ring] = (-1, self.flipped, 0)
        pairs = [(self.pair,) if i == self.swapped_in else () for i in range(len(fits))]
        dead = [at[1:] if i == at[0] else () for i in range(len(fits))]
        found = {
            "reversed ring": orders == wanted,
            "swapped pair": [f.mixed for f in fits] == pairs,
            "dead sensor": [f.dead for f in fits] == dead,
        }
        if self.turns_deg.any():
            right = [
                f.zones is None
                or (
                    f.zones.turn == f.zones.stated
                    and f.zones.turned
                    == {
                        k: GridTurn(int(t)) for k, t in enumerate(self.turns_deg[ring_of == i]) if t
                    }
                )
                for i, f in enumerate(fits)
            ]
            found["turned sensor"] = all(right)
        return found


def injected(scene: Scene, setup: Setup, seed: int, faults: Faults = "random") -> Injected:
    """Draw errors and faults: each ring off by up to ``LIMITS``, one reversed, two sensors of one
    swapped, one sensor dead, one with zones turned about its axis; or the turned cell alone, or
    none at all.
    """
    if faults != "random":
        nothing, none = np.zeros((len(setup.rings), 4)), np.zeros(setup.sensors, int)
        same = np.arange(setup.sensors)
        turned_cell = faults == "turned"
        return Injected(setup, nothing, None, False, None, (), None, same, none, turned_cell)
    rng, count = np.random.default_rng((seed, 7)), [r.count for r in setup.groups]
    errors = rng.uniform(-1, 1, (len(setup.rings), 4)) * LIMITS
    for i, ring in enumerate(setup.rings):
        if len(free(scene, ring)) < 4:
            errors[i, 0] = 0.0
    large = [i for i, n in enumerate(count) if n >= _FEWEST]
    which = [large[int(k)] for k in rng.integers(len(large), size=2)] if large else [None, None]
    turned, swapped = which
    flipped = bool(turned is not None and rng.random() < 0.5 and setup.rings[turned].tilt != 0)
    pair: tuple[int, ...] = ()
    seats = [np.arange(n) for n in count]
    if turned is not None:
        seats[turned] = -seats[turned] % count[turned]
    if swapped is not None:
        pair = tuple(sorted(int(k) for k in rng.choice(count[swapped], 2, replace=False)))
        seats[swapped][list(pair)] = seats[swapped][list(pair[::-1])]
    rings = count[: len(setup.rings)]
    dead = int(rng.integers(sum(rings))) if sum(rings) else None
    seat = np.concatenate([s + k.start for s, k in zip(seats, setup.slices, strict=True)])
    if dead is not None:
        seat[dead] = DEAD
    turns = _turned(rng, setup, dead)
    return Injected(setup, errors, turned, flipped, swapped, pair, dead, seat, turns)


def late_s(paces: Sequence[RingPace], faults: Faults) -> tuple[float, ...]:
    """Return the time by which the cycles of each ring begin late, s: ``_LATE``
    for the last ring of the first group that shares slots, if that is the fault; none otherwise.
    """
    late = [0.0] * len(paces)
    shared = [pace.slots for pace in paces if pace.slots is not None and pace.slots.shared]
    for slots in shared[:1] if faults == "late" else []:
        late[slots.rings[-1]] = _LATE * slots.cycle_us / 1e6
    return tuple(late)


def _turned(rng: np.random.Generator, setup: Setup, dead: int | None) -> Int[np.ndarray, " K"]:
    """Draw the sensor with zones that is turned, and by which angle; one that answers."""
    turns = np.zeros(setup.sensors, int)
    rings = {i for i in zoned(setup) if i < len(setup.rings)}
    some = [k for k, (i, _) in enumerate(setup.labels) if i in rings and k != dead]
    if some:
        k = some[int(rng.integers(len(some)))]
        every = every_turn(*zone_grid(setup.groups[setup.labels[k][0]].sensor))
        angles = [turn.turn_deg for turn in every if turn.turn_deg and not turn.mirrored]
        turns[k] = angles[int(rng.integers(len(angles)))]
    return turns
