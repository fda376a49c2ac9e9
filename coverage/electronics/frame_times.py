"""How long the sensors of a ring take for one frame: ranging, transfer on the bus, and start-up."""

from ..definitions.definition import definition
from ..sensors.sensor import Sensor
from .drivers import driver
from .electronics import Electronics, readings_hz, ring_bus, unknown_reason
from .ring_bus import transfer_s

ASSUMED_HZ = 20.0
"""Rate of a sensor of which no source states one; our assumption."""


@definition(kw_only=True)
class FrameTimes:
    """Times of each sensor of a ring, and the ring's rate if it waits for no other ring."""

    ranging_s: float
    """Time in which a sensor fires and measures, s: the shortest period of its mode."""
    transfer_s: float | None = None
    """Time of its transfer on the ring's bus, s; none if no driver states its bytes."""
    start_s: float | None = None
    """Time in which the ring's sensors receive their firmware, one after the other, s; none if its
    size is not known."""
    free_hz: float
    """Rate of the ring if all its sensors may fire at once, Hz: that of its bus, and where that
    exceeds a limit, what ranging and transfer leave."""
    assumed: bool = False
    """Whether the rate is assumed, as no source states one."""
    fault: str = ""
    """Limit that the ring's bus exceeds."""


def frame_times(electronics: Electronics, sensor: Sensor, count: int, radius: float) -> FrameTimes:
    """Return the times of a ring's sensors; the arguments are those of ``ring_bus``."""
    stated = readings_hz(electronics, sensor, count, radius)
    if unknown_reason(electronics, sensor):
        rate = stated or ASSUMED_HZ
        return FrameTimes(ranging_s=1 / rate, free_hz=rate, assumed=stated is None)
    reader, bus = driver(sensor), ring_bus(electronics, sensor, count, radius)
    ranging, firmware = reader.shortest_s(sensor), reader.firmware_bytes
    transfer = transfer_s(reader.bytes_of(sensor), bus.hertz)
    return FrameTimes(
        ranging_s=ranging,
        transfer_s=transfer,
        start_s=None if firmware is None else count * transfer_s(firmware, bus.hertz),
        free_hz=stated or 1 / max(ranging, count * transfer),
        fault=bus.fault,
    )
