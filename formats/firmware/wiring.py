"""Wiring of a ring: which pins, how its sensors share the I2C bus, and what the bus bears.

All sensors of this kind answer at the same address after power-up. Two ways around that:

- ``direct``: one bus, each XSHUT on its own pin. The sensors start one after another and take
  addresses of their own. It is limited by what a low level must sink: every sensor's board brings
  its own pull-ups.
- ``multiplexer``: TCA9548A, with each sensor alone on a channel. Every sensor keeps its address,
  also after a loss of power; one plug of four wires for each; and a sensor that holds the bus low
  blocks only its own channel, until the reset line frees the bus. Expanders for the XSHUT lines
  instead would leave all pull-ups and the load of all sensors on one bus.
"""

import math
from collections import Counter
from dataclasses import dataclass, replace

from ...coverage.electronics.controllers import ControllerBoard
from ...coverage.electronics.drivers import MODES, Driver, driver, model_name
from ...coverage.electronics.electronics import Electronics, ring_bus
from ...coverage.electronics.ring_bus import (
    CHANNELS,
    HEADROOM,
    MOST_SENSORS,
    REGULATORS,
    RingBus,
)
from ...coverage.rings.ring import Group, Setup
from ...coverage.sensors.sensor import Sensor
from ...objectives.firing.schedule import FiringSchedule
from ..ring_frame import Grid, frame_length
from .ring_slots import RingSlots, ring_slots

FIRST_MULTIPLEXER = 0x70
FEED_V = 24.0  # V, of the supply at the base that feeds the regulators of all rings
_SENSOR_ADDRESS = 0x29
FIRST_ADDRESS = _SENSOR_ADDRESS + 1  # of sensors with their own addresses


@dataclass(frozen=True)
class RingWiring:
    """Controller, pins and bus of one ring."""

    name: str
    """Name of the sketch and of its folder."""
    title: str
    """Number and link of the ring."""
    controller: ControllerBoard
    """Its board."""
    driver: Driver
    """Its sensors' driver."""
    sensor: Sensor
    """Its sensor."""
    mode: str
    """Distance mode of the sensors; may be empty."""
    assumed: bool
    """Whether the sensor of the scene names no model, so that the driver is an assumption."""
    angles_deg: tuple[float, ...]
    """Direction of each sensor about the mount axis, degrees; the order is that of the frames."""
    bus: RingBus
    """Its bus, with its clock and rate."""
    xshut: tuple[int, ...]
    """Pin of each sensor's XSHUT; empty with multiplexers."""
    channels: tuple[int, ...]
    """Sensors on each multiplexer, in the order of their addresses; empty without."""
    because: str
    """Why the sensors need multiplexers; empty without them, or if they were chosen."""
    slots: RingSlots | None = None
    """When each sensor may range; None: all range at once."""

    @property
    def rate_hz(self) -> int:
        """Readings of every sensor, and frames, per second, if all range at once."""
        return self.bus.rate_hz

    @property
    def period_ms(self) -> int:
        """Time between frames, ms."""
        return 1000 // self.bus.rate_hz if self.slots is None else self.slots.frame_ms

    @property
    def clock(self) -> int | None:
        """Pin of the line that carries the clock of several rings; None without one."""
        return self.controller.lines[-1] if self.slots and self.slots.shared else None

    @property
    def zones(self) -> int:
        """Zones of a sensor that a frame holds."""
        return self.sensor.zones**2 if self.driver.bytes_zone else 1

    @property
    def frame_bytes(self) -> int:
        """Length of a frame, bytes."""
        rows = self.sensor.zones
        grid = Grid(rows, rows, measured=True) if self.driver.bytes_zone else None
        return frame_length(self.count, grid)

    @property
    def count(self) -> int:
        """Number of sensors."""
        return len(self.angles_deg)

    @property
    def reset(self) -> int | None:
        """Pin that resets all multiplexers; None without them."""
        return self.controller.lines[0] if self.channels else None

    @property
    def pins(self) -> tuple[int, ...]:
        """All pins in use: SDA, SCL, then the reset or the XSHUT lines, and the clock line."""
        single = (pin for pin in (self.reset, *self.xshut, self.clock) if pin is not None)
        return (self.controller.sda, self.controller.scl, *single)

    @property
    def places(self) -> tuple[tuple[int, int], ...]:
        """Number of the multiplexer, and channel, of each sensor; empty without multiplexers."""
        return tuple((m, c) for m, used in enumerate(self.channels) for c in range(used))

    @property
    def addresses(self) -> tuple[int, ...]:
        """I2C address of each sensor in operation."""
        if self.channels:
            return (_SENSOR_ADDRESS,) * self.count
        return tuple(FIRST_ADDRESS + i for i in range(self.count))

    @property
    def supply_ma(self) -> float:
        """Peak current of all sensors, mA."""
        return self.count * self.driver.carrier.peak_ma

    @property
    def own_supply(self) -> bool:
        """Whether the sensors need a regulator of their own."""
        return self.supply_ma > self.controller.spare_ma

    @property
    def regulator_a(self) -> float | None:
        """Current of the regulator to 3.3 V that the sensors need, A, with its headroom; None if
        the controller feeds them."""
        need = HEADROOM * self.supply_ma / 1000
        return next(a for a in REGULATORS if a >= need) if self.own_supply else None

    @property
    def note(self) -> str:
        """A line that says why the ring has multiplexers; empty if there is nothing to say."""
        if not self.because:
            return ""
        number = len(self.channels)
        return f"{self.title}: {self.because}; it gets {number} multiplexer{'s' * (number > 1)}"

    @property
    def parts(self) -> tuple[tuple[int, str], ...]:
        """Parts to buy, each with its number."""
        added = Counter[float]()
        for segment, number in zip(self.bus.segments, (1, self.count), strict=False):
            if segment.added is not None:
                added[segment.added] += 2 * number
        resistors = [
            (number, f"resistor {ohm / 1000:g} kΩ, pull-up of SDA or SCL")
            for ohm, number in added.items()
        ]
        multiplexers = [(len(self.channels), "TCA9548A multiplexer board")]
        regulator = f"step-down regulator {FEED_V:g} V to 3.3 V, {self.regulator_a} A"
        return (
            (1, f"{self.controller.title} board"),
            *(multiplexers if self.channels else []),
            (self.count, f"{self.driver.title} on a board ({self.driver.carrier.title})"),
            *resistors,
            *([(1, regulator)] if self.own_supply else []),
        )


def plan_ring(title: str, group: Group, electronics: Electronics, name: str = "ring") -> RingWiring:
    """Return the wiring of a ring, or of a single sensor.

    Args:
        title: number and link of the ring, for messages and pages.
        group: the ring.
        electronics: its controller, rate and bus.
        name: name of the sketch.

    Raises:
        ValueError: if no firmware reads the sensor, or the bus does not bear so many; one line.
    """
    wiring = electronics.bus
    if wiring == "own":
        raise ValueError(f'{title}: the scene states electronics of your own, bus = "own"')
    try:
        kind = driver(group.sensor)
    except ValueError as error:
        raise ValueError(f"{title}: {error}") from error
    if not 1 <= group.count <= MOST_SENSORS:
        raise ValueError(f"{title}: found {group.count} sensors, allowed: 1 to {MOST_SENSORS}")
    plural = "sensor" if group.count == 1 else "sensors"
    radius = getattr(group, "radius", 0.0)
    bus = ring_bus(electronics, group.sensor, group.count, radius)
    if bus.fault:
        advice = "; multiplexers bear more" if wiring == "direct" else ""
        raise ValueError(f"{title}: {group.count} {plural}, {wiring}: {bus.fault}{advice}")
    because = ""
    if wiring == "auto" and bus.wiring == "multiplexer":
        direct = replace(electronics, bus="direct")
        fault = ring_bus(direct, group.sensor, group.count, radius).fault
        because = f"{group.count} {plural} on one bus: {fault}"
    each = 360 / group.count
    start = math.degrees(group.phase)
    number = math.ceil(group.count / CHANNELS)
    spread = tuple(len(range(m, group.count, number)) for m in range(number))
    return RingWiring(
        name=name,
        title=title,
        controller=electronics.board,
        driver=kind,
        sensor=group.sensor,
        mode=MODES.get(model_name(group.sensor), ""),
        assumed=group.sensor.use is None,
        angles_deg=tuple(round((start + i * each) % 360, 1) % 360 for i in range(group.count)),
        bus=bus,
        xshut=electronics.board.lines[: group.count] if bus.wiring == "direct" else (),
        channels=spread if bus.wiring == "multiplexer" else (),
        because=because,
    )


def plan_setup(
    setup: Setup, electronics: Electronics, schedule: FiringSchedule | None = None
) -> tuple[RingWiring, ...]:
    """Return the wirings of all rings and single sensors of a setup, in the order of their numbers.

    Args:
        setup: the sensors.
        electronics: how they are read.
        schedule: in whose slots they fire; None: all range at once.

    Raises:
        ValueError: if one cannot be wired so.
    """
    wirings = [
        plan_ring(f"ring {i} ({one.link})", one, electronics, f"ring{i}_{_plain(one.link)}")
        for i, one in enumerate(setup.groups)
    ]
    hertz = [wiring.bus.hertz for wiring in wirings]
    each = {} if schedule is None else ring_slots(setup, schedule, hertz)
    return tuple(replace(wiring, slots=each.get(i)) for i, wiring in enumerate(wirings))


def address_pads(number: int) -> str:
    """Return the pads to bridge on multiplexer ``number``, counted from 0; empty for none."""
    return ", ".join(f"A{bit}" for bit in range(3) if number >> bit & 1)


def _plain(link: str) -> str:
    """Return a link's name as part of a file name."""
    return "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in link)[:40]


def safe_name(text: str) -> str:
    """Return text for a comment, a heading or a cell: names of links are the user's."""
    return "".join(c if c.isprintable() and c not in "\\|<>`?" else "_" for c in text)
