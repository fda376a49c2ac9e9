"""The command study."""

import re
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from ...formats.errors import UserError, shown


def study(
    name: Annotated[
        Literal["bound", "convergence", "paper", "pareto", "robots"],
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
        Parameter(
            validator=Number(gte=1, lte=2000),
            help=(
                "pareto: number of sensors of the finest front; 24, 48, 80 and 112 get coarser"
                " ones. Default: 80."
            ),
        ),
    ] = None,
    scene: Annotated[
        Path | None,
        Parameter(name="--scene", help="pareto: scene file. Default: the reference scene."),
    ] = None,
    out: Annotated[Path | None, Parameter(help="Output folder. Default: results/NAME.")] = None,
    seed: Annotated[
        int,
        Parameter(
            validator=Number(gte=0), help="Random seed; the same seed gives the same figures."
        ),
    ] = 0,
    workers: Annotated[
        int,
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
    - paper: the measurements of Kumar and Sahin (2019), repeated, beside searched setups.
    - pareto: the best trade-offs between two targets, by default V_S:0.5 and V_S:1.5.
    - robots: what it costs on six robots to ignore the robot's body in the search.

    A study takes minutes to hours.

    For example:

    ```bash
    place-rings study paper --workers 16
    place-rings study pareto --sensors 64 --target V_S:0.5 --target V_OT
    ```

    ``place-rings --help`` explains the terms.
    """
    from ...formats.loader import read_scene
    from ...objectives.scene import Scene
    from ..options.targets import resolve_pair
    from ..runs.study import study_bound, study_convergence, study_paper, study_pareto, study_robots

    check_machines(workers, scheduler)
    folder = out or Path("results") / name
    if name != "pareto" and (target or scene or sensors):
        raise UserError(
            f"study {name}: --target, --scene and --sensors are allowed only with study pareto"
        )
    if name == "convergence" and seed:
        raise UserError(
            f"--seed {seed}: not allowed with study convergence, which uses no random numbers"
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
    """Check the processes of a study: ``workers`` on this machine, or those of a scheduler.

    Raises:
        UserError: if both are given, or if the libraries for them are not installed.
    """
    if scheduler is not None and not re.fullmatch(r"(tcp|tls)://\S+:\d+", scheduler):
        raise UserError(
            f"--scheduler: found {shown(scheduler)}, allowed: tcp://HOST:PORT or tls://HOST:PORT"
        )
    if scheduler is not None and workers != 1:
        raise UserError(f"--workers {workers}: not allowed with --scheduler; use one of them")
    if scheduler is not None or workers != 1:
        from ...formats.optional_dependencies import require

        option = "--workers" if scheduler is None else "--scheduler"
        require("cluster", option, "dask", "distributed", "cryptography")
