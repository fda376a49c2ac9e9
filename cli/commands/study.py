"""The command study."""

import shlex
import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from ..options.common import WHOLE


def study(
    name: Annotated[
        Literal["bound", "convergence", "gap", "layouts", "paper", "pareto", "robots"],
        Parameter(help="Study to run."),
    ],
    /,
    *,
    target: Annotated[
        tuple[str, ...],
        Parameter(
            name="--target",
            negative=(),
            help="pareto: one of its two targets, as NAME[:RADIUS]. Default: V_S:0.5 and V_S:1.5.",
        ),
    ] = (),
    sensors: Annotated[
        int | None,
        WHOLE,
        Parameter(
            validator=Number(gte=1, lte=2000),
            help=(
                "pareto: number of sensors whose front is computed most finely; those of 24, 48,"
                " 80 and 112 follow with fewer points. Default: 80."
            ),
        ),
    ] = None,
    scene: Annotated[
        Path | None,
        Parameter(name="--scene", help="pareto: scene file. Default: the reference scene."),
    ] = None,
    paper: Annotated[
        bool,
        Parameter(
            name="--paper",
            negative=(),
            help=(
                "pareto: count as the paper does, as bound, convergence, gap and paper always do:"
                " beams pass through the robot, and rings need no room on it."
            ),
        ),
    ] = False,
    layout: Annotated[
        tuple[Path, ...],
        Parameter(
            name="--layout",
            negative=(),
            help=(
                "layouts: layout file (.csv, .toml) to score besides those of the package."
                " Repeatable."
            ),
        ),
    ] = (),
    time: Annotated[
        float | None,
        Parameter(help="layouts: processor time of each search in seconds. Default: 40."),
    ] = None,
    quick: Annotated[
        bool,
        Parameter(
            negative=(),
            help=(
                "pareto: only the front of --sensors, with few and short searches: about two"
                " minutes for 24."
            ),
        ),
    ] = False,
    out: Annotated[Path | None, Parameter(help="Output folder. Default: results/NAME.")] = None,
    seed: Annotated[
        int,
        WHOLE,
        Parameter(
            validator=Number(gte=0), help="Random seed; the same seed gives the same figures."
        ),
    ] = 0,
    workers: Annotated[
        int,
        WHOLE,
        Parameter(
            validator=Number(gte=1, lte=1024),
            help="Number of processes on this machine; above 1 it needs the cluster extra.",
        ),
    ] = 1,
    scheduler: Annotated[
        str | None,
        Parameter(
            help="Address of a dask scheduler that you trust (tcp://HOST:PORT), not with --workers."
        ),
    ] = None,
) -> None:
    """Run a study, and write its data, pictures and a page. A stopped study resumes.

    - bound: how far the search can be from the best setup on a grid, from linear and integer
      programmes.
    - convergence: how coverage depends on the size of the voxels, for each way to count them.
    - gap: an upper bound on every layout with a number of sensors, beside the best known one.
    - layouts: published layouts of on-robot sensors, scored under the same rules.
    - paper: the measurements of Kumar and Sahin (2019), repeated, beside searched setups.
    - pareto: the best trade-offs between two targets, by default V_S:0.5 and V_S:1.5.
    - robots: what it costs on six robots to ignore the robot's body in the search.

    A study takes minutes to hours; it begins with an estimate, and shows the time left.

    For example:

    ```bash
    place-rings study paper --workers 16
    place-rings study pareto --sensors 24 --quick
    place-rings study pareto --sensors 64 --target V_S:0.5 --target V_OT
    place-rings study layouts --layout mine.csv
    ```

    ``place-rings --help`` explains the terms.
    """
    from place_rings._study import StudyOptions, check_study, read_layouts, study_command

    from ...coverage.definitions.errors import UserError
    from ...formats.loader import read_scene
    from ...objectives.scene import Scene
    from ..options.scenes import in_paper
    from ..options.targets import resolve_pair
    from ..runs.study import study as run

    given = {"targets": target or None, "sensors": sensors, "scene": scene, "quick": quick}
    check_study(name, seed, workers, scheduler, **given, layout=layout, time=time)
    if paper and name != "pareto":
        raise UserError(f"--paper: found with study {name}, allowed: only with pareto")
    where = read_scene(scene) if scene else Scene()
    where = in_paper(where) if paper else where
    command = study_command(name, seed, layout, time)
    if name == "pareto":
        command = shlex.join(["place-rings", *sys.argv[1:]])
    pair, layouts = resolve_pair(target, where), read_layouts(name, layout)
    options = StudyOptions(
        *(name, seed, pair, sensors, where, layouts, time, quick, workers, scheduler, command)
    )
    run(out or Path("results") / name, options)
