"""The search, which runs without a command."""

from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from ...coverage.choices import Losing
from ...formats.errors import UserError
from ..options.common import WHOLE, Floors, Json, Seed, TimeLimit, Voxel
from ..options.groups import (
    NO_MOTION,
    NO_SENSOR,
    REFERENCE,
    MotionOptions,
    SceneOptions,
    SensorOptions,
)
from ..options.panels import FAILURES

_COUNT = Number(gte=1, lte=200)


def place(
    *,
    where: SceneOptions = REFERENCE,
    rings_per_link: Annotated[
        int | None,
        WHOLE,
        Parameter(
            validator=_COUNT,
            help="Rings on each link, besides one on the tool (--rings: in all). Default: 2.",
        ),
    ] = None,
    sensors_per_ring: Annotated[
        int | None,
        WHOLE,
        Parameter(
            validator=_COUNT,
            help=(
                "Sensors on each ring, with --rings-per-link or --rings. Default: 16, or the"
                " nearest number that the rules of the scene allow."
            ),
        ),
    ] = None,
    sensors: Annotated[
        int | None,
        WHOLE,
        Parameter(
            validator=Number(gte=1, lte=2000),
            help=(
                "Number of sensors to place, in the fewest rings whose coverage is near the best;"
                " the search also divides the sensors among them. See --any-rings and --rings."
            ),
        ),
    ] = None,
    rings: Annotated[
        int | None,
        WHOLE,
        Parameter(
            validator=Number(gte=1, lte=1000),
            help=(
                "Number of rings to place; the search chooses their links. With --sensors it also"
                " divides the sensors among them; otherwise all have --sensors-per-ring. Default:"
                " two on each link and one on the tool, or with --sensors the fewest that suffice."
            ),
        ),
    ] = None,
    any_rings: Annotated[
        bool,
        Parameter(
            negative=(),
            help=(
                "With --sensors: the highest coverage, in as many rings as that takes, often many"
                " small ones. Takes about half the time."
            ),
        ),
    ] = False,
    fewest_rings: Annotated[
        bool,
        Parameter(negative=(), help="What --sensors alone does; accepted for earlier scripts."),
    ] = False,
    within: Annotated[
        float | None,
        Parameter(
            help=(
                "With --sensors: largest loss of coverage that fewer rings may cost, in percentage"
                " points. Default: 1."
            ),
        ),
    ] = None,
    reach: Annotated[
        float | None,
        Parameter(help="Coverage to reach in percent; find the fewest sensors that reach it."),
    ] = None,
    at_least: Floors = (),
    sensing: SensorOptions = NO_SENSOR,
    motion: MotionOptions = NO_MOTION,
    worst: Annotated[
        bool,
        Parameter(negative=(), help="Maximise the coverage of the worst pose instead of the mean."),
    ] = False,
    redundancy: Annotated[
        int,
        WHOLE,
        Parameter(
            group=FAILURES,
            help="Number of sensors that must see a point for it to count as covered.",
        ),
    ] = 1,
    losing: Annotated[
        Losing | None,
        Parameter(
            group=FAILURES,
            help="Maximise the coverage that remains when the most important ring or sensor fails.",
        ),
    ] = None,
    tolerant: Annotated[
        bool,
        Parameter(
            group=FAILURES,
            negative=(),
            help="Maximise the mean coverage over random mounting errors.",
        ),
    ] = False,
    position_error_mm: Annotated[
        float | None,
        Parameter(
            group=FAILURES,
            help="With --tolerant: largest error of a ring along its link, in mm. Default: 5.",
        ),
    ] = None,
    direction_error_deg: Annotated[
        float | None,
        Parameter(
            group=FAILURES,
            help=(
                "With --tolerant: largest error in the direction of a ring and of each sensor, in"
                " degrees. Default: 2."
            ),
        ),
    ] = None,
    gap: Annotated[
        bool,
        Parameter(
            negative=(),
            help=(
                "Also compute an upper bound on what any layout within the same budget and rules"
                " could cover; takes about a minute more. Not with --tolerant, obstacles, attached"
                " solids, weight fields or volumes of your own."
            ),
        ),
    ] = False,
    device: Annotated[
        Literal["auto", "cpu", "gpu"],
        Parameter(
            help=(
                "Use an accelerator where JAX finds one (auto), demand one (gpu), or do without"
                " (cpu)."
            )
        ),
    ] = "auto",
    seed: Seed = 0,
    searches: Annotated[
        int,
        WHOLE,
        Parameter(
            validator=Number(gte=1, lte=1000),
            help=(
                "Number of searches with different random seeds, one after the other; the best"
                " answer counts, and all are shown. With --sensors only beside --rings or"
                " --any-rings; not with --reach."
            ),
        ),
    ] = 1,
    time: TimeLimit = None,
    voxel: Voxel = 0.01,
    out: Annotated[
        Path, Parameter(help="Output folder for proposal.toml, placement.png and result.json.")
    ] = Path("place-rings-out"),
    as_json: Json = False,
) -> None:
    """Search a placement, count its coverage, and compare it with the layouts of the paper.

    The help of the program (in app.py) replaces this docstring.
    """
    from place_rings._search import InfeasibleError, cap_of, search

    from ...formats.loader import with_sensor
    from ...objectives.scene import CoreScene
    from ..options.criterion import resolve_errors
    from ..options.targets import with_floors
    from ..runs.place import place as run

    cap_of(time)
    scene = where.applied(where.given() or CoreScene())
    scene = with_sensor(scene, sensing.selected(scene.sensor))
    scene = motion.applied(with_floors(scene, at_least), worst)
    errors = resolve_errors(
        tolerant, position_error_mm=position_error_mm, direction_error_deg=direction_error_deg
    )
    find = partial(
        search,
        scene,
        sensors=sensors,
        rings_per_link=rings_per_link,
        sensors_per_ring=sensors_per_ring,
        rings=rings,
        any_rings=any_rings,
        fewest_rings=fewest_rings,
        within=within,
        reach=reach,
        redundancy=redundancy,
        losing=losing,
        tolerant=tolerant,
        seed=seed,
        searches=searches,
        time=time,
        voxel=voxel,
        gap=gap,
        device=device,
        **errors,
    )
    try:
        run(find, scene, voxel, out, as_json)
    except InfeasibleError as error:
        raise UserError(f"{where.scene}: {error}" if where.scene else str(error)) from error
