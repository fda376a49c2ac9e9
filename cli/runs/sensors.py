"""Print the sensor catalogue as a table."""

import json

from rich.table import Table

from ...coverage.sensors.catalogue import MODELS
from ...coverage.sensors.effective_range import effective
from ...coverage.sensors.sensor import Use
from ...coverage.sensors.sensor_model import Model
from ...formats.schema.sensor_records import SensorRecord
from ...reporting.explained import Explained
from ...reporting.terminal import Terminal, say, say_json


def _figures(model: Model) -> str:
    return ", ".join(
        f"{f.range_m:g}"
        f" ({f.light.label}{'' if f.reflectance >= 0.88 else f', {100 * f.reflectance:.3g} %'})"
        for f in model.figures
    )


def sensors(as_json: bool) -> None:
    """Print the catalogue."""
    if as_json:
        say_json(
            json.dumps(
                [
                    SensorRecord.from_domain(effective(Use(name))).model_dump(mode="json")
                    for name in MODELS
                ],
                indent=2,
            )
        )
        return
    table = Table()
    for column in ("sensor", "beam", "zones", "range, m", "least m", "Hz"):
        table.add_column(
            column,
            justify="right" if column in ("least m", "Hz") else "left",
            no_wrap=column == "sensor",
        )
    for m in MODELS.values():
        beam = f"{m.side_deg:.3g}° {'square' if m.square else 'cone'}"
        least, rate = ("–" if v is None else f"{v:g}" for v in (m.least_m, m.rate_hz))
        zones = "1" if m.zones == 1 else f"{m.zones}×{m.zones}"
        table.add_row(m.name, beam, zones, _figures(m), least, rate)
    console = Terminal()
    console.print(
        Explained(
            "Sensor catalogue",
            table,
            "beam: full angle, of a square beam from side to side; range: for a white target (88 %,"
            " of Benewake 90 %) that fills the beam, unless another reflectance is stated, in the"
            " light in brackets; least: shortest distance that is measured correctly; Hz:"
            " measurements per second. The sources follow.",
        )
    )
    for m in MODELS.values():
        note = f" ({m.note})" if m.note else ""
        console.print(f"{m.name}: {m.source}{note}", highlight=False, soft_wrap=True)
        if m.board is not None:
            size = " × ".join(
                f"{1000 * side:.4g}" for side in (m.board.width, m.board.height, m.board.thickness)
            )
            console.print(
                f"{m.name} on a board of {size} mm: {m.board.source}",
                highlight=False,
                soft_wrap=True,
            )
    say(
        "Below its least distance a sensor still answers, but the distance is wrong. The catalogue"
        " has no prices."
    )
