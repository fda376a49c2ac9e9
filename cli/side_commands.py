"""Commands beside the main ones: cones, sensors, task, study, schema."""

import json
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from ..coverage.robots.built_in import PAPER_ROBOTS
from ..formats.errors import UserError, shown
from ..formats.loader import read_scene, resolve
from ..formats.schema.proposal_models import MODELS
from ..objectives.scene import Scene
from ..reporting.terminal import say_json
from .app import Json, RobotOption, SceneFileOption, Subject, Targets, app
from .options import (
    check_machines,
    resolve_pair,
    resolve_scene,
)


@app.command
def cones(subject: Subject, /, *, scene: SceneFileOption = None, robot: RobotOption = None) -> None:
    """Print every sensor's cone at every pose, as CSV in the base frame.

    Example: place-rings cones n2_16_25 > cones.csv
    """
    from .inspect import cones as run

    run(*resolve(subject, resolve_scene(scene, robot)))


@app.command
def sensors(*, as_json: Json = False) -> None:
    """Print the catalogue of sensors: beams, ranges by light and target, rates, and where each
    figure is from.

    Example: place-rings sensors
    """
    from .sensing import sensors as run

    run(as_json)


@app.command
def task(
    *,
    robot: RobotOption = None,
    rate: Annotated[
        float, Parameter(validator=Number(gte=1, lte=1000), help="Rows a second.")
    ] = 25.0,
) -> None:
    """Print the paper's task (ten products from one table to the other, 100 s) as a recorded
    motion: CSV in radians.

    Example: place-rings task > task.csv
    """
    from .paper_task import task as run

    if robot is not None and robot not in PAPER_ROBOTS:
        raise UserError(
            f"--robot: found {shown(robot)}, allowed: {', '.join(PAPER_ROBOTS)}, as the task is the"
            " paper's"
        )
    run(resolve_scene(None, robot) or Scene(), rate)


@app.command
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
    from .study import study_bound, study_convergence, study_paper, study_pareto, study_robots

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


@app.command
def schema(
    name: Literal[
        "scene",
        "robot",
        "proposal",
        "verify",
        "robustness",
        "result",
        "improve",
        "safety",
        "printing",
        "check",
        "sensors",
    ],
    /,
) -> None:
    """Print the JSON Schema of a file or of a command's JSON.

    Example: place-rings schema scene
    """
    from ..rig.check.models import CheckResult

    model = CheckResult if name == "check" else MODELS[name]
    say_json(json.dumps(model.model_json_schema(), indent=2))
