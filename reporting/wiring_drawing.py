"""Drawing of a ring's wiring: the pins of its board, the bus with every sensor, and its loads.

One unit of the drawing is an inch; y points up. Lines are cables or single wires; no line passes
through a text.
"""

from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from ..coverage.electronics.bus_load import MOST_MA, MOST_PF, RISE_NS
from ..coverage.electronics.ring_bus import BusSegment
from ..formats.firmware.wiring import FIRST_MULTIPLEXER, RingWiring, address_pads
from .plots import COLOURS, GREY, GRID, INK
from .rendering.figures import png

_WIDE, _PITCH, _MARGIN = 14.0, 0.27, 0.35
_TITLE, _LINE = 0.75, 0.24  # height of the title, and of a line of text
_PINS_X = (1.65, 3.55)  # edges of the board
_PORTS_X = (5.35, 7.15)  # edges of the block of the controller's ports
_CHIPS_X = (8.35, 9.85)  # edges of the multiplexers
_SENSORS_X = (10.85, 13.15)  # edges of the sensors
_BUS_X = 13.5  # of the bus beside chained sensors
_GAP = 0.45  # between multiplexers
_BUS, _SINGLE, _SUPPLY = COLOURS[0], COLOURS[1], COLOURS[3]
_COLUMNS = (5.35, 7.55, 8.75, 9.85, 10.85, 12.0)  # of the table
_HEADS = ("one line of the", "cable", "load", "rise", "current", "pull-ups to add")
_LEAST_ROWS = 7  # of the bus, for the ports


@dataclass
class _Sheet:
    """Axes in inches, with the few marks that the drawing needs."""

    ax: Any

    def text(self, x: float, y: float, text: str, **given: Any) -> None:
        style: dict[str, Any] = {
            "ha": "left",
            "va": "center",
            "fontsize": 8.5,
            "color": INK,
        } | given
        self.ax.text(x, y, text, **style)

    def box(self, xs: tuple[float, float], ys: tuple[float, float], **given: Any) -> None:

        style: dict[str, Any] = {"fc": "white", "ec": INK, "lw": 1.0} | given
        (left, right), (low, high) = xs, ys
        self.ax.add_patch(Rectangle((left, low), right - left, high - low, **style))

    def line(self, *points: tuple[float, float], colour: str = _BUS, wide: float = 3.0) -> None:
        xs, ys = zip(*points, strict=True)
        self.ax.plot(xs, ys, color=colour, lw=wide, solid_capstyle="butt", zorder=0.5)


def wiring_drawing(wiring: RingWiring) -> bytes:
    """Return a PNG of a ring's wiring."""
    return png(wiring_figure(wiring))


def wiring_figure(wiring: RingWiring) -> Figure:
    """Return the drawing of a ring's wiring."""
    board = wiring.controller
    rows = max(len(board.left), len(board.right))
    left = rows * _PITCH + _LINE * (2.2 + len(wiring.parts))
    right = _bus_height(wiring) + _LINE * (3.4 + len(wiring.bus.segments) + 2)
    high = _TITLE + max(left, right) + 2 * _MARGIN
    figure = Figure(figsize=(_WIDE, high), dpi=110, facecolor="white")
    ax = figure.add_axes((0, 0, 1, 1))
    ax.set(xlim=(0, _WIDE), ylim=(0, high))
    ax.axis("off")
    sheet, top = _Sheet(ax), high - _MARGIN - _TITLE
    title = f"{wiring.title}: {wiring.count} × {wiring.driver.title} on the {board.title}"
    sheet.text(_MARGIN, high - _MARGIN - 0.12, title, fontsize=13)
    _pins(sheet, wiring, top)
    _parts(sheet, wiring, top - rows * _PITCH - 0.5 * _LINE)
    low = (_multiplexed if wiring.channels else _direct)(sheet, wiring, top)
    _table(sheet, wiring, low - 1.2 * _LINE)
    return figure


def _bus_height(wiring: RingWiring) -> float:
    gaps = _GAP * max(len(wiring.channels) - 1, 0)
    return _PITCH * max(wiring.count + (0 if wiring.channels else 2), _LEAST_ROWS) + gaps


def _purposes(wiring: RingWiring) -> dict[int | str, tuple[str, str]]:
    """Return what each pin of the board in use is for, and its colour."""
    board = wiring.controller
    uses: dict[int | str, tuple[str, str]] = {board.sda: ("SDA", _BUS), board.scl: ("SCL", _BUS)}
    uses |= {pin: (f"XSHUT {i}", _SINGLE) for i, pin in enumerate(wiring.xshut)}
    if wiring.reset is not None:
        uses[wiring.reset] = ("RST", _SINGLE)
    if wiring.clock is not None:
        uses[wiring.clock] = ("clock", _SINGLE)
    if not wiring.own_supply:
        uses[board.supply] = ("supply", _BUS)
    uses["GND"] = ("ground", _BUS)
    return uses


def _pins(sheet: _Sheet, wiring: RingWiring, top: float) -> None:
    """Draw the board with both headers: pins in use with their purpose, those that must stay free
    in grey. Of several pins for supply or ground, one is enough."""
    board, uses = wiring.controller, _purposes(wiring)
    rows = max(len(board.left), len(board.right))
    sheet.box(_PINS_X, (top - rows * _PITCH, top), fc="#f4f6f8")
    sheet.text(
        sum(_PINS_X) / 2,
        top + 0.14,
        "USB at the lower end; pale pins stay free",
        ha="center",
        color=GREY,
    )
    for column, (header, side) in enumerate(((board.left, 1), (board.right, -1))):
        edge = _PINS_X[column]
        for row, pin in enumerate(header):
            y = top - (row + 0.5) * _PITCH
            use, colour = uses.get(pin, ("", GREY))
            name = board.label(pin) if isinstance(pin, int) else pin
            taken = pin in board.excluded
            sheet.box((edge - 0.06, edge + 0.06), (y - 0.06, y + 0.06), fc=colour if use else GRID)
            sheet.text(
                edge + 0.14 * side,
                y,
                name,
                ha="left" if side > 0 else "right",
                color=INK if use else GREY,
                alpha=0.55 if taken else 1.0,
            )
            if use:
                end = "right" if side > 0 else "left"
                sheet.text(edge - 0.14 * side, y, use, ha=end, color=colour)
                if isinstance(pin, str):
                    uses.pop(pin)


def _parts(sheet: _Sheet, wiring: RingWiring, top: float) -> None:
    sheet.text(_MARGIN, top - 0.5 * _LINE, "Parts", fontsize=10)
    for row, (number, name) in enumerate(wiring.parts):
        y = top - (row + 1.6) * _LINE
        sheet.text(_MARGIN + 0.25, y, f"{number}", ha="right")
        sheet.text(_MARGIN + 0.35, y, name)


def _sensor(sheet: _Sheet, wiring: RingWiring, number: int, y: float) -> None:
    sheet.box(_SENSORS_X, (y - 0.11, y + 0.11))
    sheet.text(_SENSORS_X[0] + 0.12, y, f"sensor {number}")
    sheet.text(_SENSORS_X[1] - 0.12, y, f"{wiring.angles_deg[number]:g}°", ha="right", color=GREY)


def _cable_name(wiring: RingWiring) -> str:
    board = wiring.controller
    supply = [] if wiring.own_supply else [board.supply]
    return ", ".join([*supply, "GND", board.label(board.sda), board.label(board.scl)])


def _block(sheet: _Sheet, wiring: RingWiring, ys: tuple[float, float]) -> None:
    sheet.box(_PORTS_X, ys, fc="#f4f6f8")
    sheet.text(_PORTS_X[0], ys[1] + 0.14, "controller", color=GREY)


def _port(sheet: _Sheet, y: float, name: str) -> None:
    sheet.text(_PORTS_X[1] - 0.1, y, name, ha="right", fontsize=8)


def _multiplexed(sheet: _Sheet, wiring: RingWiring, top: float) -> float:
    """Draw controller, multiplexers from top to bottom, and each channel's sensor; return the lower
    end."""
    heights = [max(used, _LEAST_ROWS - 1 if not m else 1) for m, used in enumerate(wiring.channels)]
    y, number = top, 0
    for m, (used, rows) in enumerate(zip(wiring.channels, heights, strict=True)):
        low = y - rows * _PITCH
        sheet.box(_CHIPS_X, (low, y))
        chip = sum(_CHIPS_X) / 2 - 0.2
        sheet.text(chip, (y + low) / 2 + 0.13, "TCA9548A", ha="center", fontsize=9)
        sheet.text(chip, (y + low) / 2 - 0.13, f"0x{FIRST_MULTIPLEXER + m:02X}", ha="center")
        if pads := address_pads(m):
            sheet.text(chip, (y + low) / 2 - 0.36, f"bridge {pads}", ha="center", color=GREY)
        for channel in range(used):
            at = y - (channel + 0.5) * _PITCH
            sheet.line((_CHIPS_X[1], at), (_SENSORS_X[0], at), wide=2.2)
            sheet.text(_CHIPS_X[1] - 0.08, at, f"ch {channel}", ha="right", fontsize=8)
            _sensor(sheet, wiring, number, at)
            number += 1
        if m + 1 < len(wiring.channels):
            for x, colour, wide in ((0.45, _BUS, 3.0), (0.75, _SINGLE, 1.3)):
                ends = (_CHIPS_X[0] + x, low), (_CHIPS_X[0] + x, low - _GAP)
                sheet.line(*ends, colour=colour, wide=wide)
        y = low - _GAP
    _feed(sheet, wiring, top)
    return y + _GAP


def _feed(sheet: _Sheet, wiring: RingWiring, top: float) -> None:
    """Draw the controller's ports, and the supply, with their lines to the first multiplexer."""
    assert wiring.reset is not None
    _block(sheet, wiring, (top - 2.6 * _PITCH, top))
    rows = [
        (0.8, _cable_name(wiring), _BUS, 3.0),
        (1.8, wiring.controller.label(wiring.reset), _SINGLE, 1.3),
    ]
    for row, name, colour, wide in rows:
        at = top - row * _PITCH
        sheet.line((_PORTS_X[1], at), (_CHIPS_X[0], at), colour=colour, wide=wide)
        _port(sheet, at, name)
        sheet.text(_CHIPS_X[0] + 0.08, at, "bus" if colour == _BUS else "RST", fontsize=8)
    if wiring.own_supply:
        ys = (top - 5.6 * _PITCH, top - 4.2 * _PITCH)
        sheet.box(_PORTS_X, ys, fc="#f4f6f8")
        at = sum(ys) / 2
        sheet.line((_PORTS_X[1], at), (_CHIPS_X[0], at), colour=_SUPPLY, wide=3.0)
        _port(sheet, at, "3.3 V regulator, GND")
        sheet.text(_CHIPS_X[0] + 0.08, at, "VIN", fontsize=8)


def _direct(sheet: _Sheet, wiring: RingWiring, top: float) -> float:
    """Draw controller and sensors, with a line for each XSHUT, and the bus from sensor to sensor;
    return the lower end."""
    first = top - 1.9 * _PITCH
    low = first - (wiring.count - 0.5) * _PITCH
    _block(sheet, wiring, (low - 0.1, top))
    bus = top - 0.6 * _PITCH
    _port(sheet, bus, _cable_name(wiring))
    ys = [first - i * _PITCH for i in range(wiring.count)]
    sheet.line((_PORTS_X[1], bus), (_BUS_X, bus), (_BUS_X, ys[-1]), (_SENSORS_X[1], ys[-1]))
    for number, (y, pin) in enumerate(zip(ys, wiring.xshut, strict=True)):
        _port(sheet, y, wiring.controller.label(pin))
        sheet.line((_PORTS_X[1], y), (_SENSORS_X[0], y), colour=_SINGLE, wide=1.3)
        _sensor(sheet, wiring, number, y)
        if number + 1 < wiring.count:
            sheet.line((_BUS_X, y), (_SENSORS_X[1], y))
    return low - 0.1


def _cells(segment: BusSegment) -> tuple[str, ...]:
    line = segment.line
    ohm = "" if segment.added is None else f"2 × {segment.added / 1000:g} kΩ"
    added = f"{ohm} each" if ohm and segment.title.startswith("channel") else ohm
    return (
        segment.title,
        f"{segment.cable_m:.2f} m",
        f"{line.load_pf:.0f} pF",
        f"{line.rise_ns:.0f} ns",
        f"{line.sink_ma:.1f} mA",
        added,
    )


def _table(sheet: _Sheet, wiring: RingWiring, top: float) -> None:
    """Write what each line of the bus bears, the limits, and what the lines mean."""
    limits = ("limit", "", f"{MOST_PF:.0f} pF", f"{RISE_NS[wiring.bus.hertz]:.0f} ns")
    rows = [_HEADS, *map(_cells, wiring.bus.segments), (*limits, f"{MOST_MA:g} mA", "")]
    for number, row in enumerate(rows):
        y = top - number * _LINE
        colour = GREY if row is rows[0] or row is rows[-1] else INK
        for x, cell in zip(_COLUMNS, row, strict=True):
            sheet.text(x, y, cell, color=colour)
    single = "RST" if wiring.channels else "XSHUT"
    wires = "SDA, SCL, GND" if wiring.own_supply else "SDA, SCL, 3V3, GND"
    names = [(f"cable: {wires}", _BUS, 3.0), (f"wire: {single}", _SINGLE, 1.3)]
    if wiring.channels:
        names[0] = ("cable: SDA, SCL, VIN, GND", _BUS, 3.0)
    if wiring.own_supply:
        names.append(("supply: VIN, GND", _SUPPLY, 3.0))
    y = top - (len(rows) + 0.3) * _LINE
    for x, (name, colour, wide) in zip((5.35, 8.35, 10.35), names, strict=False):
        sheet.line((x, y), (x + 0.35, y), colour=colour, wide=wide)
        sheet.text(x + 0.45, y, name)
