"""The command safety."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ...coverage.occlusion.occlusion_mode import Occlusion
from ...formats.errors import UserError
from ..options.common import Json, RobotOption, SceneFileOption, Seed, Subject
from ..options.groups import NO_MOTION, NO_SENSOR, MotionOptions, SensorOptions


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
    from ..._trajectory import Trajectory
    from ..._validation import ResolvedSetup
    from ..options.scenes import resolve_scene
    from ..runs.safety import DARK_TARGET, TORSO
    from ..runs.safety import safety as run

    if sensing.sensor is not None:
        reflectance = DARK_TARGET if sensing.reflectance is None else sensing.reflectance
        sensing = replace(
            sensing, reflectance=reflectance, target_size=sensing.target_size or TORSO
        )
    setup, where = sensing.resolve(subject, resolve_scene(scene, robot))
    if motion.degrees and motion.trajectory is None:
        raise UserError("--degrees: found alone, allowed: only with --trajectory")
    path = motion.trajectory
    run(
        ResolvedSetup(subject, setup, where),
        out,
        as_json,
        trajectory=path and Trajectory(None, None, path=path, degrees=motion.degrees),
        approaches=approaches,
        directions=directions,
        rate=rate,
        latency=latency,
        occlusion=occlusion,
        seed=seed,
    )
