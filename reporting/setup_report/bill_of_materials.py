"""Bill of materials of a setup: sensors with their power, prices, electronics, cables, parts of the
printed rings, and data rates.
"""

import math
from collections import Counter
from dataclasses import dataclass, field

from ...coverage.electronics.drivers import supply_of
from ...coverage.electronics.electronics import readings_hz
from ...coverage.rings.ring import Group, Setup
from ...coverage.rings.sensor_records import title
from ...coverage.sensors.effective_range import model_of
from ...coverage.sensors.sensor import Sensor
from ...formats.firmware.cabling import cable_run
from ...formats.firmware.wiring import FEED_V, RingWiring
from ...formats.printing.bolts import fasteners
from ...formats.printing.payload import PLASTIC
from ...formats.printing.print_checks import read_stl
from ...formats.printing.print_files import board_screws, print_ring
from ...formats.printing.print_plan import MM, UnbuildableError
from ...formats.ring_frame import MOST_ZONES, Grid, frame_length
from ...objectives.scene import Scene
from ..pages import escaped, table
from ..text import counted
from .cable_section import arm_power, bus_cable, wirings
from .directions import plain

UNKNOWN = "not known"


def distances(sensor: Sensor) -> int:
    """Return the number of distances in one reading, one for each zone."""
    if sensor.use is not None:
        model = model_of(sensor.use)
        return model.zones * model.rows
    return sensor.zones**2 if sensor.zoned else 1


def _power(count: int, sensor: Sensor) -> tuple[str, str]:
    supply = supply_of(sensor)
    if supply is None:
        return UNKNOWN, UNKNOWN
    least = "at most " if supply.limit else ""
    return f"{least}{1000 * supply.power_w:.0f} mW", f"{least}{count * supply.power_w:.2f} W"


def _bought(scene: Scene, setup: Setup) -> list[str]:
    """Return a table of prices and their sum; without prices, how to state them."""
    prices, price = scene.prices, scene.price_of(setup)
    if prices is None or price is None:
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
    rows = [*rows, (f"{rings}", *clamps), ("", "**total**", "", f"**{text(price.total)}**")]
    fixed = ["Fixed rings are already mounted and cost nothing."]
    return [
        table(("number", "part", "price of one", "price of all"), rows, right=(0, 2, 3)),
        *(fixed if rings < len(setup.rings) else []),
        "",
    ]


def _parts(scene: Scene, setup: Setup) -> list[str]:
    """Return a table of everything around the sensors: electronics, cables and printed rings."""
    board, parts = scene.electronics.board, Counter[str]()
    planned, notes = wirings(scene, setup)
    for wiring in planned:
        for number, name in () if wiring is None else wiring.parts:
            parts[name] += number
    rows = [("electronics", str(number), name) for name, number in parts.items()]
    rows += _feed(scene, setup)
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


def _feed(scene: Scene, setup: Setup) -> list[tuple[str, str, str]]:
    """Return the rows of the feed of all rings, if they have one."""
    plan = arm_power(scene, setup)
    if plan is None or plan.supply_a is None or plan.awg is None:
        return []
    return [
        ("feed", "1", f"supply {FEED_V:g} V, {plan.supply_a:g} A"),
        ("feed", f"{plan.feed_m:.1f} m", f"two-wire cable, AWG {plan.awg}, along the arm"),
    ]


def _cables(
    scene: Scene, setup: Setup, planned: list[RingWiring | None]
) -> list[tuple[str, str, str]]:
    """Return the rows of cables: USB cables by length, and the four-wire cable of all rings."""
    runs = [cable_run(scene, group).length for group in setup.groups]
    lengths = Counter(math.ceil(2 * run - 1e-9) / 2 for run in runs)
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


def materials(scene: Scene, setup: Setup) -> list[str]:
    """Return the bill of materials as lines of Markdown: kinds of sensors, prices, then rings and
    single sensors with their data.

    Args:
        scene: scene of the setup, with its prices.
        setup: setup to list.
    """
    kinds, (wired, _) = _kinds(setup), wirings(scene, setup)
    rows = [
        (
            str(n),
            title(s),
            f"{s.range_m:.2f}",
            *_power(n, s),
        )
        for s, n in kinds.items()
    ]
    heads = ("sensors", "kind", "range, m", "power of one", "power of all")
    rings = [
        (str(i), plain(r.link), f"{r.count}", *_data(scene, r, w))
        for i, (r, w) in enumerate(zip(setup.groups, wired, strict=True))
    ]
    total = _total(scene, setup, wired)
    sources = {
        f"Power of the {model_of(s.use).title}: {found.source}."
        for s in kinds
        if s.use and (found := supply_of(s))
    }
    return [
        table(heads, rows, right=(0, 2)),
        "Look up unknown powers in the manufacturer's"
        " datasheet." + "".join(f" {line}" for line in sorted(sources)),
        "",
        *_bought(scene, setup),
        *_parts(scene, setup),
        table(
            (
                "ring",
                "link",
                "sensors",
                "rate, Hz",
                "distances per reading",
                "distances per second",
                "bytes per second",
            ),
            rings,
            right=(0, 2, 3, 4, 5, 6),
        ),
        (
            f"All{' rings' if setup.rings else ''}{' and' * bool(setup.rings and setup.singles)}"
            f"{' single sensors' if setup.singles else ''} together send {total}. Bytes are those"
            " of the place-rings ring protocol, one frame for each of them and reading, which holds"
            " each zone; rates are those of the wiring."
        ),
        "",
    ]


def _sent(scene: Scene, group: Group, wiring: RingWiring | None) -> tuple[int | float | None, int]:
    """Return the rate of a ring in Hz, None if it is not known, and the bytes of its frames."""
    if wiring is not None:
        return wiring.rate_hz, wiring.frame_bytes
    hz = readings_hz(scene.electronics, group.sensor, group.count, group.radius)
    zones = distances(group.sensor)
    grid = Grid(1, zones) if 1 < zones <= MOST_ZONES else None
    return hz, frame_length(group.count, grid)


def _data(scene: Scene, group: Group, wiring: RingWiring | None) -> tuple[str, ...]:
    each, (hz, bytes_) = group.count * distances(group.sensor), _sent(scene, group, wiring)
    if hz is None:
        return UNKNOWN, f"{each}", UNKNOWN, UNKNOWN
    return f"{hz:g}", f"{each}", f"{each * hz:,.0f}", f"{bytes_ * hz:,.0f}"


def _total(scene: Scene, setup: Setup, wired: list[RingWiring | None]) -> str:
    sent = [_sent(scene, group, one) for group, one in zip(setup.groups, wired, strict=True)]
    each = [group.count * distances(group.sensor) for group in setup.groups]
    rates = [hz for hz, _ in sent if hz is not None]
    if len(rates) < len(sent):
        return f"{sum(each):,} distances in each reading; the rate of readings is unknown"
    second = sum(n * hz for n, hz in zip(each, rates, strict=True))
    bytes_ = sum(n * hz for (_, n), hz in zip(sent, rates, strict=True))
    return f"{second:,.0f} distances and {bytes_:,.0f} bytes per second"


DENSITY = PLASTIC / 1000  # g/cm³


@dataclass
class PrintedParts:
    """Parts of all printed rings of a setup."""

    hardware: Counter[str] = field(default_factory=Counter)
    """Number of bolts and screws by their text."""
    grams: float = 0.0
    """Mass of the rings and lids if they are printed solid, g."""
    lids: int = 0
    """Number of lids of the rings' boards."""
    rings: int = 0
    """Number of rings that can be printed."""
    reasons: list[str] = field(default_factory=list)
    """Why each other ring cannot be printed."""


def printed_parts(scene: Scene, setup: Setup) -> PrintedParts:
    """Return the parts of all rings of a setup that can be printed."""
    parts = PrintedParts()
    for number, ring in enumerate(setup.rings):
        try:
            record, files, plan, _ = print_ring(scene, number, ring)
        except UnbuildableError as error:
            parts.reasons.append(str(error))
            continue
        volumes = [float(read_stl(file).volume) for file in files]
        if record.lids:  # whose file is the last
            volumes[-1] *= record.lids.copies
            parts.lids += record.lids.copies
        parts.grams += DENSITY * sum(volumes) / MM
        parts.rings += 1
        for kind in fasteners(plan):
            parts.hardware[f"{kind} (to close the rings)"] += len(plan.joints)
        if screws := board_screws(plan):
            held = "boards and lids" if record.lids else "boards"
            parts.hardware[f"{screws[1]} (for the {held})"] += screws[0]
    return parts
