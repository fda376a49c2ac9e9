"""The command safety."""

import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ...coverage.definitions.errors import UserError
from ...simulation.safety_options import SafetyOptions
from ..options.common import Json, PaperOption, RobotOption, SceneFileOption, Subject
from ..options.detection import NO_DETECTION, DetectionOptions
from ..options.groups import NO_MOTION, NO_SENSOR, MotionOptions, SensorOptions
from ..options.offered import offering
from ..options.reading import AS_WRITTEN, ReadingOptions

if TYPE_CHECKING:
    from ...simulation.safety import SafetyResult

# default reflectance: the darkest with a stated range for the most common sensor
DARK_TARGET = 0.17
TORSO = "0.45x0.7"  # m, width and height of a person


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
    detection: DetectionOptions = NO_DETECTION,
    stop_times: Annotated[
        Path | None,
        Parameter(
            help=(
                "CSV file of measured stops of the robot: the columns joint, extension_percent,"
                " load_percent, speed_percent, stop_s, stop_rad or stop_m, repeat. The largest"
                " stop_s is used. Default: [safety] of the scene."
            )
        ),
    ] = None,
    dossier: Annotated[
        bool,
        Parameter(
            negative=(),
            help=(
                "Also write dossier.html and dossier.json: the separation distance term by term,"
                " measured stops, undetected access, what the sensors can detect, performance"
                " levels, and what is open."
            ),
        ),
    ] = False,
    facts: Annotated[
        Path | None,
        Parameter(
            help=(
                "TOML file of your own statements for the dossier, which are quoted and not"
                " checked. Default: none; their fields stay open."
            )
        ),
    ] = None,
    out: Annotated[
        Path,
        Parameter(help="Output folder for README.md, safety.png, approaches.csv, safety.json."),
    ] = Path("place-rings-safety"),
    as_json: Json = False,
) -> None:
    """Simulate people who walk up to the moving robot, and report how many are detected in time.

    In time means: before the person is closer than the separation distance of ISO 10218-2:2025, in
    the form of ISO/TS 15066, which follows from the keys in [safety] of a scene. To search rings
    for the space close to the robot, use place-rings --target V_N:0.3 first. With --sensor the
    person wears dark clothes (reflectance 0.17) and is as large as a torso (0.45x0.7 m), unless
    options state otherwise. With --dossier, a page for the safety engineer is written as well; with
    --detect and --smallest-object it has what the sensors detect in the scene's targets.
    **This is an engineering aid; it confers no safety rating.**

    For example:

    ```bash
    place-rings task > task.csv
    place-rings safety n3_16_55 --trajectory task.csv --sensor vl53l1x
    ```

    ``place-rings --help`` explains the terms.
    """
    from place_rings._safety import safety as simulated
    from place_rings._safety import stated_in
    from place_rings._trajectory import Trajectory
    from place_rings._validation import ResolvedSetup

    from ...coverage.definitions.definition import json_of
    from ...formats.writing import made_folder
    from ...reporting.progress import ProgressBar
    from ...reporting.terminal import Terminal, say_json
    from ..options.scenes import scene_for

    asked = sensing
    if sensing.sensor is not None:
        reflectance = DARK_TARGET if sensing.reflectance is None else sensing.reflectance
        sensing = replace(
            sensing, reflectance=reflectance, target_size=sensing.target_size or TORSO
        )
    if facts is not None and not dossier:
        raise UserError("--facts: allowed only with --dossier; add it")
    question = detection.resolve(asked)
    if question is not None and not dossier:
        raise UserError("--detect: allowed only with --dossier; add it")
    if options.smallest_object and not dossier:
        raise UserError("--smallest-object: allowed only with --dossier; add it")
    stated = stated_in(facts)
    setup, where = sensing.resolve(subject, scene_for(subject, scene, robot, paper, reading))
    if motion.degrees and motion.trajectory is None:
        raise UserError("--degrees: allowed only with --trajectory FILE; add it")
    path, bar = motion.trajectory, ProgressBar(Terminal(stderr=True))
    with made_folder(out) as folder:
        with bar:
            task = bar.add_task("simulating approaches", total=None)
            report = simulated(
                ResolvedSetup(subject, setup, where),
                stop_times=stop_times,
                trajectory=None
                if path is None
                else Trajectory(None, None, path=path, degrees=motion.degrees),
                detect=question,
                progress=lambda done, total: bar.update(task, completed=done, total=total),
                **vars(options),
            )
        report = replace(report, command=shlex.join(["place-rings", *sys.argv[1:]]))
        report.save(folder)
        if dossier:
            with Terminal(stderr=True).status("writing the dossier"):
                report.dossier(folder, stated)
    if as_json:
        say_json(json_of(report.record))
    else:
        _show(report.record, folder, dossier)


def _show(r: "SafetyResult", folder: Path, dossier: bool) -> None:
    """Print the shares, and the files."""
    from place_rings._safety import DOSSIER, FILES

    from ...reporting.lines.results import formula, sensor_lines
    from ...reporting.terminal import Terminal

    say, share = Terminal().lines, r.in_time

    say(
        f"{r.setup}: {100 * share.share:.1f} % of {r.approaches} approaches are reported in time"
        f" (95 % interval {100 * share.low:.1f} to {100 * share.high:.1f}); {r.never_reported} are"
        " not reported before contact."
    )
    say(
        f"Separation distance at the fastest part: {formula(r.separation)} (form of ISO/TS 15066,"
        f" now in ISO 10218-2:2025). The smallest S is {r.separation.least_m:.2f} m."
    )
    if r.range_m < r.range_needed_m:
        say(
            f"The range of the sensors is too short: it is {r.range_m:.2f} m, but"
            f" {r.range_needed_m:.2f} m are needed. It suffices during"
            f" {100 * r.range_suffices:.0f} % of the motion."
        )
    if r.if_far_enough is not None:
        say(
            f"With the same beams and a range of {r.range_needed_m:.2f} m,"
            f" {100 * r.if_far_enough.share:.1f} % would be reported in time."
        )
    if not r.separation.speeds_known:
        say(
            f"No joint speeds are known, so every part is assumed to move at"
            f" {r.separation.fastest_m_s:g} m/s. Pass --trajectory."
        )
    say(
        "These people walk in. For hands close to the robot and its tool, search rings with"
        " --target V_N:0.3 (place-rings --help)."
    )
    say(*sensor_lines(r.sensors))
    if not r.sensors:
        say(
            "The sensor is not in the catalogue, so its nominal range is used for any target and"
            " light. Pass --sensor."
        )
    files = (*FILES, *(DOSSIER if dossier else ()))
    say(r.disclaimer, *(f"  {folder / name}" for name in files))
