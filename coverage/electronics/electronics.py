"""Electronics of the rings of a scene: how many sensors a ring carries electrically, and its bus.

Search, export, wiring, firmware and report all take the bus of a ring from ``ring_bus``. A sensor
that names no model, such as the paper's, and one that no firmware reads have no electrical data, so
that no limit applies to them.
"""

from bisect import bisect
from dataclasses import replace
from functools import lru_cache
from typing import Annotated

from pydantic import Field

from ..choices import Bus
from ..definitions.definition import definition
from ..sensors.effective_range import Use, model_of
from ..sensors.sensor import Sensor, effective
from .controllers import CONTROLLERS, DEFAULT_CONTROLLER, ControllerBoard, ControllerName
from .drivers import driver
from .ring_bus import LEAST_HZ, MOST_SENSORS, RingBus, ring_buses

MOST_HZ = 100


@definition
class Electronics:
    """How the sensors of each ring are read; they limit the number of sensors on a ring."""

    rate_hz: Annotated[int, Field(ge=LEAST_HZ, le=MOST_HZ)] | None = None
    """Readings of every sensor per second; default: at most 20, as many as sensor and bus allow."""
    bus: Bus = "auto"
    """How the sensors of a ring share its bus: ``direct``, each XSHUT on a pin; ``multiplexer``,
    each sensor on a channel; ``auto``, direct where the bus bears it; ``own``, by electronics of
    your own, which limit nothing."""
    controller: ControllerName = DEFAULT_CONTROLLER
    """Controller board of each ring."""

    @property
    def board(self) -> ControllerBoard:
        """The controller board of each ring."""
        return CONTROLLERS[self.controller]


def unknown_reason(electronics: Electronics, sensor: Sensor) -> str:
    """Return why nothing limits a ring of a sensor electrically, in one line; empty if something
    does."""
    if electronics.bus == "own":
        return 'the scene states electronics of your own, bus = "own"'
    if sensor.use is None:
        return "the sensor names no model, so that it has no electrical data"
    try:
        driver(sensor)
    except ValueError as error:
        return str(error)
    return ""


def ring_bus(electronics: Electronics, sensor: Sensor, count: int, radius: float) -> RingBus:
    """Return the best bus of a ring, or that with the fewest limits exceeded, whose ``fault`` says
    why no bus works.

    Args:
        electronics: how sensors are read; its bus is not ``own``.
        sensor: the sensors.
        count: number of sensors.
        radius: radius of the ring, m; 0 for a single sensor.

    Raises:
        ValueError: if no firmware reads the sensor.
    """
    e = electronics
    buses = ring_buses(driver(sensor), sensor, count, radius, e.board, e.bus, e.rate_hz)
    last = next(one for one in buses if one.wiring == buses[-1].wiring)
    return next((one for one in buses if not one.fault), last)


def readings_hz(
    electronics: Electronics, sensor: Sensor, count: int, radius: float
) -> float | None:
    """Return the readings of each sensor of a ring per second: those of its bus, or the model's
    highest rate where nothing limits it electrically; None if not known, or if no bus works.

    The arguments are those of ``ring_bus``.
    """
    if sensor.use is None:
        return None
    if unknown_reason(electronics, sensor):
        return model_of(sensor.use).rate_hz
    bus = ring_bus(electronics, sensor, count, radius)
    return None if bus.fault else bus.rate_hz


@lru_cache(maxsize=1024)
def most_on_ring(electronics: Electronics, sensor: Sensor, radius: float) -> int | None:
    """Return the largest number of sensors that a ring carries electrically; 0 if it carries none,
    None without electrical data.

    Args:
        electronics: how the sensors are read.
        sensor: the sensors.
        radius: radius of the ring, m.
    """
    if unknown_reason(electronics, sensor):
        return None
    counts = range(1, MOST_SENSORS + 1)  # each limit of a bus grows with the number of sensors
    return bisect(counts, 0.5, key=lambda n: bool(ring_bus(electronics, sensor, n, radius).fault))


def limit_text(electronics: Electronics, sensor: Sensor, radius: float, count: int) -> str:
    """Return why a ring carries no ``count`` sensors: what one more than the largest number
    exceeds, and what would do; empty if it carries them."""
    most = most_on_ring(electronics, sensor, radius)
    if most is None or count <= most or sensor.use is None:
        return ""
    name = model_of(sensor.use).name
    fault = ring_bus(electronics, sensor, most + 1, radius).fault
    advice = _advice(electronics, sensor, radius, count)
    advice += [f"rings of {most} (rules.sensors_per_ring)"] if most else []
    return (
        f"a ring carries at most {most} {name} ({most + 1}: {fault}), not {count}; what would do:"
        f' {", ".join(advice)}, or bus = "own" for electronics of your own'
    )


def _advice(electronics: Electronics, sensor: Sensor, radius: float, count: int) -> list[str]:
    """Return the modes of a sensor, and the rate and bus, with which a ring carries ``count``."""

    def most(e: Electronics, one: Sensor) -> int:
        return most_on_ring(e, one, radius) or 0

    modes = {mode: effective(Use(mode)).sensor for mode in driver(sensor).models}
    advice = [
        f"{mode} ({n} on a ring)"
        for mode, one in modes.items()
        if (n := most(electronics, one)) >= count
    ]
    rates = range((electronics.rate_hz or LEAST_HZ) - 1, LEAST_HZ - 1, -1)
    slower = (r for r in rates if most(replace(electronics, rate_hz=r), sensor) >= count)
    advice += [f"rate_hz = {rate}" for rate in [next(slower, None)] if rate is not None]
    if most(replace(electronics, bus="auto"), sensor) >= count:
        advice.append('bus = "auto"')
    return advice
