"""The search, which runs without a command."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ...coverage.definitions.errors import UserError
from ...placement.search.options import SearchOptions
from ..options.common import FAILURES, Floors, Json
from ..options.detection import NO_DETECTION, DetectionOptions
from ..options.groups import (
    NO_MOTION,
    NO_SENSOR,
    REFERENCE,
    MotionOptions,
    SceneOptions,
    SensorOptions,
)
from ..options.offered import offering

_FAILING = ("redundancy", "losing", "tolerant", "position_error_mm", "direction_error_deg")


@offering(dict.fromkeys(_FAILING, FAILURES), without=("start", "detect"))
def place(
    *,
    where: SceneOptions = REFERENCE,
    options: SearchOptions,
    at_least: Floors = (),
    detection: DetectionOptions = NO_DETECTION,
    sensing: SensorOptions = NO_SENSOR,
    motion: MotionOptions = NO_MOTION,
    worst: Annotated[
        bool,
        Parameter(negative=(), help="Maximise the coverage of the worst pose instead of the mean."),
    ] = False,
    out: Annotated[
        Path, Parameter(help="Output folder for proposal.toml, placement.png and result.json.")
    ] = Path("place-rings-out"),
    as_json: Json = False,
) -> None:
    """Search a placement, count its coverage, and compare it with the layouts of the paper.

    The help of the program (in app.py) replaces this docstring.
    """
    from place_rings._search import InfeasibleError

    from ...formats.loader import with_sensor
    from ...objectives.scene import Scene
    from ..options.targets import with_floors
    from ..runs.place import place as run

    scene = where.applied(where.given() or Scene())
    scene = with_sensor(scene, sensing.selected(scene.sensor))
    scene = motion.applied(with_floors(scene, at_least), worst)
    try:
        run(scene, replace(options, detect=detection.resolve(sensing)), out, as_json)
    except InfeasibleError as error:
        raise UserError(f"{where.scene}: {error}" if where.scene else str(error)) from error
