"""The command safety."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ...coverage.definitions.errors import UserError
from ...simulation.safety_options import SafetyOptions
from ..options.common import Json, PaperOption, RobotOption, SceneFileOption, Subject
from ..options.groups import NO_MOTION, NO_SENSOR, MotionOptions, SensorOptions
from ..options.offered import offering
from ..options.reading import AS_WRITTEN, ReadingOptions


@offering()
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
    options: SafetyOptions,
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
        None if path is None else Trajectory(None, None, path=path, degrees=motion.degrees),
        options,
        out,
        as_json,
    )
