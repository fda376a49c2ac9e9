"""The command study."""

import re
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from ...formats.errors import UserError, shown
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
    from ...formats.loader import read_scene
    from ...objectives.scene import Scene
    from ..options.targets import resolve_pair
    from ..runs.study import study_bound, study_convergence, study_paper, study_pareto, study_robots

    check_machines(workers, scheduler)
    folder = out or Path("results") / name
    if name != "pareto" and (target or scene or sensors):
        raise UserError(
            f"study {name}: found --target, --scene or --sensors, allowed: only with pareto"
        )
    if name == "convergence" and seed:
        raise UserError(
            f"--seed: found {seed} with study convergence, allowed: none, as nothing is drawn there"
        )
    if name == "bound":
        study_bound(folder, seed, workers, scheduler)
    elif name == "convergence":
        study_convergence(folder, workers, scheduler)
    elif name == "paper":
        study_paper(folder, seed, workers, scheduler)
    elif name == "robots":
        study_robots(folder, seed, workers, scheduler)
    else:
        where = read_scene(scene) if scene else Scene()
        study_pareto(folder, seed, resolve_pair(target, where), sensors, where, workers, scheduler)


def check_machines(workers: int, scheduler: str | None) -> None:
    """Check where a study shall run: on ``workers`` processes of this machine, or on the machines
    of a scheduler.

    Raises:
        UserError: if on both, or if the libraries that either needs are not installed.
    """
    if scheduler is not None and not re.fullmatch(r"(tcp|tls)://\S+:\d+", scheduler):
        raise UserError(
            f"--scheduler: found {shown(scheduler)}, allowed: tcp://HOST:PORT or tls://HOST:PORT"
        )
    if scheduler is not None and workers != 1:
        raise UserError(f"--workers: found {workers} beside --scheduler, allowed: one of the two")
    if scheduler is not None or workers != 1:
        from ...formats.optional_dependencies import require

        option = "--workers" if scheduler is None else "--scheduler"
        require("cluster", option, "dask", "distributed", "cryptography")
