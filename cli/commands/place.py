"""What runs without a command: the search."""

from functools import partial
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ...coverage.choices import Losing
from ...formats.errors import UserError
from ..options.common import Count, Floors, Json, Seed, Voxel
from ..options.groups import (
    NO_MOTION,
    NO_SENSOR,
    REFERENCE,
    MotionOptions,
    SceneOptions,
    SensorOptions,
)


def place(
    *,
    where: SceneOptions = REFERENCE,
    rings_per_link: Count | None = None,
    sensors_per_ring: Count | None = None,
    sensors: Annotated[
        int | None,
        Parameter(validator=Number(gte=1, lte=2000), help="Spend so many sensors on any rings."),
    ] = None,
    reach: Annotated[
        float | None, Parameter(help="Find the fewest sensors that cover so many percent.")
    ] = None,
    at_least: Floors = (),
    sensing: SensorOptions = NO_SENSOR,
    motion: MotionOptions = NO_MOTION,
    worst: Annotated[
        bool, Parameter(negative=(), help="Make the worst pose good, not the mean of all.")
    ] = False,
    redundancy: Annotated[int, Parameter(help="Make large what at least so many sensors see.")] = 1,
    losing: Annotated[
        Losing | None, Parameter(help="Make ζ without the worst ring, or sensor, large.")
    ] = None,
    tolerant: Annotated[
        bool, Parameter(negative=(), help="Make the mean under errors of mounting large.")
    ] = False,
    position_error_mm: Annotated[
        float | None, Parameter(help="With --tolerant: see robustness; 5.")
    ] = None,
    direction_error_deg: Annotated[
        float | None, Parameter(help="With --tolerant: see robustness; 2.")
    ] = None,
    seed: Seed = 0,
    time: Annotated[
        float | None, Parameter(help="Cap on the search, s; it ends by its own schedule otherwise.")
    ] = None,
    voxel: Voxel = 0.01,
    out: Annotated[
        Path, Parameter(help="Folder for proposal.toml, placement.png and result.json.")
    ] = Path("place-rings-out"),
    as_json: Json = False,
) -> None:
    """Search a placement, verify it, and show it beside the paper's.

    Example: place-rings --target V_S --radius 0.5

    Example: place-rings --target V_S:0.5=0.6 --target V_S:1.5=0.4 --rings-per-link 3

    Example: place-rings --target V_S --radius 0.5 --sensors 48

    Example: place-rings --target V_S --radius 0.5 --reach 95

    Example: place-rings --target V_S:0.5 --at-least V_S:1.5=45 --sensors 80

    Example: place-rings --target V_S --radius 0.5 --redundancy 2

    Example: place-rings --target V_S --radius 0.5 --occlusion shadow

    Example: place-rings --target V_S --radius 0.5 --trajectory task.csv --worst

    Example: place-rings --target V_S --radius 0.5 --sensor vl53l1x --ambient 50kcps --target-size
    0.1x0.4

    Parameters
    ----------
    rings_per_link
        Rings on each link with a length, 2; the tool carries one more.
    sensors_per_ring
        Sensors on each ring; 16, or what a scene's rules allow next to it.
    """
    from ..._search import InfeasibleError, cap_of, search
    from ...formats.loader import with_sensor
    from ...objectives.scene import Scene
    from ..options.criterion import resolve_errors
    from ..options.targets import with_floors
    from ..runs.place import place as run

    cap_of(time)
    asked = where.applied(where.given() or Scene())
    asked = with_sensor(asked, sensing.asked(asked.sensor))
    asked = motion.applied(with_floors(asked, at_least), worst)
    errors = resolve_errors(
        tolerant, position_error_mm=position_error_mm, direction_error_deg=direction_error_deg
    )
    find = partial(
        search,
        asked,
        sensors=sensors,
        rings_per_link=rings_per_link,
        sensors_per_ring=sensors_per_ring,
        reach_percent=reach,
        redundancy=redundancy,
        losing=losing,
        tolerant=tolerant,
        seed=seed,
        time_cap=time,
        voxel=voxel,
        **errors,
    )
    try:
        run(find, asked, voxel, out, as_json)
    except InfeasibleError as error:
        raise UserError(f"{where.scene}: {error}" if where.scene else str(error)) from error
