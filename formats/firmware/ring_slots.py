"""Slots of a ring's firmware: when each of its sensors may range, from the firing schedule.

Rings of one group keep in step by one wire: the first ring raises it at the beginning of each
cycle, and the others time their slots from that edge by their own clocks. A sensor starts only if
its ranging ends before its slot does, on any clock of the group; otherwise it waits for its next
slot. So the order never depends on how quick a controller is, only the number of readings does.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated

from pydantic import Field

from ...coverage.definitions.definition import definition, refuse
from ...coverage.definitions.field_types import Items
from ...coverage.electronics.drivers import driver
from ...coverage.electronics.ring_bus import LEAST_HZ, transfer_s
from ...coverage.rings.ring import Setup
from ...objectives.firing.schedule import FiringGroup, FiringSchedule

SETTLE_S = 0.3
"""Time that a check lets the robot stand before readings count, s, if no reading may be older: an
arm still swings after arrival."""
_EDGES_US, _CRYSTALS = 100, 1e-4  # interrupts of an edge on two rings; difference of their crystals
_COMMAND = 36  # bytes at most that start a ranging, with addresses and a channel's selection
# longer than a cycle, so that no frame is due right before the next one begins
_SPARE_US = 10_000
_Micros = Annotated[int, Field(ge=0, le=100_000_000)]
_Numbers = Annotated[Items[Annotated[int, Field(ge=0, le=1000)]], Field(max_length=1000)]


@definition(kw_only=True)
class RingSlots:
    """Slots of one ring; times are those of its group, from the beginning of a cycle."""

    cycle_us: Annotated[_Micros, Field(ge=1)]
    """Time between two rangings of a sensor, µs."""
    starts_us: Annotated[Items[_Micros], Field(max_length=1000)]
    """Beginning of each slot, µs."""
    ends_us: Annotated[Items[_Micros], Field(max_length=1000)]
    """End of each slot, µs."""
    slot: _Numbers
    """Slot of each sensor."""
    ranging_us: _Micros
    """Time in which a sensor ranges, µs."""
    command_us: _Micros
    """Time of the command that starts one, µs."""
    leads: bool
    """Whether it raises the clock line of its group."""
    rings: _Numbers
    """Rings of the group."""

    def __post_init__(self) -> None:
        if len(self.ends_us) != len(self.starts_us):
            refuse([(("ends_us",), f"{len(self.ends_us)}", f"{len(self.starts_us)}, one a slot")])
        if (last := max(self.slot, default=0)) >= len(self.starts_us):
            refuse([(("slot",), f"slot {last}", f"below {len(self.starts_us)}")])

    @property
    def shared(self) -> bool:
        """Whether a line carries the clock of several rings."""
        return len(self.rings) > 1

    @property
    def sync_us(self) -> int:
        """Largest difference of two rings' clocks in a cycle, µs: the interrupts of the edge, and
        crystals that differ by 100 ppm over the cycle, or over a second if that is longer."""
        return _EDGES_US + math.ceil(_CRYSTALS * max(self.cycle_us, 1_000_000))

    @property
    def latest_us(self) -> tuple[int, ...]:
        """Latest time in each slot at which a ranging may start, µs."""
        needed = self.ranging_us + self.command_us + self.sync_us
        return tuple(end - needed for end in self.ends_us)

    @property
    def frames(self) -> int:
        """Frames in a cycle: the fewest that keep the protocol's least rate."""
        return math.ceil((self.cycle_us + _SPARE_US) * LEAST_HZ / 1e6)

    @property
    def frame_ms(self) -> int:
        """Time between frames, ms. The first is sent when a cycle begins, so that the last is
        followed by the next a little sooner."""
        return math.ceil((self.cycle_us + _SPARE_US) / (1000 * self.frames))

    @property
    def rate_hz(self) -> float:
        """Readings of every sensor per second."""
        return 1e6 / self.cycle_us


def ring_slots(
    setup: Setup, schedule: FiringSchedule, hertz: Sequence[int]
) -> Mapping[int, RingSlots]:
    """Return the slots of the rings that need some, by their numbers; a group has none if all its
    sensors may range at once, or if no firmware starts single rangings of its sensors.

    Args:
        setup: the sensors.
        schedule: their firing schedule.
        hertz: clock of each ring's bus, Hz.
    """
    groups = [g for g in schedule.groups if len(g.slots) > 1 and not _free(setup, g)]
    return {
        ring: _slots(setup, group, ring, schedule.rings[ring].rate_hz, hertz[ring])
        for group in groups
        for ring in group.rings
    }


def slot_notes(setup: Setup, schedule: FiringSchedule) -> list[str]:
    """Return notes on groups that need slots: those whose firmware has none, and slow ones."""
    notes = list[str]()
    for group in schedule.groups:
        rings = f"ring{'s' * (len(group.rings) > 1)} {', '.join(map(str, group.rings))}"
        if len(group.slots) == 1:
            continue
        if free := _free(setup, group):
            notes.append(
                f"{rings}: all sensors range at once, although some may disturb each other: the"
                f" library of the {', '.join(free)} starts no single ranging"
            )
        elif group.period_s > SETTLE_S:
            notes.append(
                f"{rings}: readings are up to {1000 * group.period_s:.0f} ms old; check with"
                f" --scheduled, which waits for them: else it reads {1000 * SETTLE_S:.0f} ms after"
                " the robot has stopped, when its first readings may be of the way there"
            )
    return notes


def _free(setup: Setup, group: FiringGroup) -> list[str]:
    """Return the sensors of a group of which no firmware starts single rangings."""
    drivers = {driver(setup.groups[ring].sensor) for ring in group.rings}
    return sorted(one.title for one in drivers if one.bytes_zone)


def _slots(setup: Setup, group: FiringGroup, ring: int, rate_hz: float, hertz: int) -> RingSlots:
    sensor = setup.groups[ring].sensor
    number = {one: n for n, slot in enumerate(group.slots) for one in slot.sensors}
    starts = tuple(round(1e6 * slot.start_s) for slot in group.slots)
    return RingSlots(
        cycle_us=round(1e6 / rate_hz),
        starts_us=starts,
        ends_us=(*starts[1:], round(1e6 * group.period_s)),
        slot=tuple(number[ring, i] for i in range(setup.groups[ring].count)),
        ranging_us=round(1e6 * driver(sensor).shortest_s(sensor)),
        command_us=round(1e6 * transfer_s(_COMMAND, hertz)),
        leads=ring == group.rings[0],
        rings=group.rings,
    )
