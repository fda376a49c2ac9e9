"""Simulate people who walk in, print how many are detected in time, and write the report."""

import shlex
import sys
import time
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...coverage.occlusion.occlusion_mode import Occlusion
from ...coverage.rings.ring import Setup, sensor_optics
from ...coverage.robots.separation_distance import separation, stopping_time
from ...coverage.sensors.catalogue import MODELS
from ...formats.errors import UserError
from ...formats.recorded_motion import check_limits, read_record
from ...formats.schema.sensor_records import sensor_records
from ...formats.schema.separation_models import (
    DirectionModel,
    SafetyResult,
    SeparationModel,
    ShareModel,
)
from ...formats.writing import output_folder, write_text
from ...objectives.scene import Scene
from ...reporting import detection_page
from ...reporting.detection_figure import picture
from ...reporting.lines.protective_volume import formula
from ...reporting.lines.sensors import sensor_lines
from ...reporting.pages import csv_text
from ...reporting.progress import ProgressBar
from ...reporting.terminal import Terminal, say_json
from ...simulation.detection import (
    Approaches,
    Timing,
    approach,
    floor_of,
    seeing_as_far,
    start_of,
    walker,
)
from ...simulation.motion_samples import STEP, Moments, moments_of_record, moments_of_scene

ASSUMED_HZ = 20.0  # rate of a sensor without a stated rate
# default reflectance: the darkest with a stated range for the most common sensor
DARK_TARGET = 0.17
TORSO = "0.45x0.7"  # m, width and height of a person


@dataclass(frozen=True)
class SafetyOptions:
    """How approaches are drawn and reported."""

    approaches: int
    """Number of approaches."""
    directions: int
    """Number of sectors in the report."""
    rate: float | None
    """Measurements per second; None: the rate of each sensor."""
    latency: float
    """Time from a measurement to its report, s."""
    occlusion: Occlusion
    """Occlusion model of the robot's body."""
    seed: int
    """Random seed."""


def timing(setup: Setup, options: SafetyOptions) -> tuple[Timing, bool]:
    """Return period and latency of each sensor, and whether a rate had to be assumed."""
    rates = [
        options.rate or (MODELS[r.sensor.use.model].rate_hz if r.sensor.use else None)
        for r in setup.rings
    ]
    period = np.repeat([1 / (rate or ASSUMED_HZ) for rate in rates], [r.count for r in setup.rings])
    return Timing(period, options.latency), any(rate is None for rate in rates)


def safety(
    name: str,
    setup: Setup,
    scene: Scene,
    trajectory: Path | None,
    degrees: bool,
    options: SafetyOptions,
    out: Path,
    as_json: bool,
) -> None:
    """Simulate approaches to ``setup`` in ``scene``, print the result and write the report."""
    began = time.perf_counter()
    when, assumed = timing(setup, options)
    late = float(when.spent.max())
    # The simulation has period and latency itself; S keeps the rest of the reaction time T_r.
    whole = replace(scene.safety, reaction=max(scene.safety.reaction, late))
    left = replace(whole, reaction=whole.reaction - late)
    try:
        record = None if trajectory is None else read_record(trajectory, scene.robot, degrees)
        if trajectory is not None and record is not None:
            check_limits(trajectory, scene.robot, zip(record.time_s, record.q, strict=True))
        moments, full = (
            (
                moments_of_scene(scene, s)
                if record is None
                else moments_of_record(scene.robot, record, s)
            )
            for s in (left, whole)
        )
    except ValueError as error:
        raise UserError(f"safety: {error}") from error
    folder = output_folder(out)
    azimuths = np.random.default_rng((options.seed, 1)).uniform(0, 2 * np.pi, options.approaches)
    needed, range_m = float(full.asked.max()), float(sensor_optics(setup)[1].min())
    farther = seeing_as_far(setup, needed)
    start = start_of(scene.robot, farther, moments)
    stands, floor = tuple(o.body for o in scene.obstacles), floor_of(scene)
    setups = [setup] if range_m >= needed else [setup, farther]
    simulated: list[Approaches] = []
    with ProgressBar(Terminal(stderr=True)) as bar:
        task = bar.add_task("simulating approaches", total=len(setups) * options.approaches)
        for one in setups:
            done = len(simulated) * options.approaches

            def tell(n: int, done: int = done) -> None:
                bar.update(task, completed=done + n)

            walk = (
                when,
                scene.safety.human,
                azimuths,
                options.seed,
                options.occlusion,
                start,
                tell,
                stands,
                floor,
            )
            simulated.append(approach(scene.robot, one, moments, *walk))
    result = _result(
        name, setup, scene, options, moments, full, simulated, when, assumed, range_m, began
    )
    result = result.model_copy(
        update={"separation": result.separation.model_copy(update={"reaction_s": whole.reaction})}
    )
    command = shlex.join(["place-rings", *sys.argv[1:]])
    person = walker(scene.safety.human, start, floor)
    picture(
        scene.robot,
        setup,
        moments,
        simulated[0],
        person,
        floor,
        options.directions,
        folder / "safety.png",
    )
    write_text(folder / "approaches.csv", csv_text(detection_page.rows(simulated[0], moments)))
    write_text(folder / "safety.json", result.model_dump_json(indent=2) + "\n")
    write_text(folder / "README.md", detection_page.page(result, command))
    if as_json:
        say_json(result.model_dump_json(indent=2))
        return
    _show(result, folder)


def _share(simulated: Approaches, some: slice | np.ndarray = slice(None)) -> dict[str, float]:
    share, low, high = simulated.share(some)
    return {"percent": 100 * share, "low_percent": 100 * low, "high_percent": 100 * high}


def _result(
    name: str,
    setup: Setup,
    scene: Scene,
    options: SafetyOptions,
    moments: Moments,
    full: Moments,
    simulated: list[Approaches],
    when: Timing,
    assumed: bool,
    range_m: float,
    began: float,
) -> SafetyResult:
    first, edges = simulated[0], np.linspace(0, 360, options.directions + 1)
    sector = np.clip(
        np.searchsorted(edges, np.degrees(first.azimuth) % 360, side="right") - 1,
        0,
        options.directions - 1,
    )
    whole = replace(scene.safety, reaction=max(scene.safety.reaction, float(when.spent.max())))
    fastest = float(full.speed.max())
    largest = separation(whole, fastest, stopping_time(whole, scene.robot.name, fastest))
    known = moments.together or all(p.rate is not None for p in scene.poses)
    return SafetyResult(
        setup=name,
        approaches=options.approaches,
        moments=len(moments.weight),
        seconds_of_motion=STEP * (len(moments.weight) - 1) if moments.together else None,
        in_time=ShareModel(**_share(first)),
        if_far_enough=ShareModel(**_share(simulated[1])) if len(simulated) > 1 else None,
        never_reported=int(np.isnan(first.report).sum()),
        nearest_report_m=(
            float(np.nanmin(first.report)) if np.isfinite(first.report).any() else None
        ),
        by_direction=[
            DirectionModel(
                from_deg=low,
                to_deg=high,
                approaches=int((sector == k).sum()),
                **_share(first, sector == k),
            )
            for k, (low, high) in enumerate(pairwise(edges))
            if (sector == k).any()
        ],
        separation=SeparationModel.from_domain(
            largest,
            least_m=float(full.asked.min()),
            mean_m=float(moments.weight @ full.asked.mean(axis=1)),
            fastest_m_s=fastest,
            speeds_known=known,
            human_speed=whole.human,
            reaction_s=whole.reaction,
        ),
        separation_at_report_m=float(moments.asked.max()),
        period_s=float(when.period.max()),
        latency_s=options.latency,
        rate_assumed=assumed,
        range_m=range_m,
        range_needed_m=float(full.asked.max()),
        range_suffices_percent=100 * float(full.weight @ (full.asked.max(axis=1) <= range_m)),
        occlusion=options.occlusion,
        obstacles=[o.name for o in scene.obstacles],
        floor_m=floor_of(scene),
        seed=options.seed,
        sensors=sensor_records(setup),
        disclaimer=detection_page.DISCLAIMER,
        seconds=time.perf_counter() - began,
    )


def _show(r: SafetyResult, folder: Path) -> None:
    console = Terminal()

    def say(text: str) -> None:
        console.print(text, highlight=False, soft_wrap=True)

    say(
        f"{r.setup}: {r.in_time.percent:.1f} % of {r.approaches} approaches are reported in time"
        f" (95 % interval {r.in_time.low_percent:.1f} to {r.in_time.high_percent:.1f});"
        f" {r.never_reported} are not reported before contact."
    )
    say(
        f"Separation distance at the fastest part: {formula(r.separation)} (ISO/TS 15066). The"
        f" smallest S is {r.separation.least_m:.2f} m."
    )
    if r.range_m < r.range_needed_m:
        say(
            f"The range of the sensors is too short: it is {r.range_m:.2f} m, but"
            f" {r.range_needed_m:.2f} m are needed. It suffices during"
            f" {r.range_suffices_percent:.0f} % of the motion."
        )
    if r.if_far_enough is not None:
        say(
            f"With the same beams and a range of {r.range_needed_m:.2f} m,"
            f" {r.if_far_enough.percent:.1f} % would be reported in time."
        )
    if not r.separation.speeds_known:
        say(
            f"No joint speeds are known, so every part is assumed to move at"
            f" {r.separation.fastest_m_s:g} m/s. Pass --trajectory."
        )
    for line in sensor_lines(r.sensors):
        say(line)
    if not r.sensors:
        say(
            "The sensor is not in the catalogue, so its nominal range is used for any target and"
            " light. Pass --sensor."
        )
    say(r.disclaimer)
    for name in ("README.md", "safety.png", "approaches.csv", "safety.json"):
        say(f"  {folder / name}")
