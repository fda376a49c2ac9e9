"""The command line: place-rings, and its sub-commands."""

import json
import signal
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter
from cyclopts.validators import Number

from ..coverage.mounting import Law
from ..objectives.aim import Losing
from ..objectives.exact import Rule
from ..objectives.scene import Scene
from ..placement.errors import UserError
from ..placement.loader import resolve
from ..placement.proposals import MODELS
from .aim_options import mounting_errors, resolve_aim, resolve_robustness
from .options import (
    check_machines,
    parse_goals,
    resolve_counting,
    resolve_pair,
    resolve_reach,
    resolve_scene,
    resolve_space,
    resolve_time,
    with_floors,
    with_goals,
    with_motion,
)

app = App(
    name="place-rings",
    help="""Find where rings of Time-of-Flight sensors belong on a robot arm, and prove how much they see.

Examples: ``place-rings --target V_S --radius 0.5`` near the robot,
``place-rings --target V_S:0.5=0.6 --target V_S:1.5=0.4 --rings-per-link 3`` near and far,
``place-rings verify n2_16_25 --target V_O`` for a setup that is already there.""",
    version=lambda: version("place-rings"),
    suppress_keyboard_interrupt=False,
)

Targets = Annotated[
    tuple[str, ...],
    Parameter(name="--target", negative=(), help="V_O, V_T, V_OT, V_S; with radius and weight: V_S:0.5=0.6. Repeatable."),
]
Radius = Annotated[float | None, Parameter(help="Radius of a --target V_S that has none of its own, m.")]
SceneFileOption = Annotated[Path | None, Parameter(name="--scene", help="Another scene than the reference scene (TOML).")]
RobotOption = Annotated[str | None, Parameter(help="A built-in robot: ur10, ur10_dh.")]
Trajectory = Annotated[Path | None, Parameter(help="A recorded motion (CSV: time and joint angles) in place of the poses.")]
Degrees = Annotated[bool, Parameter(negative=(), help="The angles of --trajectory are in degrees, not radians.")]
Voxel = Annotated[float, Parameter(help="Side of a voxel, m.")]
Json = Annotated[bool, Parameter(name="--json", negative=(), help="Print one JSON object for scripts.")]
Subject = Annotated[
    str, Parameter(name="PROPOSAL_OR_NAME", help="A proposal's file, a CSV of sensors as of cones, or a name like n2_16_25.")
]
Floors = Annotated[tuple[str, ...], Parameter(negative=(), help="A floor: V_S:1.5=60 for 60 percent of it. Repeatable.")]
Seed = Annotated[int, Parameter(validator=Number(gte=0), help="Same seed, same answer.")]
Count = Annotated[int, Parameter(validator=Number(gte=1, lte=200))]


@app.default
def place(
    *,
    target: Targets = (),
    radius: Radius = None,
    scene: SceneFileOption = None,
    robot: RobotOption = None,
    rings_per_link: Count = 2,
    sensors_per_ring: Count = 16,
    sensors: Annotated[
        int | None, Parameter(validator=Number(gte=1, lte=2000), help="Spend so many sensors on any rings.")
    ] = None,
    reach: Annotated[float | None, Parameter(help="Find the fewest sensors that cover so many percent.")] = None,
    at_least: Floors = (),
    trajectory: Trajectory = None,
    degrees: Degrees = False,
    worst: Annotated[bool, Parameter(negative=(), help="Make the worst pose good, not the mean of all.")] = False,
    redundancy: Annotated[int, Parameter(help="Make large what at least so many sensors see.")] = 1,
    losing: Annotated[Losing | None, Parameter(help="Make ζ without the worst ring, or sensor, large.")] = None,
    tolerant: Annotated[bool, Parameter(negative=(), help="Make the mean under errors of mounting large.")] = False,
    position_error_mm: Annotated[float | None, Parameter(help="With --tolerant: see robustness; 5.")] = None,
    direction_error_deg: Annotated[float | None, Parameter(help="With --tolerant: see robustness; 2.")] = None,
    seed: Seed = 0,
    time: Annotated[float | None, Parameter(help="Cap on the search, s; it ends by its own schedule otherwise.")] = None,
    voxel: Voxel = 0.01,
    out: Annotated[Path, Parameter(help="Folder for proposal.toml, placement.png and result.json.")] = Path(
        "place-rings-out"
    ),
    as_json: Json = False,
) -> None:
    """Search a placement, verify it, and show it beside the paper's.

    Example: place-rings --target V_S --radius 0.5

    Example: place-rings --target V_S:0.5=0.6 --target V_S:1.5=0.4 --rings-per-link 3

    Example: place-rings --target V_S --radius 0.5 --sensors 48

    Example: place-rings --target V_S --radius 0.5 --reach 95

    Example: place-rings --target V_S:0.5 --at-least V_S:1.5=45 --sensors 80

    Example: place-rings --target V_S --radius 0.5 --redundancy 2

    Example: place-rings --target V_S --radius 0.5 --trajectory task.csv --worst

    Parameters
    ----------
    rings_per_link
        Rings on each link with a length; the tool carries one more.
    sensors_per_ring
        Sensors on each ring.
    """
    from .place import place as run

    cap = resolve_time(time)
    asked = resolve_scene(scene, robot, target, radius) or with_goals(Scene(), parse_goals(target, radius))
    asked = with_motion(with_floors(asked, at_least), trajectory, degrees, worst)
    share = resolve_reach(reach, sensors)
    space = None if share else resolve_space(asked, rings_per_link, sensors_per_ring, sensors)
    aim = resolve_aim(asked, redundancy, losing, tolerant, position_error_mm, direction_error_deg)
    run(asked, space, share, seed, cap, voxel, out, as_json, aim)


@app.command
def verify(
    subject: Subject,
    /,
    *,
    target: Targets = (),
    radius: Radius = None,
    scene: SceneFileOption = None,
    robot: RobotOption = None,
    trajectory: Trajectory = None,
    degrees: Degrees = False,
    voxel: Annotated[
        float | None, Parameter(help="Side of a voxel, m: 0.01. With --rule certified: cells of this one size.")
    ] = None,
    rule: Annotated[Rule, Parameter(help="How a voxel is counted.")] = "centre",
    width: Annotated[
        float | None, Parameter(help="With --rule certified: width of the guaranteed interval, in points: 0.1.")
    ] = None,
    memory: Annotated[
        float | None,
        Parameter(help="GB that sets of voxels may take; what needs more is streamed. Half of the free memory."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Count the exact coverage of a setup, or prove an interval that holds it.

    Example: place-rings verify n2_16_25 --target V_S --radius 0.5

    Example: place-rings verify n3_16_55 --target V_S --radius 0.5 --rule certified --width 0.01
    """
    from .inspect import verify as run

    counting = resolve_counting(rule, voxel, width, memory)
    setup, found = resolve(subject, resolve_scene(scene, robot, target, radius))
    asked = with_motion(with_goals(found, parse_goals(target, radius)), trajectory, degrees)
    run(subject, setup, asked, counting, as_json)


@app.command
def robustness(
    subject: Subject,
    /,
    *,
    target: Targets = (),
    radius: Radius = None,
    scene: SceneFileOption = None,
    robot: RobotOption = None,
    k: Annotated[int, Parameter(name="--k", help="Tell apart up to so many sensors that see a point.")] = 3,
    draws: Annotated[int, Parameter(help="Mountings that are drawn.")] = 100,
    position_error_mm: Annotated[float, Parameter(help="Of each ring, along its link, either way.")] = 5.0,
    direction_error_deg: Annotated[
        float, Parameter(help="Of each ring as a whole (rocked two ways and turned) and of each sensor on it, either way.")
    ] = 2.0,
    law: Annotated[
        Law, Parameter(help="uniform: errors up to these limits. normal: the limits are two standard deviations.")
    ] = "uniform",
    seed: Seed = 0,
    voxel: Voxel = 0.01,
    as_json: Json = False,
) -> None:
    """Count what several sensors see, what is lost with a sensor or a ring, and ζ under errors of mounting.

    Example: place-rings robustness n2_16_25 --target V_S --radius 0.5
    """
    from .robustness import robustness as run

    asked = resolve_robustness(k, voxel, draws, seed, mounting_errors(position_error_mm, direction_error_deg, law))
    setup, found = resolve(subject, resolve_scene(scene, robot, target, radius))
    run(subject, setup, with_goals(found, parse_goals(target, radius)), asked, as_json)


@app.command
def improve(
    subject: Subject,
    /,
    *,
    target: Targets = (),
    radius: Radius = None,
    scene: SceneFileOption = None,
    robot: RobotOption = None,
    changes: Annotated[int, Parameter(validator=Number(gte=1, lte=20), help="Rings touched, at most.")] = 3,
    add_sensors: Annotated[int, Parameter(validator=Number(gte=0, lte=1000), help="Sensors more than now, at most.")] = 0,
    at_least: Floors = (),
    seed: Annotated[int, Parameter(validator=Number(gte=0), help="Same seed, same answer.")] = 0,
    time: Annotated[float | None, Parameter(help="Cap on the search, s; it ends by its own plan otherwise.")] = None,
    voxel: Voxel = 0.01,
    out: Annotated[Path | None, Parameter(help="Folder for a proposal of each step, a picture and improve.json.")] = None,
    as_json: Json = False,
) -> None:
    """Find the best single change to what is mounted, the best two, and so on: what each gains, and the work it is.

    One change is one ring touched: set anew on its link, carried to another, added, or taken away.

    Example: place-rings improve n3_16_55 --target V_S --radius 1.5

    Example: place-rings improve mounted.csv --changes 2 --add-sensors 8 --out better
    """
    from .improve import improve as run

    cap = resolve_time(time)
    setup, found = resolve(subject, resolve_scene(scene, robot, target, radius))
    asked = with_floors(with_goals(found, parse_goals(target, radius)), at_least)
    run(subject, setup, asked, changes, add_sensors, seed, cap, voxel, out, as_json)


@app.command
def cones(subject: Subject, /, *, scene: SceneFileOption = None, robot: RobotOption = None) -> None:
    """Print every sensor's cone at every pose, as CSV in the base frame.

    Example: place-rings cones n2_16_25 > cones.csv
    """
    from .inspect import cones as run

    run(*resolve(subject, resolve_scene(scene, robot)))


@app.command
def task(
    *,
    robot: RobotOption = None,
    rate: Annotated[float, Parameter(validator=Number(gte=1, lte=1000), help="Rows a second.")] = 25.0,
) -> None:
    """Print the paper's task (ten products from one table to the other, 100 s) as a recorded motion: CSV in radians.

    Example: place-rings task > task.csv
    """
    from .motion import task as run

    run(resolve_scene(None, robot) or Scene(), rate)


@app.command
def study(
    name: Literal["convergence", "paper", "pareto"],
    /,
    *,
    target: Targets = (),
    sensors: Annotated[int, Parameter(validator=Number(gte=1, lte=2000), help="pareto: sensors of the front.")] = 80,
    scene: SceneFileOption = None,
    out: Annotated[Path | None, Parameter(help="Folder for data, pictures and page: results/NAME.")] = None,
    seed: Annotated[int, Parameter(validator=Number(gte=0), help="Of searches and paths; same seed, same figures.")] = 0,
    workers: Annotated[
        int, Parameter(validator=Number(gte=1, lte=1024), help="Processes of this machine; 1: this one, with its threads.")
    ] = 1,
    scheduler: Annotated[
        str | None, Parameter(help="A running dask scheduler that you trust, tcp://HOST:PORT, instead of --workers.")
    ] = None,
) -> None:
    """Run a study into a folder; one that was stopped goes on where it was.

    paper: all that Kumar and Sahin (2019) measured, beside what they published and beside searched setups.

    convergence: ζ of the paper's setups against the side of the voxels, rule by rule, on both UR10 chains.

    pareto: fronts of two targets, by default V_S:0.5 against V_S:1.5, each point a proposal.

    Example: place-rings study paper --workers 16

    Example: place-rings study pareto --sensors 80 --target V_S:0.5 --target V_S:1.5
    """
    from .study import study_convergence, study_paper, study_pareto

    check_machines(workers, scheduler)
    folder = out or Path("results") / name
    if name != "pareto" and (target or scene):
        raise UserError(f"study {name}: found --target or --scene, allowed: only with pareto")
    if name == "convergence":
        study_convergence(folder, workers, scheduler)
    elif name == "paper":
        study_paper(folder, seed, workers, scheduler)
    else:
        study_pareto(folder, seed, resolve_pair(target), sensors, scene, workers, scheduler)


@app.command
def schema(name: Literal["scene", "proposal", "verify", "robustness", "result", "improve"], /) -> None:
    """Print the JSON Schema of a file or of a command's JSON.

    Example: place-rings schema scene
    """
    print(json.dumps(MODELS[name].model_json_schema(), indent=2))


def main() -> None:
    """Run the command line; bad input is one line on stderr and exit code 2."""
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    try:
        app(sys.argv[1:], exit_on_error=False, print_error=False)
    except (UserError, CycloptsError, ValueError) as error:
        print(f"place-rings: {' '.join(str(error).split())}", file=sys.stderr)
        sys.exit(2)
