"""The sketch of a ring: its configuration, the files that all rings share, and how to wire it."""

import math
from collections.abc import Iterable
from functools import cache
from importlib.resources import files

from ...coverage.electronics.bus_load import CABLE_PF_M, MOST_MA, MOST_PF, RISE_NS
from ...coverage.electronics.ring_bus import CHANNELS, BusSegment
from .wiring import FEED_V, FIRST_MULTIPLEXER, RingWiring, address_pads, safe_name

_FOLDER = "place_rings_ring"
_SLOT_HEADER = "ring_slots.h"  # of rings that fire in slots
DRAWING = "wiring.png"


@cache
def _texts() -> dict[str, str]:
    """Return the files of the sketch by name: ``ring_*.h`` for all rings, ``sensor_*.h`` by driver,
    and the sketch itself."""
    folder = files(__package__) / _FOLDER
    return {file.name: file.read_text("utf-8") for file in folder.iterdir() if file.is_file()}


def config(wiring: RingWiring) -> str:
    """Return ``ring_config.h``: board, pins and bus of one ring."""
    board, number = wiring.controller, wiring.count
    lines = [
        f"// {safe_name(wiring.title)}: {number} × {wiring.driver.title} on the {board.title}.",
        "// Written by place-rings export; WIRING.md says how to wire it.",
        "#pragma once",
        "",
        "#include <Arduino.h>",
        "",
        f"#if !({board.guard})",
        f'#error "this sketch is for the {board.title}; choose that board, or export another"',
        "#endif",
        "",
        f"#define RING_MULTIPLEXERS {len(wiring.channels)}",
    ]
    if wiring.mode:
        lines.append(f"#define RING_DISTANCE_MODE {wiring.mode}")
    if wiring.driver.bytes_zone:
        zones, tangent = wiring.sensor.zones, math.tan(wiring.sensor.fov / 2)
        lines += [
            f"#define RING_ROWS {zones}",
            f"#define RING_COLUMNS {zones}",
            f"#define RING_TANGENT {tangent:.6f}f  // of half the field of view",
            f"#define RING_RANGING_HZ {wiring.rate_hz}",
        ]
    if (slots := wiring.slots) is not None:
        lines.append(f"#define RING_SLOTS {len(slots.starts_us)}")
        if slots.shared:
            lines.append(f"#define RING_LEADS {int(slots.leads)}  // raises the clock line")
    lines += [
        "",
        "namespace ring_config {",
        "",
        f"const uint8_t SDA_PIN = {board.sda}, SCL_PIN = {board.scl};",
        f"const uint32_t CLOCK_HZ = {wiring.bus.hertz};",
        "const uint8_t SENSOR_ADDRESS = 0x29;  // of every sensor after power-up",
        f"const uint8_t COUNT = {number};",
        f"const uint16_t PERIOD_MS = {wiring.period_ms};  // between frames",
    ]
    if wiring.channels:
        places = ", ".join(f"{{{m}, {c}}}" for m, c in wiring.places)
        lines += [
            f"const uint8_t FIRST_MULTIPLEXER = 0x{FIRST_MULTIPLEXER:02X};",
            f"const uint8_t RESET_PIN = {wiring.reset};",
            "struct Place {",
            "  uint8_t multiplexer, channel;",
            "};",
            f"const Place PLACES[COUNT] = {{{places}}};",
        ]
    else:
        lines.append(f"const uint8_t XSHUT[COUNT] = {_array(wiring.xshut)};  // in their order")
    return "\n".join([*lines, *_slots(wiring), "", "}  // namespace ring_config", ""])


def _array(numbers: Iterable[int]) -> str:
    return f"{{{', '.join(map(str, numbers))}}}"


def _slots(wiring: RingWiring) -> list[str]:
    """Return the lines of the configuration that say when each sensor may range."""
    if (slots := wiring.slots) is None:
        return []
    clock = [] if wiring.clock is None else [f"const uint8_t CLOCK_PIN = {wiring.clock};"]
    return [
        *clock,
        f"const uint32_t CYCLE_US = {slots.cycle_us}, SYNC_US = {slots.sync_us};",
        f"const uint32_t RANGING_MS = {slots.ranging_us // 1000};",
        "// Beginning of each slot from that of a cycle, latest start in it, and its end.",
        f"const uint32_t SLOT_US[RING_SLOTS] = {_array(slots.starts_us)};",
        f"const uint32_t LATEST_US[RING_SLOTS] = {_array(slots.latest_us)};",
        f"const uint32_t END_US[RING_SLOTS] = {_array(slots.ends_us)};",
        f"const uint8_t SLOT_OF[COUNT] = {_array(slots.slot)};  // of each sensor",
    ]


def sketch(wiring: RingWiring) -> dict[str, bytes]:
    """Return the files of a ring's sketch, by their paths below the output folder."""
    texts = {name: text for name, text in _texts().items() if wiring.slots or name != _SLOT_HEADER}
    texts = {
        f"{wiring.name}.ino": texts[f"{_FOLDER}.ino"],
        "ring_config.h": config(wiring),
        "ring_sensor.h": texts[f"sensor_{wiring.driver.name}.h"],
        **{name: texts[name] for name in sorted(texts) if name.startswith("ring_")},
        "WIRING.md": instructions(wiring),
    }
    return {f"{wiring.name}/{name}": text.encode() for name, text in texts.items()}


def instructions(wiring: RingWiring) -> str:
    """Return ``WIRING.md``: parts, wires, loads and the steps to the first frame."""
    board, sensor = wiring.controller, wiring.driver
    parts = [f"| {number} | {name} |" for number, name in wiring.parts]
    lines = [
        f"# {safe_name(wiring.title)}: {wiring.count} × {sensor.title}, {board.title}",
        "",
        f"![wiring]({DRAWING})",
        "",
        "Sensor 0 sits at the ring's phase; the others follow right-handed about the link's axis,"
        " which points from its proximal to its distal end.",
        "",
        *_assumption(wiring),
        "## Parts",
        "",
        *("| number | part |", "| ---: | --- |", *parts),
        "",
        "## Wires",
        "",
        *_wires(wiring),
        "",
        *_supply(wiring),
        "",
        *_when(wiring),
        "## Bus",
        "",
        *([f"Why multiplexers: {wiring.because}.", ""] if wiring.because else []),
        f"Clock {wiring.bus.hertz // 1000} kHz, busy for {100 * wiring.bus.busy:.0f} % of the time."
        f" {_rates(wiring)}"
        f" Limits by NXP's UM10204: {MOST_PF:.0f} pF, {MOST_MA:g} mA, rise"
        f" {RISE_NS[wiring.bus.hertz]:.0f} ns.",
        "",
        "| part | cable, m | load, pF | rise, ns | current, mA | pull-up to add |",
        "| --- | ---: | ---: | ---: | ---: | --- |",
        *map(_row, wiring.bus.segments),
        "",
        f"The cable counts {CABLE_PF_M:.0f} pF/m. Boards bring pull-ups of their own; these are"
        " included. Add pull-ups from SDA and from SCL to the sensors' supply.",
        "",
        "## Upload",
        "",
        f"1. Install the core: {board.core}.",
        f"2. Install the library {sensor.library}.",
        f"3. Open `{wiring.name}.ino`, choose the board, upload.",
        f"4. The frames arrive at {board.port} (460800 baud).",
        "",
        "## Pins that stay free",
        "",
        *("| pins | reason |", "| --- | --- |", *_free(wiring)),
        "",
    ]
    return "\n".join(lines)


def _assumption(wiring: RingWiring) -> list[str]:
    if not wiring.assumed:
        return []
    return [
        f"The scene's sensor names no model. This firmware is for the {wiring.driver.title}; name"
        " another with `--sensor` in the search, or `sensor` in the scene.",
        "",
    ]


def _rates(wiring: RingWiring) -> str:
    """Return how often the ring sends, and how often its sensors range."""
    each, size = "readings of every sensor a second", wiring.frame_bytes
    if wiring.slots is None:
        sent = wiring.rate_hz * size
        return f"{wiring.rate_hz} {each}, in frames of {size} bytes: {sent} bytes a second."
    frames = wiring.slots.frames * wiring.slots.rate_hz
    return (
        f"{wiring.slots.rate_hz:.3g} {each}, and {frames:.3g} frames of {size} bytes:"
        f" {frames * size:.0f} bytes a second; each frame has every sensor's latest reading."
    )


def _when(wiring: RingWiring) -> list[str]:
    """Return the section on the slots of a ring; nothing if all its sensors range at once."""
    if (slots := wiring.slots) is None:
        return []
    rows = [
        f"| {n} | {start / 1000:.1f} to {end / 1000:.1f} | {who or '–'} |"
        for n, (start, end) in enumerate(zip(slots.starts_us, slots.ends_us, strict=True))
        for who in [", ".join(str(i) for i, slot in enumerate(slots.slot) if slot == n)]
    ]
    clock = []
    if wiring.clock is not None:
        rings, pin = ", ".join(map(str, slots.rings)), wiring.controller.label(wiring.clock)
        part = (
            "This ring raises it at the beginning of each cycle."
            if slots.leads
            else f"Ring {slots.rings[0]} raises it; without it no sensor ranges, and all are sent"
            " as failed."
        )
        clock = [
            f"The rings {rings} keep in step by one wire: connect {pin} of this board with the pin"
            f" of the clock line of the others, and all their grounds. {part}",
            "",
        ]
    return [
        "## Slots",
        "",
        "No two sensors range at once that may disturb each other."
        f" A cycle has {slots.cycle_us / 1000:.1f} ms.",
        "",
        *clock,
        *("| slot | ms | sensors |", "| ---: | ---: | --- |", *rows),
        "",
    ]


def _wires(wiring: RingWiring) -> list[str]:
    board = wiring.controller
    bus = [
        f"| {board.label(board.sda)} | SDA |",
        f"| {board.label(board.scl)} | SCL |",
        "| GND | GND |",
    ]
    if wiring.clock is not None:
        bus.append(f"| {board.label(wiring.clock)} | the clock line of the other rings |")
    if wiring.reset is None:
        lines = [
            f"| {board.label(pin)} | {wiring.driver.enable} of sensor {i} ({angle:g}°) |"
            for i, (pin, angle) in enumerate(zip(wiring.xshut, wiring.angles_deg, strict=True))
        ]
        return [
            "All sensors share SDA and SCL; they are chained, plug to plug.",
            "",
            *("| pin | to |", "| --- | --- |", *bus, *lines),
        ]
    chips = [f"0x{FIRST_MULTIPLEXER + m:02X}" for m in range(len(wiring.channels))]
    rows = [
        f"| {i} | {angle:g}° | {chips[m]} | {c} |"
        for i, (angle, (m, c)) in enumerate(zip(wiring.angles_deg, wiring.places, strict=True))
    ]
    address = [f"| {chip} | {address_pads(m) or 'none'} |" for m, chip in enumerate(chips)]
    return [
        *("| pin | to |", "| --- | --- |", *bus),
        f"| {board.label(wiring.reset)} | RST of all multiplexers |",
        "",
        "Addresses of the multiplexers: bridge these pads to VIN.",
        "",
        *("| address | bridged |", "| --- | --- |", *address),
        "",
        f"Each sensor has a channel of its own, SD0 and SC0 to SD{CHANNELS - 1} and"
        f" SC{CHANNELS - 1}; its {wiring.driver.enable} stays open.",
        "",
        *("| sensor | at | multiplexer | channel |", "| ---: | ---: | --- | ---: |", *rows),
    ]


def _supply(wiring: RingWiring) -> list[str]:
    board = wiring.controller
    text = f"All sensors together draw up to {wiring.supply_ma:.0f} mA."
    if not wiring.own_supply:
        return [f"{text} Supply VIN of all boards from the controller's {board.supply} pin."]
    return [
        f"{text} The {board.supply} pin of the {board.title} has {board.spare_ma} mA to spare:"
        f" supply VIN of all boards from a step-down regulator, {FEED_V:g} V to 3.3 V,"
        f" {wiring.regulator_a} A, and connect its ground to the controller's. Do not connect it to"
        f" {board.supply}. POWER.md has the feed of all rings.",
        "",
        "Not 5 V: the boards pull the bus up to VIN, and the controller bears 3.3 V.",
    ]


def _row(segment: BusSegment) -> str:
    line = segment.line
    added = "" if segment.added is None else f"{segment.added / 1000:g} kΩ on SDA and SCL"
    return (
        f"| {segment.title} | {segment.cable_m:.2f} | {line.load_pf:.0f} | {line.rise_ns:.0f} |"
        f" {line.sink_ma:.1f} | {added} |"
    )


def _free(wiring: RingWiring) -> list[str]:
    """Return the pins that must stay free, grouped by their reason."""
    board = wiring.controller
    reasons = dict.fromkeys(board.excluded.values())
    return [
        f"| {', '.join(board.label(p) for p, why in board.excluded.items() if why == reason)} |"
        f" {reason} |"
        for reason in reasons
    ]
