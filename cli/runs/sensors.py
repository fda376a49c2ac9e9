"""Print the sensor catalogue, or a sensor file, as a table."""

from collections.abc import Iterator
from pathlib import Path

from rich.padding import Padding
from rich.table import Table

from ...coverage.definitions.definition import json_of
from ...coverage.definitions.errors import UserError
from ...coverage.detection.detected_range import SHARES, detected_range
from ...coverage.detection.detection import STATED_RATE, Detection
from ...coverage.rings.sensor_records import SensorRecord
from ...coverage.sensors.boards import Board
from ...coverage.sensors.catalogue import MODELS
from ...coverage.sensors.effective_range import Use
from ...coverage.sensors.sensor import effective
from ...coverage.sensors.sensor_model import Model
from ...reporting.explained import Explained
from ...reporting.terminal import Terminal, say_json

_LEGEND = (
    "beam: full angle of a cone, or sides of a square beam; range: for a white target (88 %, of"
    " Benewake 90 %) that fills the beam, unless another reflectance is stated, in the light in"
    " brackets; least: shortest distance that is measured correctly; Hz: measurements per second;"
    " targets: most that one zone reports. –: not stated. The sources follow."
)
_COLUMNS = tuple(f"{100 * share:g} % of frames" for share in SHARES)
_DETECTED = (
    "distance in m along the axis up to which at least that share of frames report the piece, in"
    " the middle of a zone and all of it in view; last: up to which it is detected in time with at"
    " least 90 %. 0: nowhere. –: no source states a range in such light. The share of frames at the"
    f" stated range is an assumption, {100 * STATED_RATE:g} %, where no source states it. Below the"
    " table of a single sensor stand its figures, each with its mark."
)


def uses_of(sensor: str | None) -> list[Use]:
    """Return a sensor of the catalogue or of a file, or all of the catalogue.

    Raises:
        UserError: if there is no such sensor, or the file is not valid.
    """
    if sensor is None:
        return [Use(name) for name in MODELS]
    if sensor in MODELS:
        return [Use(sensor)]
    if not sensor.lower().endswith(".toml"):
        raise UserError(f"found {sensor}, allowed: {', '.join(MODELS)}, or a sensor file (.toml)")
    from ...formats.model_reader import read_sensor

    return [Use(read_sensor(Path(sensor)))]


def sensors(uses: list[Use], as_json: bool, whole: bool) -> None:
    """Print the figures of sensors; ``whole``: of the catalogue."""
    found = [effective(use) for use in uses]
    if as_json:
        say_json(json_of([SensorRecord.of(sensor) for sensor in found]))
        return
    models = [each.model for each in found]
    console = Terminal()
    title = "Sensor catalogue" if whole else "Sensor"
    console.print(Explained(title, _table(models), _LEGEND))
    first: dict[Board, str] = {}  # the model that a board was described for
    for m in models:
        console.print(f"{m.name}: {m.title}", highlight=False)
        for line in (*_details(m), *_board(m, first)):
            console.print(Padding(line, (0, 0, 0, 2), expand=False), highlight=False)
    console.print(
        "Below its least distance a sensor may still answer, with a distance that is wrong."
        + " The catalogue has no prices, because no dated offer is known." * whole,
        highlight=False,
    )


def detected(uses: list[Use], detection: Detection, as_json: bool) -> None:
    """Print how far sensors detect a test piece, and what that rests on."""
    records = [detected_range(effective(use).sensor, detection) for use in uses]
    if as_json:
        say_json(json_of(records))
        return
    piece = detection.piece
    title = (
        f"Detection of {piece.name}, {piece.width_m:g} × {piece.height_m:g} m,"
        f" {100 * detection.rho:.3g} % reflectance, in {detection.ambient or 'the weakest light'}"
    )
    table = Table()
    for column in ("sensor", *_COLUMNS, f"in {detection.seconds:g} s"):
        table.add_column(column, justify="left" if column == "sensor" else "right")
    for record in records:
        values = [f"{d.frame_m:.2f}" for d in record.distances] or ["–"] * len(_COLUMNS)
        values.append(f"{record.distances[1].in_time_m:.2f}" if record.distances else "–")
        table.add_row(record.sensor, *values)
    console = Terminal()
    console.print(Explained(title, table, _DETECTED))
    for record in records if len(records) == 1 else ():
        for b in record.basis:
            value = "" if b.value is None else f" {b.value:.4g} {b.unit}".rstrip()
            console.lines(f"{b.figure}:{value} ({b.mark}: {b.source})")
    for reason in dict.fromkeys(record.refused for record in records if record.refused):
        console.lines(reason)


def _table(models: list[Model]) -> Table:
    table = Table()
    for column in ("sensor", "beam", "zones", "range, m", "least", "Hz", "targets"):
        numbers = column in ("least", "Hz", "targets")
        table.add_column(
            column, justify="right" if numbers else "left", no_wrap=column in ("sensor", "beam")
        )
    for m in models:
        beam = "×".join(f"{side:.3g}°" for side in m.sides_deg[: 2 if m.square else 1])
        zones = "1" if m.zones * m.rows == 1 else f"{m.zones}×{m.rows}"
        rest = ("–" if v is None else f"{v:g}" for v in (m.least_m, m.rate_hz, m.targets))
        table.add_row(m.name, beam, zones, _figures(m), *rest)
    return table


def _figures(model: Model) -> str:
    return ", ".join(
        f"{f.range_m:g}"
        f" ({f.ambient}{'' if f.reflectance >= 0.88 else f', {100 * f.reflectance:.3g} %'})"
        for f in model.ranges
    )


def _details(m: Model) -> Iterator[str]:
    """Yield the lines about a model below the table."""
    yield f"source: {m.source}{f' ({m.note})' if m.note else ''}"
    if m.square:
        yield f"beam: {m.definition}"
    if m.separation_m is not None:
        yield f"targets: at least {m.separation_m:g} m apart"
    if m.histogram is not None:
        yield f"raw histogram: {'yes' if m.histogram else 'no'}"
    if m.wavelength_nm is not None:
        yield f"wavelength: {m.wavelength_nm:g} nm"
    if m.safety:
        yield f"safety rating: {m.safety}"
    if m.life_cycle:
        yield f"life cycle: {m.life_cycle}"
    if m.supply is not None:
        most = "at most " if m.supply.limit else ""
        yield f"power: {most}{m.supply.power_w:g} W ({m.supply.source})"
    if m.price is not None:
        price = m.price
        yield f"price: {price.amount:g} {price.currency} on {price.date} ({price.source})"


def _board(m: Model, first: dict[Board, str]) -> Iterator[str]:
    """Yield the line about a model's board; ``first`` names the model that it stands at."""
    if m.board is None:
        return
    if m.board in first:
        yield f"board: that of {first[m.board]}"
        return
    first[m.board] = m.name
    sizes = (m.board.width, m.board.height, m.board.thickness)
    size = " × ".join(f"{1000 * side:.4g}" for side in sizes)
    yield f"board of {size} mm: {m.board.source}"
