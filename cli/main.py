"""The command line: place-rings, and its sub-commands."""

import json
import signal
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter
from cyclopts.validators import Number

from ..objectives.exact import Rule
from ..objectives.scene import Scene
from ..placement.errors import UserError
from ..placement.loader import resolve
from ..placement.models import MODELS
from .options import parse_goals, resolve_counting, resolve_scene, resolve_space, with_floors, with_goals

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
Voxel = Annotated[float, Parameter(help="Side of a voxel, m.")]
Json = Annotated[bool, Parameter(name="--json", negative=(), help="Print one JSON object for scripts.")]
Subject = Annotated[str, Parameter(name="PROPOSAL_OR_NAME", help="A proposal's file, or a name like n2_16_25.")]
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
    at_least: Annotated[
        tuple[str, ...], Parameter(negative=(), help="A floor: V_S:1.5=60 for 60 percent of it. Repeatable.")
    ] = (),
    seed: Annotated[int, Parameter(validator=Number(gte=0), help="Same seed, same answer.")] = 0,
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

    Example: place-rings --target V_S:0.5 --at-least V_S:1.5=45 --sensors 80

    Parameters
    ----------
    rings_per_link
        Rings on each link with a length; the tool carries one more.
    sensors_per_ring
        Sensors on each ring.
    """
    from .place import place as run

    if time is not None and not 0 < time < float("inf"):
        raise UserError(f"--time: found {time:g}, allowed: a positive number of seconds")
    asked = resolve_scene(scene, robot, target, radius) or with_goals(Scene(), parse_goals(target, radius))
    asked = with_floors(asked, at_least)
    cap = float("inf") if time is None else time
    run(asked, resolve_space(asked, rings_per_link, sensors_per_ring, sensors), seed, cap, voxel, out, as_json)


@app.command
def verify(
    subject: Subject,
    /,
    *,
    target: Targets = (),
    radius: Radius = None,
    scene: SceneFileOption = None,
    robot: RobotOption = None,
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
    run(subject, setup, with_goals(found, parse_goals(target, radius)), counting, as_json)


@app.command
def cones(subject: Subject, /, *, scene: SceneFileOption = None, robot: RobotOption = None) -> None:
    """Print every sensor's cone at every pose, as CSV in the base frame.

    Example: place-rings cones n2_16_25 > cones.csv
    """
    from .inspect import cones as run

    run(*resolve(subject, resolve_scene(scene, robot)))


@app.command
def study(
    name: Literal["bound", "convergence", "paper"],
    /,
    *,
    out: Annotated[Path | None, Parameter(help="Folder for data, pictures and page: results/NAME.")] = None,
    seed: Annotated[int, Parameter(validator=Number(gte=0), help="Of searches and paths; same seed, same figures.")] = 0,
) -> None:
    """Run a study into a folder; one that was stopped goes on where it was.

    paper: all that Kumar and Sahin (2019) measured, beside what they published and beside searched setups.

    bound: how far the search can be from the best setup of a grid, by linear and integer programmes.

    convergence: ζ of the paper's setups against the side of the voxels, rule by rule, on both UR10 chains.

    Example: place-rings study paper
    """
    from .study import study_bound, study_convergence, study_paper

    if name == "bound":
        study_bound(out or Path("results") / name, seed)
    elif name == "convergence":
        study_convergence(out or Path("results") / name)
    else:
        study_paper(out or Path("results") / name, seed)


@app.command
def schema(name: Literal["scene", "proposal", "verify", "result"], /) -> None:
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
