"""The I2C bus of a ring: its parts, what each bears, and the fastest clock that it works at."""

import math
from dataclasses import dataclass, replace

from ..sensors.sensor import Sensor
from .bus_load import CABLE_PF_M, PIN_PF, RISE_NS, BusLine, fault, load, pull_up, weakest_pull_up
from .controllers import ControllerBoard
from .drivers import Driver

CHANNELS = 8  # of a TCA9548A
TRUNK_PF = 28.0  # of its SDA or SCL, at most (TI, SCPS207)
CHANNEL_PF = 7.5  # of a line of a channel, at most
TRUNK_PULL_UP = 10_000.0  # Ω on each line of Adafruit's board of it, by its schematic
_LEAD_M = 0.3  # cable from the controller to the ring, and to the first multiplexer
_APART_M = 0.1  # cable between two multiplexers, and from one to the ring
_SLACK = 1.2  # of a cable along the ring
LEAST_HZ, USUAL_HZ = 10, 20  # readings a second: the protocol's least, and most by default
REGULATORS = (0.5, 1.0, 2.0, 3.0, 5.0)  # A, of step-down regulators to 3.3 V as sold
HEADROOM = 1.25  # of a regulator's current over the sensors' peak
MOST_SENSORS = CHANNELS * 8  # multiplexers have eight addresses
_MOST_BUSY = 0.8  # share of the time that transfers may take


@dataclass(frozen=True)
class BusSegment:
    """One line, SDA or SCL, of a part of the bus."""

    title: str
    """What it is."""
    cable_m: float
    """Length of its cable, m."""
    line: BusLine
    """Load, pull-ups and current, with everything that is connected to it at one time."""
    added: float | None
    """Pull-up to add on it, Ω; None: none."""


def _carriers(driver: Driver, count: int) -> BusLine:
    """Return the load of ``count`` boards with sensors on one line."""
    one, each = load(0.0), driver.carrier
    for _ in range(count):
        behind = pull_up(each.sensor_pull_up, each.sensor_supply, shifted=True)
        one = one.joined(load(each.load_pf)).joined(pull_up(each.pull_up)).joined(behind)
    return one


def _cable(metres: float) -> BusLine:
    return load(CABLE_PF_M * metres)


def _direct(driver: Driver, count: int, radius: float, hertz: int) -> tuple[BusSegment, ...]:
    cable = _LEAD_M + _SLACK * math.tau * radius * (count - 1) / count
    line = load(PIN_PF).joined(_cable(cable)).joined(_carriers(driver, count))
    added = weakest_pull_up(line, hertz)
    return (BusSegment("bus", cable, line.pulled_up(added), added),)


def _multiplexed(driver: Driver, count: int, radius: float, hertz: int) -> tuple[BusSegment, ...]:
    """Return trunk, one channel alone, and both while a channel is connected: a switch connects
    loads and pull-ups, it does not separate them as a repeater would."""
    number = math.ceil(count / CHANNELS)
    trunk_m = _LEAD_M + _APART_M * (number - 1)
    trunk = load(PIN_PF + number * TRUNK_PF).joined(_cable(trunk_m))
    for _ in range(number):
        trunk = trunk.joined(pull_up(TRUNK_PULL_UP))
    channel_m = _APART_M + _SLACK * math.pi * radius
    channel = load(CHANNEL_PF).joined(_cable(channel_m)).joined(_carriers(driver, 1))
    on_channel = weakest_pull_up(channel, hertz)
    channel = channel.pulled_up(on_channel)
    needs = [weakest_pull_up(line, hertz) for line in (trunk, trunk.joined(channel))]
    added = min((ohm for ohm in needs if ohm is not None), default=None)
    trunk = trunk.pulled_up(added)
    both = trunk.joined(channel)
    return (
        BusSegment("trunk", trunk_m, trunk, added),
        BusSegment("channel, alone", channel_m, channel, on_channel),
        BusSegment("trunk with a channel", trunk_m + channel_m, both, None),
    )


@dataclass(frozen=True)
class RingBus:
    """The bus of a ring at one clock."""

    wiring: str
    """``direct`` or ``multiplexer``."""
    hertz: int
    """Clock, Hz."""
    rate_hz: int
    """Readings of every sensor, and frames, per second."""
    busy: float
    """Share of the time that transfers take."""
    segments: tuple[BusSegment, ...]
    """Its parts."""
    fault: str
    """Limit that it exceeds; empty if it works."""


def transfer_s(count: int, hertz: int) -> float:
    """Return the time of ``count`` bytes on a bus with a clock of ``hertz``, each with its
    acknowledge bit, s."""
    return 9 * count / hertz


def _bus(
    driver: Driver,
    sensor: Sensor,
    count: int,
    radius: float,
    rate: int | None,
    way: str,
    hertz: int,
) -> RingBus:
    """Return the bus of a ring at a clock of ``hertz``."""
    parts = _multiplexed if way == "multiplexer" else _direct
    segments = parts(driver, count, radius, hertz)
    busy_ms = 1e3 * count * transfer_s(driver.bytes_of(sensor), hertz)
    fastest = driver.most_hz(sensor)
    usual = max(LEAST_HZ, min(USUAL_HZ, fastest, int(1000 * _MOST_BUSY / busy_ms)))
    chosen = usual if rate is None else rate
    reason = next((line for s in segments if (line := fault(s.line, hertz))), "")
    if not reason and chosen > fastest:
        reason = f"{chosen} readings a second, allowed: {fastest}"
    if not reason and busy_ms * chosen > 1000 * _MOST_BUSY:
        allowed = 1000 * _MOST_BUSY / chosen
        reason = f"{busy_ms:.0f} ms for one reading of all, allowed: {allowed:.0f} at {chosen} Hz"
    return RingBus(way, hertz, chosen, busy_ms * chosen / 1000, segments, reason)


def ring_buses(
    driver: Driver,
    sensor: Sensor,
    count: int,
    radius: float,
    board: ControllerBoard,
    wiring: str,
    rate: int | None = None,
) -> list[RingBus]:
    """Return the buses that a ring may have, best first.

    Args:
        driver: driver of its sensors.
        sensor: its sensors.
        count: number of its sensors.
        radius: radius of the ring, m; 0 for a single sensor.
        board: its controller.
        wiring: ``direct``, ``multiplexer``, or ``auto`` for both.
        rate: readings per second; None: at most 20, as many as sensor and bus allow.
    """
    choices = (wiring,) if wiring != "auto" else ("direct", "multiplexer")
    buses = [
        _bus(driver, sensor, count, radius, rate, way, hertz)
        for way in choices
        for hertz in RISE_NS
    ]
    amperes = HEADROOM * count * driver.carrier.peak_ma / 1000
    short = {"direct": "", "multiplexer": ""}
    if count > len(board.lines):
        short["direct"] = f"the {board.title} has {len(board.lines)} free pins for XSHUT"
    for limit, exceeded in (
        (f"the {board.title} has {board.ram} bytes of memory", count * driver.ram > board.ram),
        (f"{amperes:.1f} A at 3.3 V, allowed: {REGULATORS[-1]:g} A", amperes > REGULATORS[-1]),
    ):
        short = {way: limit if exceeded else reason for way, reason in short.items()}
    return [replace(bus, fault=short[bus.wiring] or bus.fault) for bus in buses]
