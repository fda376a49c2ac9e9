"""What a setup is made of: sensors, what they cost and draw, and what they say in a second."""

from collections import Counter
from collections.abc import Callable

from ...coverage.rings.ring import Setup
from ...coverage.sensors.catalogue import MODELS, SUPPLIES, Supply
from ...coverage.sensors.sensor import Sensor
from ...formats.schema.sensor_records import title
from ..pages import table
from .directions import plain

UNKNOWN = "not known"


def _supply(sensor: Sensor) -> Supply | None:
    return None if sensor.use is None else SUPPLIES.get(sensor.use.model)


def rate_hz(sensor: Sensor) -> float | None:
    """The highest rate of readings, Hz, where the catalogue has one."""
    return None if sensor.use is None else MODELS[sensor.use.model].rate_hz


def distances(sensor: Sensor) -> int:
    """How many distances one reading has: one for each zone."""
    if sensor.use is not None:
        return MODELS[sensor.use.model].zones ** 2
    return sensor.zones**2 if sensor.zoned else 1


def _power(count: int, sensor: Sensor) -> tuple[str, str]:
    supply = _supply(sensor)
    if supply is None:
        return UNKNOWN, UNKNOWN
    least = "at most " if supply.limit else ""
    return f"{least}{1000 * supply.power_w:.0f} mW", f"{least}{count * supply.power_w:.2f} W"


def materials(setup: Setup, length: Callable[[int], int]) -> list[str]:
    """The bill of materials as lines of Markdown: kinds of sensors, then rings with what each
    sends; ``length``: bytes of a frame from a ring of so many sensors."""
    kinds = Counter({ring.sensor: 0 for ring in setup.rings})
    for ring in setup.rings:
        kinds[ring.sensor] += ring.count
    rows = [
        (
            str(n),
            title(s),
            f"{s.range_m:.2f}",
            UNKNOWN,
            *_power(n, s),
            UNKNOWN if (hz := rate_hz(s)) is None else f"{hz:g}",
        )
        for s, n in kinds.items()
    ]
    heads = ("sensors", "kind", "range, m", "price", "power of one", "of all", "rate, Hz")
    rings = [
        (str(i), plain(r.link), f"{r.count}", *_data(r.count, r.sensor, length))
        for i, r in enumerate(setup.rings)
    ]
    total = _total(setup, length)
    sources = {
        f"Power of the {MODELS[s.use.model].title}: {found.source}."
        for s in kinds
        if s.use and (found := _supply(s))
    }
    return [
        table(heads, rows, right=(0, 2)),
        "No price of a sensor is sourced; where power or a rate is not known, the maker's sheet"
        " has it." + "".join(f" {line}" for line in sorted(sources)),
        "",
        table(
            (
                "ring",
                "link",
                "sensors",
                "distances a reading",
                "distances a second",
                "bytes a second",
            ),
            rings,
            right=(0, 2, 3, 4, 5),
        ),
        (
            f"All rings together send {total}. Bytes are those of place-rings' ring protocol, a"
            " frame of each ring for each reading and, of sensors of many zones, the nearest"
            " distance of each sensor."
        ),
        "",
    ]


def _data(count: int, sensor: Sensor, length: Callable[[int], int]) -> tuple[str, str, str]:
    each, hz = count * distances(sensor), rate_hz(sensor)
    return (
        f"{each}",
        *(
            (UNKNOWN, UNKNOWN)
            if hz is None
            else (f"{each * hz:,.0f}", f"{length(count) * hz:,.0f}")
        ),
    )


def _total(setup: Setup, length: Callable[[int], int]) -> str:
    rates = [rate_hz(ring.sensor) for ring in setup.rings]
    each = sum(ring.count * distances(ring.sensor) for ring in setup.rings)
    if None in rates:
        bytes_: float = sum(length(ring.count) for ring in setup.rings)
        return (
            f"{each:,} distances with each reading, {bytes_:,} bytes; how many readings a second is"
            " not known"
        )
    second = sum(
        hz * r.count * distances(r.sensor) for hz, r in zip(rates, setup.rings, strict=True) if hz
    )
    bytes_ = sum(hz * length(r.count) for hz, r in zip(rates, setup.rings, strict=True) if hz)
    return f"{second:,.0f} distances and {bytes_:,.0f} bytes a second"
