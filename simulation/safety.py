"""The share of approaching people that a setup reports in time, with all that it rests on."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import Field

from ..coverage.definitions.definition import definition
from ..coverage.definitions.errors import input_errors
from ..coverage.definitions.field_types import Items
from ..coverage.definitions.records import FileRecord
from ..coverage.definitions.units import Covered
from ..coverage.electronics.electronics import readings_hz
from ..coverage.electronics.frame_times import ASSUMED_HZ
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Setup, sensor_optics
from ..coverage.rings.sensor_records import SensorRecord, sensor_records
from ..coverage.robots.separation_distance import Safety, separation, stopping_time
from ..coverage.robots.stop_times import StopCondition, by_condition
from ..objectives.firing.schedule import firing_schedule
from ..objectives.options import FiringOptions
from ..objectives.scene import Scene
from ..objectives.separation_summary import Separations
from ..objectives.trajectory import MotionRecord
from .detection import (
    Approaches,
    ApproachShare,
    Timing,
    approach,
    floor_of,
    seeing_as_far,
    start_of,
)
from .motion_samples import STEP, Moments, moments_of_record, moments_of_scene
from .safety_options import SafetyOptions

DISCLAIMER = (
    "place-rings is an engineering aid. Nothing here confers a safety rating: few sensors of its"
    " catalogue are safety-rated, and coverage is not detection. Compliance with the standards"
    " for protective devices (ISO 13855, ISO 10218-2, IEC 61496) must be demonstrated on the real"
    " cell by those responsible for it."
)


@definition(kw_only=True)
class DirectionShare(ApproachShare):
    """The approaches between two azimuths."""

    from_deg: float
    """Lower azimuth in the base frame, degrees from +x towards +y."""
    to_deg: float
    """Upper azimuth in the base frame, degrees from +x towards +y."""
    approaches: int
    """Number of approaches."""


@definition(kw_only=True)
class SafetyResult(FileRecord):
    """Output of ``safety --json``: the share of approaches reported in time. It confers no safety
    rating."""

    setup: str
    """Name or file of the setup."""
    approaches: int
    """Number of approaches."""
    moments: int
    """Number of moments of the motion."""
    seconds_of_motion: float | None = None
    """Duration of the recorded motion, s."""
    in_time: ApproachShare
    """Share of approaches reported in time."""
    if_far_enough: ApproachShare | None = None
    """The same share with sensors whose range suffices."""
    never_reported: int
    """Number of approaches without a report before contact."""
    nearest_report_m: float | None = None
    """Smallest distance at a first report, m."""
    by_direction: Items[DirectionShare]
    """Shares by direction."""
    separation: Separations
    """Separation distances."""
    stops: Items[StopCondition] = ()
    """Measured stops of the robot by condition; empty where none were measured."""
    separation_at_report_m: float
    """Largest separation distance without period and latency, m."""
    period_s: float
    """Period of the readings, s."""
    latency_s: float
    """Latency of a report, s."""
    rate_assumed: bool
    """Whether a rate of readings is assumed."""
    scheduled: bool = False
    """Whether no two sensors that may disturb each other fire together."""
    range_m: float
    """Range of the sensors, m."""
    range_needed_m: float
    """Range needed, m."""
    range_suffices: Annotated[float, Covered("range_suffices_percent")]
    """Share of the moments at which the range suffices."""
    occlusion: Occlusion
    """Occlusion model."""
    obstacles: Items[str] = ()
    """Names of the obstacles."""
    floor_m: float
    """Height of the floor, m."""
    seed: int
    """Random seed."""
    sensors: Items[SensorRecord]
    """Catalogue sensors of the setup."""
    disclaimer: str = DISCLAIMER
    """Statement that the result is no safety rating."""
    seconds: Annotated[float, Field(ge=0)]
    """Wall-clock time, s."""


@dataclass(frozen=True)
class SafetyMotion:
    """The moments of the motion with two separation distances."""

    moments: Moments
    """Moments whose distances exclude period and latency, which the simulation accounts for."""
    full: Moments
    """The same moments with the full distances."""
    safety: Safety
    """Terms of the full distances."""
    timing: Timing
    """Period and latency of each sensor."""
    assumed: bool
    """Whether a rate of readings is assumed."""

    def separation(self, scene: Scene) -> Separations:
        """Return the record of the separation distances."""
        terms, fastest = self.safety, float(self.full.speed.max())
        return Separations.of(
            terms,
            separation(terms, fastest, stopping_time(terms, scene.robot.name, fastest)),
            float(self.full.required.min()),
            float(self.moments.weight @ self.full.required.mean(axis=1)),
            fastest,
            self.moments.together or all(p.rate is not None for p in scene.poses),
        )


@dataclass(frozen=True)
class SimulatedApproaches:
    """Simulated approaches to a setup."""

    record: SafetyResult
    """Record that ``place-rings safety --json`` prints."""
    approaches: Approaches
    """The simulated approaches."""
    motion: SafetyMotion
    """The moments of the motion."""
    start: float
    """Distance from the base's axis at which walks begin, m."""


def motion_of(
    setup: Setup,
    scene: Scene,
    record: MotionRecord | None,
    options: SafetyOptions,
    visited: Scene | None = None,
) -> SafetyMotion:
    """Return the moments of a motion, and the timing of the sensors.

    Args:
        setup: the sensors.
        scene: the scene.
        record: samples of the motion; None: the robot stays in each of the scene's poses.
        options: options of the simulation.
        visited: the scene with poses of the motion, for the firing schedule; None: ``scene``.

    The simulation accounts for period and latency; the rest of the reaction time T_r stays in S.

    Raises:
        InputError: for a robot without a stopping time.
    """
    rates, assumed = _rates(setup, scene, options, visited or scene)
    period = np.repeat([1 / rate for rate in rates], [r.count for r in setup.groups])
    timing = Timing(period, options.latency)
    late = float(timing.spent.max())
    whole_safety = replace(scene.safety, reaction=max(scene.safety.reaction, late))
    left = replace(whole_safety, reaction=whole_safety.reaction - late)
    with input_errors("safety"):
        moments, full = (
            moments_of_scene(scene, terms)
            if record is None
            else moments_of_record(scene.robot, record, terms)
            for terms in (left, whole_safety)
        )
    return SafetyMotion(moments, full, whole_safety, timing, assumed)


def _rates(
    setup: Setup, scene: Scene, options: SafetyOptions, visited: Scene
) -> tuple[list[float], bool]:
    """Return the readings of each ring's sensors per second, and whether any is assumed."""
    if options.scheduled:
        rings = firing_schedule("", setup, visited, FiringOptions()).rings
        return [r.rate_hz for r in rings], any(r.assumed for r in rings)
    rates = [
        options.rate or readings_hz(scene.electronics, r.sensor, r.count, r.radius)
        for r in setup.groups
    ]
    return [rate or ASSUMED_HZ for rate in rates], any(rate is None for rate in rates)


def simulate(
    name: str,
    setup: Setup,
    scene: Scene,
    motion: SafetyMotion,
    options: SafetyOptions,
    progress: Callable[[int, int], None],
) -> SimulatedApproaches:
    """Simulate people who walk in from all sides while the robot moves.

    Args:
        name: name of the setup.
        setup: the setup whose sensors observe.
        scene: scene of the simulation.
        motion: the moments of the motion.
        options: options of the simulation.
        progress: receives the number of finished approaches, from 0, and the number of all.
    """
    began, count, moments = time.perf_counter(), options.approaches, motion.moments
    needed, range_m = motion.full.required, float(sensor_optics(setup)[1].min())
    needed_m = float(needed.max())
    farther = seeing_as_far(setup, needed_m)
    start = start_of(scene.robot, farther, moments)
    azimuths = np.random.default_rng((options.seed, 1)).uniform(0, 2 * np.pi, count)
    occlusion = options.occlusion or ("shadow" if scene.occlusion == "ignore" else scene.occlusion)
    setups = [setup] if range_m >= needed_m else [setup, farther]
    runs: list[Approaches] = []
    for walked in setups:
        done = len(runs) * count

        def tell(n: int, done: int = done) -> None:
            progress(done + n, len(setups) * count)

        tell(0)
        what = (moments, motion.timing, azimuths, options.seed, occlusion, start, tell)
        runs.append(approach(scene, walked, *what))
    first = runs[0]
    reported = np.isfinite(first.report)
    record = SafetyResult(
        setup=name,
        approaches=count,
        moments=len(moments.weight),
        seconds_of_motion=STEP * (len(moments.weight) - 1) if moments.together else None,
        in_time=first.share(),
        if_far_enough=runs[1].share() if len(runs) > 1 else None,
        never_reported=int((~reported).sum()),
        nearest_report_m=float(np.nanmin(first.report)) if reported.any() else None,
        by_direction=_by_direction(first, options.directions),
        separation=motion.separation(scene),
        stops=by_condition(scene.safety.stop_times),
        separation_at_report_m=float(moments.required.max()),
        period_s=float(motion.timing.period.max()),
        latency_s=options.latency,
        rate_assumed=motion.assumed,
        scheduled=options.scheduled,
        range_m=range_m,
        range_needed_m=needed_m,
        range_suffices=motion.full.weight @ (needed.max(axis=1) <= range_m),
        occlusion=occlusion,
        obstacles=tuple(o.name for o in scene.obstacles),
        floor_m=floor_of(scene),
        seed=options.seed,
        sensors=tuple(sensor_records(setup)),
        seconds=time.perf_counter() - began,
    )
    return SimulatedApproaches(record, first, motion, start)


def _by_direction(approaches: Approaches, directions: int) -> tuple[DirectionShare, ...]:
    """Return the share of each sector that has an approach."""
    edges = np.linspace(0, 360, directions + 1)
    degrees = np.degrees(approaches.azimuth) % 360
    sector = np.clip(np.searchsorted(edges, degrees, side="right") - 1, 0, directions - 1)
    return tuple(
        DirectionShare(**vars(approaches.share(here)), from_deg=low, to_deg=high, approaches=n)
        for k, (low, high) in enumerate(pairwise(edges))
        if (n := int((here := sector == k).sum()))
    )
