"""The command that simulates approaching people: run, print and write it."""

import shlex
import sys
from dataclasses import replace
from pathlib import Path

from place_rings._safety import FILES
from place_rings._safety import safety as simulated
from place_rings._trajectory import Trajectory
from place_rings._validation import ResolvedSetup

from ...coverage.definitions.definition import json_of
from ...formats.writing import made_folder
from ...reporting.lines.results import formula, sensor_lines
from ...reporting.progress import ProgressBar
from ...reporting.terminal import Terminal, say_json
from ...simulation.safety import SafetyResult
from ...simulation.safety_options import SafetyOptions

# default reflectance: the darkest with a stated range for the most common sensor
DARK_TARGET = 0.17
TORSO = "0.45x0.7"  # m, width and height of a person


def safety(
    subject: ResolvedSetup,
    trajectory: Trajectory | None,
    options: SafetyOptions,
    out: Path,
    as_json: bool,
) -> None:
    """Simulate approaches to a setup, print the shares and write the report.

    Args:
        subject: the setup in its scene.
        trajectory: recorded motion of the robot, or None.
        options: options of the simulation.
        out: output folder.
        as_json: print JSON instead of text.
    """
    with made_folder(out) as folder:
        with ProgressBar(Terminal(stderr=True)) as bar:
            task = bar.add_task("simulating approaches", total=None)

            def tell(done: int, total: int) -> None:
                bar.update(task, completed=done, total=total)

            report = simulated(subject, trajectory=trajectory, progress=tell, **vars(options))
        command = shlex.join(["place-rings", *sys.argv[1:]])
        replace(report, command=command).save(folder)
    if as_json:
        say_json(json_of(report.record))
        return
    _show(report.record, folder)


def _show(r: SafetyResult, folder: Path) -> None:
    say, share = Terminal().lines, r.in_time

    say(
        f"{r.setup}: {100 * share.share:.1f} % of {r.approaches} approaches are reported in time"
        f" (95 % interval {100 * share.low:.1f} to {100 * share.high:.1f}); {r.never_reported} are"
        " not reported before contact."
    )
    say(
        f"Separation distance at the fastest part: {formula(r.separation)} (ISO/TS 15066). The"
        f" smallest S is {r.separation.least_m:.2f} m."
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
    say(r.disclaimer, *(f"  {folder / name}" for name in FILES))
