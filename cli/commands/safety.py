"""The command safety."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ...coverage.occlusion.occlusion_mode import Occlusion
from ...formats.errors import UserError
from ..options.common import WHOLE, Json, PaperOption, RobotOption, SceneFileOption, Seed, Subject
from ..options.groups import NO_MOTION, NO_SENSOR, MotionOptions, SensorOptions
from ..options.reading import AS_WRITTEN, ReadingOptions


def safety(
    subject: Subject,
    /,
    *,
    scene: SceneFileOption = None,
    robot: RobotOption = None,
    paper: PaperOption = False,
    reading: ReadingOptions = AS_WRITTEN,
    motion: MotionOptions = NO_MOTION,
    sensing: SensorOptions = NO_SENSOR,
    approaches: Annotated[
        int, Parameter(validator=Number(gte=1, lte=100_000), help="Number of simulated approaches.")
    ] = 720,
    directions: Annotated[
        int,
        WHOLE,
        Parameter(
            validator=Number(gte=1, lte=360),
            help="Number of sectors around the robot in the report.",
        ),
    ] = 12,
    rate: Annotated[
        float | None,
        Parameter(
            validator=Number(gt=0, lte=10_000),
            help="Measurements per second. Default: those of the ring's bus or the sensor, or 20.",
        ),
    ] = None,
    latency: Annotated[
        float,
        Parameter(
            validator=Number(gte=0, lte=5),
            help="Time from a measurement to its report, in seconds.",
        ),
    ] = 0.02,
    occlusion: Annotated[
        Occlusion | None,
        Parameter(
            help=(
                "What the robot's body does to the sensors. ignore: beams pass through it. shadow:"
                " points behind it are not covered. blind: a one-zone sensor covers nothing beyond"
                " the nearest surface in its beam. Default: that of the scene, with shadow instead"
                " of ignore."
            )
        ),
    ] = None,
    seed: Seed = 0,
    out: Annotated[
        Path,
        Parameter(help="Output folder for README.md, safety.png, approaches.csv, safety.json."),
    ] = Path("place-rings-safety"),
    as_json: Json = False,
) -> None:
    """Simulate people who walk up to the moving robot, and report how many are detected in time.

    In time means: before the person is closer than the separation distance of ISO/TS 15066, which
    follows from the keys in [safety] of a scene. To search rings for the space close to the robot,
    use place-rings --target V_N:0.3 first. With --sensor the person wears dark clothes
    (reflectance 0.17) and is as large as a torso (0.45x0.7 m), unless options state otherwise.
    **This is an engineering aid; it confers no safety rating.**

    For example:

    ```bash
    place-rings task > task.csv
    place-rings safety n3_16_55 --trajectory task.csv --sensor vl53l1x
    ```

    ``place-rings --help`` explains the terms.
    """
    from place_rings._trajectory import Trajectory
    from place_rings._validation import ResolvedSetup

    from ..options.scenes import scene_for
    from ..runs.safety import DARK_TARGET, TORSO
    from ..runs.safety import safety as run

    if sensing.sensor is not None:
        reflectance = DARK_TARGET if sensing.reflectance is None else sensing.reflectance
        sensing = replace(
            sensing, reflectance=reflectance, target_size=sensing.target_size or TORSO
        )
    setup, where = sensing.resolve(subject, scene_for(subject, scene, robot, paper, reading))
    if motion.degrees and motion.trajectory is None:
        raise UserError("--degrees: allowed only with --trajectory FILE; add it")
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
