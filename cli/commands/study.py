"""The command study."""

import shlex
import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from ..options.common import SceneFileOption, Targets


def study(
    name: Literal["bound", "convergence", "paper", "pareto", "robots"],
    /,
    *,
    target: Targets = (),
    sensors: Annotated[
        int | None,
        Parameter(
            validator=Number(gte=1, lte=2000),
            help="pareto: of the front with most points, 80; 24, 48, 80, 112 go along.",
        ),
    ] = None,
    scene: SceneFileOption = None,
    out: Annotated[
        Path | None, Parameter(help="Folder for data, pictures and page: results/NAME.")
    ] = None,
    seed: Annotated[
        int,
        Parameter(validator=Number(gte=0), help="Of searches and paths; same seed, same figures."),
    ] = 0,
    workers: Annotated[
        int,
        Parameter(
            validator=Number(gte=1, lte=1024),
            help="Processes of this machine; 1: this one, with its threads.",
        ),
    ] = 1,
    scheduler: Annotated[
        str | None,
        Parameter(
            help="A running dask scheduler that you trust, tcp://HOST:PORT, instead of --workers."
        ),
    ] = None,
) -> None:
    """Run a study into a folder; one that was stopped goes on where it was.

    paper: all that Kumar and Sahin (2019) measured, beside what they published and beside searched
    setups.

    bound: how far the search can be from the best setup of a grid, by linear and integer
    programmes.

    convergence: ζ of the paper's setups against the side of the voxels, rule by rule, on both UR10
    chains.

    pareto: fronts of two targets, by default V_S:0.5 against V_S:1.5, each point a proposal.

    robots: what ignoring the robot's body costs on six robots: searches under each model of
    occlusion, seen under all three.

    Example: place-rings study paper --workers 16

    Example: place-rings study pareto --sensors 64 --target V_S:0.5 --target V_OT
    """
    from ..._study import StudyOptions, check_machines, check_study
    from ...formats.loader import read_scene
    from ...objectives.scene import Scene
    from ..options.targets import resolve_pair
    from ..runs.study import study as run

    check_machines(workers, scheduler)
    check_study(name, seed, target or None, sensors, scene)
    where = read_scene(scene) if scene else Scene()
    command = ["place-rings", "study", name, *(["--seed", str(seed)] if seed else [])]
    if name == "pareto":
        command = ["place-rings", *sys.argv[1:]]
    pair = resolve_pair(target, where)
    options = StudyOptions(seed, pair, sensors, where, shlex.join(command))
    run(name, out or Path("results") / name, options, workers, scheduler)
