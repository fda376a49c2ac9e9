"""Commands on a setup that is there: verify, robustness, safety, improve."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ..coverage.occlusion.model import Occlusion
from ..coverage.rings.mounting_errors import Law
from ..formats.errors import UserError
from ..objectives.verify import Rule
from .aim_options import mounting_errors, resolve_robustness
from .app import (
    Floors,
    Json,
    RobotOption,
    SceneFileOption,
    Seed,
    Subject,
    Voxel,
    app,
)
from .option_groups import (
    AS_IT_IS,
    NO_FRAMES,
    NO_MOTION,
    NO_SENSOR,
    REFERENCE,
    FrameOptions,
    MotionOptions,
    SceneOptions,
    SensorOptions,
    SubjectOptions,
)
from .options import (
    resolve_counting,
    resolve_scene,
    resolve_time,
    with_floors,
)


@app.command
def verify(
    subject: Subject,
    /,
    *,
    given: SubjectOptions = AS_IT_IS,
    voxel: Annotated[
        float | None,
        Parameter(help="Side of a voxel, m: 0.01. With --rule certified: cells of this one size."),
    ] = None,
    rule: Annotated[Rule, Parameter(help="How a voxel is counted.")] = "centre",
    width: Annotated[
        float | None,
        Parameter(help="With --rule certified: width of the guaranteed interval, in points: 0.1."),
    ] = None,
    memory: Annotated[
        float | None,
        Parameter(
            help=(
                "GB that sets of voxels may take; what needs more is streamed. Half of the free"
                " memory."
            )
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Count the exact coverage of a setup, or prove an interval that holds it.

    Example: place-rings verify n2_16_25 --target V_S --radius 0.5

    Example: place-rings verify n3_16_55 --target V_S --radius 0.5 --rule certified --width 0.01

    Example: place-rings verify n3_16_55 --sensor vl53l1x --ambient 50kcps --target-size 0.1x0.4
    """
    from .inspect import verify as run

    counting = resolve_counting(rule, voxel, width, memory)
    run(subject, *given.resolve(subject), counting, as_json)


@app.command
def robustness(
    subject: Subject,
    /,
    *,
    place: SceneOptions = REFERENCE,
    mounted: FrameOptions = NO_FRAMES,
    k: Annotated[
        int, Parameter(name="--k", help="Tell apart up to so many sensors that see a point.")
    ] = 3,
    draws: Annotated[int, Parameter(help="Mountings that are drawn.")] = 100,
    position_error_mm: Annotated[
        float, Parameter(help="Of each ring, along its link, either way.")
    ] = 5.0,
    direction_error_deg: Annotated[
        float,
        Parameter(
            help=(
                "Of each ring as a whole (rocked two ways and turned) and of each sensor on it,"
                " either way."
            )
        ),
    ] = 2.0,
    law: Annotated[
        Law,
        Parameter(
            help=(
                "uniform: errors up to these limits. normal: the limits are two standard"
                " deviations."
            )
        ),
    ] = "uniform",
    seed: Seed = 0,
    voxel: Voxel = 0.01,
    as_json: Json = False,
) -> None:
    """Count what several sensors see, what is lost with a sensor or a ring, and ζ under errors of
    mounting.

    Example: place-rings robustness n2_16_25 --target V_S --radius 0.5
    """
    from .robustness import robustness as run

    asked = resolve_robustness(
        k, voxel, draws, seed, mounting_errors(position_error_mm, direction_error_deg, law)
    )
    run(subject, *SubjectOptions(place, mounted=mounted).resolve(subject), asked, as_json)


@app.command
def safety(
    subject: Subject,
    /,
    *,
    scene: SceneFileOption = None,
    robot: RobotOption = None,
    motion: MotionOptions = NO_MOTION,
    sensing: SensorOptions = NO_SENSOR,
    approaches: Annotated[
        int, Parameter(validator=Number(gte=1, lte=100_000), help="Walks that are drawn.")
    ] = 720,
    directions: Annotated[
        int, Parameter(validator=Number(gte=1, lte=360), help="Sectors that are told apart.")
    ] = 12,
    rate: Annotated[
        float | None,
        Parameter(
            validator=Number(gt=0, lte=10_000), help="Readings a second; the sensor's own, or 20."
        ),
    ] = None,
    latency: Annotated[
        float, Parameter(validator=Number(gte=0, lte=5), help="From a reading to the report, s.")
    ] = 0.02,
    occlusion: Annotated[
        Occlusion | None,
        Parameter(
            help=(
                "What the robot does to its sensors; the scene's, but shadow in place of ignore, if"
                " none is given."
            )
        ),
    ] = None,
    seed: Seed = 0,
    out: Annotated[
        Path, Parameter(help="Folder for README.md, safety.png, approaches.csv and safety.json.")
    ] = Path("place-rings-safety"),
    as_json: Json = False,
) -> None:
    """Let a dark person walk in from all sides while the robot moves: is each reported before its
    separation distance?

    With --sensor, a target of 17 % reflectance and the size of a torso unless told otherwise. What
    the distances are made of stands in a scene's [safety]. An engineering aid: no safety rating
    follows.

    Example: place-rings safety n3_16_55 --trajectory task.csv --sensor vl53l1x --ambient 50kcps
    """
    from .safety import DARK_TARGET, TORSO, SafetyOptions
    from .safety import safety as run

    if sensing.sensor is not None:
        reflectance = DARK_TARGET if sensing.reflectance is None else sensing.reflectance
        sensing = replace(
            sensing, reflectance=reflectance, target_size=sensing.target_size or TORSO
        )
    setup, found = sensing.resolve(subject, resolve_scene(scene, robot))
    if motion.degrees and motion.trajectory is None:
        raise UserError("--degrees: found alone, allowed: only with --trajectory")
    own: Occlusion = "shadow" if found.occlusion == "ignore" else found.occlusion
    asked = SafetyOptions(approaches, directions, rate, latency, occlusion or own, seed)
    run(subject, setup, found, motion.trajectory, motion.degrees, asked, out, as_json)


@app.command
def improve(
    subject: Subject,
    /,
    *,
    place: SceneOptions = REFERENCE,
    changes: Annotated[
        int, Parameter(validator=Number(gte=1, lte=20), help="Rings touched, at most.")
    ] = 3,
    add_sensors: Annotated[
        int, Parameter(validator=Number(gte=0, lte=1000), help="Sensors more than now, at most.")
    ] = 0,
    at_least: Floors = (),
    mounted: FrameOptions = NO_FRAMES,
    seed: Annotated[int, Parameter(validator=Number(gte=0), help="Same seed, same answer.")] = 0,
    time: Annotated[
        float | None, Parameter(help="Cap on the search, s; it ends by its own plan otherwise.")
    ] = None,
    voxel: Voxel = 0.01,
    out: Annotated[
        Path | None,
        Parameter(
            help=(
                "Folder for a proposal of each step, a picture and improve.json; nothing is written"
                " without."
            )
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Find the best single change to what is mounted, the best two, and so on: what each gains, and
    the work it is.

    One change is one ring touched: set anew on its link, carried to another, added, or taken away.

    Example: place-rings improve n3_16_55 --target V_S --radius 1.5

    Example: place-rings improve mounted.csv --changes 2 --add-sensors 8 --out better

    Example: place-rings improve mounted.urdf --frames "tof_.*" --target V_S --radius 1.5
    """
    from .improve import improve as run

    cap = resolve_time(time)
    setup, asked = SubjectOptions(place, mounted=mounted).resolve(subject)
    run(
        subject,
        setup,
        with_floors(asked, at_least),
        changes,
        add_sensors,
        seed,
        cap,
        voxel,
        out,
        as_json,
    )
