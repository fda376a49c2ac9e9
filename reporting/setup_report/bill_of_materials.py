"""Bill of materials of a setup: sensors with their power, prices, electronics, cables, parts of the
printed rings, and data rates.
"""

import math
from collections import Counter
from collections.abc import Callable

from ...coverage.rings.ring import Setup
from ...coverage.sensors.catalogue import model_of
from ...coverage.sensors.sensor import Sensor
from ...coverage.sensors.sensor_model import Supply
from ...formats.firmware.cabling import cable_run
from ...formats.firmware.controllers import DEFAULT_CONTROLLER, controller
from ...formats.firmware.wiring import RingWiring
from ...formats.schema.sensor_records import title
from ...objectives.scene import CoreScene
from ..pages import escaped, table
from ..text import counted
from .cable_section import bus_cable, wirings
from .directions import plain
from .printed_parts import DENSITY, printed_parts

UNKNOWN = "not known"


def _supply(sensor: Sensor) -> Supply | None:
    return None if sensor.use is None else model_of(sensor.use).supply


def rate_hz(sensor: Sensor) -> float | None:
    """Return the highest rate of readings in Hz, or None if its model states none."""
    return None if sensor.use is None else model_of(sensor.use).rate_hz


def distances(sensor: Sensor) -> int:
    """Return the number of distances in one reading, one for each zone."""
    if sensor.use is not None:
        model = model_of(sensor.use)
        return model.zones * model.rows
    return sensor.zones**2 if sensor.zoned else 1


def _power(count: int, sensor: Sensor) -> tuple[str, str]:
    supply = _supply(sensor)
    if supply is None:
        return UNKNOWN, UNKNOWN
    least = "at most " if supply.limit else ""
    return f"{least}{1000 * supply.power_w:.0f} mW", f"{least}{count * supply.power_w:.2f} W"


def _bought(scene: CoreScene, setup: Setup) -> list[str]:
    """Return a table of prices and their sum; without prices, how to state them."""
    prices, total = scene.prices, scene.price_of(setup)
    if prices is None or total is None:
        return ["The scene states no prices; add them as `[prices]` with `ring` and `sensor`.", ""]

    def text(amount: float) -> str:
        return escaped(prices.text(amount))

    rules = scene.rules
    new = Setup(
        tuple(ring for ring in setup.rings if ring not in rules.fixed),
        tuple(one for one in setup.singles if one not in rules.fixed_sensors),
    )
    rows = [
        (f"{n}", title(s), text(each), text(n * each))
        for s, n in _kinds(new).items()
        for each in (prices.of_sensor(s),)
    ]
    rings = len(new.rings)
    clamps = ("ring without its sensors", text(prices.ring), text(rings * prices.ring))
    rows = [*rows, (f"{rings}", *clamps), ("", "**total**", "", f"**{text(total)}**")]
    fixed = ["Fixed rings are already mounted and cost nothing."]
    return [
        table(("number", "part", "price of one", "price of all"), rows, right=(0, 2, 3)),
        *(fixed if rings < len(setup.rings) else []),
        "",
    ]


def _parts(scene: CoreScene, setup: Setup) -> list[str]:
    """Return a table of everything around the sensors: electronics, cables and printed rings."""
    board, parts = controller(DEFAULT_CONTROLLER), Counter[str]()
    planned, notes = wirings(setup)
    for wiring in planned:
        for number, name in () if wiring is None else wiring.parts:
            parts[name] += number
    rows = [("electronics", str(number), name) for name, number in parts.items()]
    if any(group.sensor.use is None for group in setup.groups):
        notes.append("A sensor without a model counts as a VL53L1X in the electronics.")
    rows += _cables(scene, setup, planned)
    printed = printed_parts(scene, setup)
    if printed.rings:
        rows += [("printed rings", str(n), name) for name, n in printed.hardware.items()]
        mass = f"filament (PETG, {DENSITY:g} g/cm³) for {counted(printed.rings, 'ring')}"
        mass += f" and {counted(printed.lids, 'lid')}" if printed.lids else ""
        rows.append(("printed rings", f"{printed.grams:.0f} g", f"{mass}, printed solid"))
        notes.append("With infill the rings need less filament.")
    if reasons := list(dict.fromkeys(printed.reasons)):
        without = "printed rings" if not printed.rings else counted(len(printed.reasons), "ring")
        notes.append(f"No printed parts are listed for {without}: {escaped('; '.join(reasons))}.")
    return [
        "Parts around the sensors, with one controller board for each ring; `place-rings export"
        " --to firmware` writes the firmware and the wiring, and `--board` takes another board"
        f" than the {board.title}. `place-rings export --to stl` writes the printed rings.",
        "",
        table(("for", "number", "part"), rows, right=(1,)),
        " ".join(notes),
        "",
    ]


def _cables(
    scene: CoreScene, setup: Setup, planned: list[RingWiring | None]
) -> list[tuple[str, str, str]]:
    """Return the rows of cables: USB cables by length, and the four-wire cable of all rings."""
    lengths = Counter(round(cable_run(scene, group).length, 1) for group in setup.groups)
    rows = [
        ("cables", str(n), f"USB cable, {metres:.1f} m, ring to base")
        for metres, n in sorted(lengths.items())
    ]
    bus = sum(bus_cable(wiring) for wiring in planned if wiring is not None)
    plugs = sum(
        2 * (wiring.count + len(wiring.channels)) for wiring in planned if wiring is not None
    )
    if bus:
        text = "four-wire cable for the buses of all rings (SDA, SCL, 3.3 V, GND)"
        rows.append(("cables", f"{math.ceil(10 * bus) / 10:.1f} m", text))
        rows.append(("cables", str(plugs), "plug of four poles, one at each end of a bus cable"))
    ties = 2 * sum(cable_run(scene, group).joints for group in setup.groups)
    return [*rows, ("cables", str(ties), "cable tie, two at each joint that a cable crosses")]


def _kinds(setup: Setup) -> Counter[Sensor]:
    """Return the number of sensors of each kind."""
    kinds = Counter[Sensor]()
    for group in setup.groups:
        kinds[group.sensor] += group.count
    return kinds


def materials(scene: CoreScene, setup: Setup, length: Callable[[int], int]) -> list[str]:
    """Return the bill of materials as lines of Markdown: kinds of sensors, prices, then rings and
    single sensors with their data.

    Args:
        scene: scene of the setup, with its prices.
        setup: setup to list.
        length: returns the bytes of a frame for a ring with a given number of sensors.
    """
    kinds = _kinds(setup)
    rows = [
        (
            str(n),
            title(s),
            f"{s.range_m:.2f}",
            *_power(n, s),
            UNKNOWN if (hz := rate_hz(s)) is None else f"{hz:g}",
        )
        for s, n in kinds.items()
    ]
    heads = ("sensors", "kind", "range, m", "power of one", "power of all", "rate, Hz")
    rings = [
        (str(i), plain(r.link), f"{r.count}", *_data(r.count, r.sensor, length))
        for i, r in enumerate(setup.groups)
    ]
    total = _total(setup, length)
    sources = {
        f"Power of the {model_of(s.use).title}: {found.source}."
        for s in kinds
        if s.use and (found := _supply(s))
    }
    return [
        table(heads, rows, right=(0, 2)),
        "Look up unknown powers and rates in the manufacturer's"
        " datasheet." + "".join(f" {line}" for line in sorted(sources)),
        "",
        *_bought(scene, setup),
        *_parts(scene, setup),
        table(
            (
                "ring",
                "link",
                "sensors",
                "distances per reading",
                "distances per second",
                "bytes per second",
            ),
            rings,
            right=(0, 2, 3, 4, 5),
        ),
        (
            f"All{' rings' if setup.rings else ''}{' and' * bool(setup.rings and setup.singles)}"
            f"{' single sensors' if setup.singles else ''} together send {total}. Bytes are those"
            " of the place-rings ring protocol: one frame for each of them and reading. For"
            " multi-zone sensors a frame holds the"
            " nearest distance of each sensor only."
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
    groups = setup.groups
    rates = [rate_hz(group.sensor) for group in groups]
    each = sum(group.count * distances(group.sensor) for group in groups)
    if None in rates:
        bytes_: float = sum(length(group.count) for group in groups)
        return (
            f"{each:,} distances in each reading, {bytes_:,} bytes; the rate of readings is unknown"
        )
    second = sum(
        hz * g.count * distances(g.sensor) for hz, g in zip(rates, groups, strict=True) if hz
    )
    bytes_ = sum(hz * length(g.count) for hz, g in zip(rates, groups, strict=True) if hz)
    return f"{second:,.0f} distances and {bytes_:,.0f} bytes per second"
