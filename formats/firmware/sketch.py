"""The sketch of a ring: its configuration, the files that all rings share, and how to wire it."""

import math
from functools import cache
from importlib.resources import files

from ...coverage.electronics.bus_load import CABLE_PF_M, MOST_MA, MOST_PF, RISE_NS
from ...coverage.electronics.ring_bus import CHANNELS, BusSegment
from .wiring import FEED_V, FIRST_MULTIPLEXER, RingWiring, address_pads, safe_name

_FOLDER = "place_rings_ring"
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
        pins = ", ".join(map(str, wiring.xshut))
        lines.append(f"const uint8_t XSHUT[COUNT] = {{{pins}}};  // in the order of the sensors")
    return "\n".join([*lines, "", "}  // namespace ring_config", ""])


def sketch(wiring: RingWiring) -> dict[str, bytes]:
    """Return the files of a ring's sketch, by their paths below the output folder."""
    texts = _texts()
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
        "## Bus",
        "",
        *([f"Why multiplexers: {wiring.because}.", ""] if wiring.because else []),
        f"Clock {wiring.bus.hertz // 1000} kHz, busy for {100 * wiring.bus.busy:.0f} % of the time."
        f" {wiring.rate_hz} readings of every sensor a second, in frames of {wiring.frame_bytes}"
        f" bytes: {wiring.rate_hz * wiring.frame_bytes} bytes a second."
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


def _wires(wiring: RingWiring) -> list[str]:
    board = wiring.controller
    bus = [
        f"| {board.label(board.sda)} | SDA |",
        f"| {board.label(board.scl)} | SCL |",
        "| GND | GND |",
    ]
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
