"""Sensors on the command line: what their options mean, the catalogue as a table, how a range came
about.
"""

import json
from dataclasses import replace

from rich.table import Table

from ..coverage.sensors.catalogue import MODELS, Model
from ..coverage.sensors.effective_range import effective, size_of
from ..coverage.sensors.sensor import Sensor, Use
from ..formats.errors import UserError
from ..formats.schema.sensor_records import SensorRecord
from ..reporting.terminal import Terminal, say, say_json


def resolve_sensor(
    name: str | None,
    ambient: str | None,
    reflectance: float | None,
    size: str | None,
    own: Sensor | None = None,
) -> Sensor | None:
    """What ``--sensor`` and what goes with it mean; None where nothing is asked. The others alone
    are about ``own``, the scene's sensor, if that is one of the catalogue."""
    given = {"--ambient": ambient, "--reflectance": reflectance, "--target-size": size}
    asked = {option: value for option, value in given.items() if value is not None}
    if name is None and not asked:
        return None
    base = own.use if name is None and own is not None else None
    if name is None and base is None:
        option, value = next(iter(asked.items()))
        raise UserError(
            f"{option}: found {value}, allowed: only with --sensor, or a scene whose sensor names"
            " its model"
        )
    if name is not None and name not in MODELS:
        raise UserError(f"--sensor: found {name}, allowed: {', '.join(MODELS)}")
    use = base or Use(str(name))
    try:
        use = replace(
            use,
            ambient=use.ambient if ambient is None else ambient,
            reflectance=use.reflectance if reflectance is None else reflectance,
            size=use.size if size is None else size_of(size),
        )
        return effective(use).sensor
    except ValueError as error:
        raise UserError(f"--sensor {use.model}: {error}") from error


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
    table = Table(
        title="Ranges in m of a white target (88 %, Benewake 90) that fills the beam, unless said",
        title_justify="left",
    )
    for column in ("sensor", "beam", "zones", "range", "least m", "Hz"):
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
    console.print(table)
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
        "No prices: none is sourced. Nearer than its least range a sensor still answers, with a"
        " distance not to be trusted."
    )
