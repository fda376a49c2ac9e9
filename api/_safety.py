"""Detection in time: the share of approaching people that a setup reports soon enough."""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from ._errors import InputError, input_errors, new_files
from ._options import called_with
from ._pictures import Picture, drawn
from ._placement import Placement
from ._scene import Scene
from ._trajectory import Trajectory
from ._validation import SetupCall, SetupLike, resolve_setup
from .coverage.electronics.electronics import readings_hz
from .coverage.occlusion.occlusion_mode import Occlusion
from .coverage.rings.ring import Setup, sensor_optics
from .coverage.rings.sensor_records import sensor_records
from .coverage.robots.separation_distance import Safety, separation, stopping_time
from .formats.schema.separation_models import (
    DirectionModel,
    SafetyResult,
    ShareModel,
)
from .formats.writing import write_text
from .objectives.scene import Scene as CoreScene
from .objectives.separation_summary import Separations
from .reporting import detection_page
from .reporting.detection_figure import detection_figure
from .reporting.pages import csv_text
from .simulation.detection import (
    Approaches,
    Timing,
    approach,
    floor_of,
    seeing_as_far,
    start_of,
    walker,
)
from .simulation.motion_samples import STEP, Moments, moments_of_record, moments_of_scene
from .simulation.safety_options import SafetyOptions

FILES = ("README.md", "safety.png", "approaches.csv", "safety.json")
_ASSUMED_HZ = 20.0  # where no rate is known


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


def motion_of(
    setup: Setup, scene: CoreScene, trajectory: Trajectory | None, options: SafetyOptions
) -> SafetyMotion:
    """Return the moments of a motion, and the timing of the sensors.

    The simulation accounts for period and latency; the rest of the reaction time T_r stays in S.

    Raises:
        InputError: for a motion that does not fit the robot, or a robot without a stopping time.
    """
    rates = [
        options.rate or readings_hz(scene.electronics, r.sensor, r.count, r.radius)
        for r in setup.groups
    ]
    period = np.repeat(
        [1 / (rate or _ASSUMED_HZ) for rate in rates], [r.count for r in setup.groups]
    )
    timing = Timing(period, options.latency)
    late = float(timing.spent.max())
    whole_safety = replace(scene.safety, reaction=max(scene.safety.reaction, late))
    left = replace(whole_safety, reaction=whole_safety.reaction - late)
    record = None if trajectory is None else trajectory.record(scene.robot)
    with input_errors("safety"):
        moments, full = (
            moments_of_scene(scene, one)
            if record is None
            else moments_of_record(scene.robot, record, one)
            for one in (left, whole_safety)
        )
    return SafetyMotion(moments, full, whole_safety, timing, any(rate is None for rate in rates))


@dataclass(frozen=True, repr=False)
class SafetyReport(Placement):
    """Share of simulated approaches of a person that a setup reports in time.

    It is an engineering aid and confers no safety rating.
    """

    setup: Setup
    """The rings."""
    scene: Scene
    """Scene of the simulation."""
    record: SafetyResult
    """Record that ``place-rings safety --json`` prints."""
    approaches: Approaches
    """The simulated approaches."""
    motion: SafetyMotion
    """The moments of the motion."""
    start: float
    """Distance from the base's axis at which walks begin, m."""
    name: str = "setup"
    """Name of the setup."""
    command: str = "place_rings.safety(...)"
    """The call or the command that ran the simulation."""
    directions: int = 12
    """Number of sectors with a share of their own."""

    @property
    def in_time(self) -> float:
        """Share of the approaches reported in time, in [0, 1]."""
        return self.record.in_time.percent / 100

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval (Wilson) of that share, in [0, 1]."""
        share = self.record.in_time
        return share.low_percent / 100, share.high_percent / 100

    def plot(self, path: str | Path | None = None) -> Picture:
        """Draw shares by direction, distances at first reports, and the latest reports.

        Args:
            path: path of a PNG file; by default no file is written.

        Returns:
            The picture.

        Raises:
            InputError: if the file cannot be written.
        """
        core, floor = self.scene.core, floor_of(self.scene.core)
        person = walker(core.safety.human, self.start, floor)
        what = (core.robot, self.setup, self.motion.moments, self.approaches, person, floor)
        return drawn(lambda file: detection_figure(*what, self.directions, file), path)

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write README.md, safety.png, approaches.csv and safety.json.

        Args:
            folder: output folder; created if it does not exist.

        Returns:
            The paths of the files.

        Raises:
            InputError: if the folder cannot be written.
        """
        rows = detection_page.rows(self.approaches, self.motion.moments)
        with new_files(folder, *FILES, keep=True) as new:
            write_text(new / "README.md", detection_page.page(self.record, self.command))
            write_text(new / "safety.json", self.record.model_dump_json(indent=2) + "\n")
            write_text(new / "approaches.csv", csv_text(rows))
            self.plot(new / "safety.png")
        return tuple(Path(folder) / name for name in FILES)

    def rows(self) -> Iterable[Sequence[str]]:
        r = self.record
        low, high = r.in_time.low_percent, r.in_time.high_percent
        yield "reported in time", f"{r.in_time.percent:.1f} % ({low:.1f} to {high:.1f})"
        yield "not before contact", f"{r.never_reported} of {r.approaches}"
        yield "range of the sensors", f"{r.range_m:.2f} m, needed: {r.range_needed_m:.2f} m"


@dataclass(frozen=True)
class SafetyCall(SafetyOptions, SetupCall):
    """A call of ``safety``."""

    trajectory: Trajectory | None = field(default=None, kw_only=True)
    """Recorded motion of the robot; by default it stays in each of the scene's poses."""
    progress: Callable[[int, int], None] | None = field(default=None, kw_only=True)
    """Receives the number of finished approaches, from 0, and the number of all."""


@called_with(SafetyCall)
def safety(call: SafetyCall) -> SafetyReport:
    """Simulate people who walk in from all sides while the robot moves, and count how many are
    reported before they are closer than the separation distance of ISO/TS 15066.

    The result is an engineering aid and confers no safety rating. Choose the sensor with its
    effective range on dark clothes, such as
    ``pr.sensors.under("vl53l1x", reflectance=0.17, target_size=(0.45, 0.7))``.

    Returns:
        The share of approaches reported in time.

    Raises:
        InputError: for a setup that does not fit the scene, a robot without a stopping time, or a
            value out of range.

    Example:
        >>> import place_rings as pr
        >>> report = pr.safety("n1_8_0", approaches=16)
        >>> 0 <= report.in_time <= 1
        True
    """
    tell = call.progress or (lambda done, total: None)
    return simulated(call.setup, call.scene, call.trajectory, call, tell)


def occlusion_of(scene: CoreScene, options: SafetyOptions) -> Occlusion:
    """Return the model of occlusion of a simulation: the scene's, unless another is stated."""
    return options.occlusion or ("shadow" if scene.occlusion == "ignore" else scene.occlusion)


def simulated(
    setup: SetupLike,
    scene: Scene | CoreScene | None,
    trajectory: Trajectory | None,
    options: SafetyOptions,
    progress: Callable[[int, int], None],
) -> SafetyReport:
    """Simulate approaches to a setup; see ``safety``."""
    began, seed, count = time.perf_counter(), options.seed, options.approaches
    name, placed, core = resolve_setup(setup, scene)
    with input_errors("safety"):  # before any work, for a robot without a stopping time
        stopping_time(core.safety, core.robot.name, 0.0)
    if not isinstance(trajectory, Trajectory | None):
        raise InputError(f"found {trajectory!r}, allowed: a Trajectory", "trajectory")
    motion = motion_of(placed, core, trajectory, options)
    needed, range_m = float(motion.full.asked.max()), float(sensor_optics(placed)[1].min())
    farther = seeing_as_far(placed, needed)
    start = start_of(core.robot, farther, motion.moments)
    azimuths = np.random.default_rng((seed, 1)).uniform(0, 2 * np.pi, count)
    setups = [placed] if range_m >= needed else [placed, farther]
    runs: list[Approaches] = []
    for walked in setups:
        done = len(runs) * count

        def tell(n: int, done: int = done) -> None:
            progress(done + n, len(setups) * count)

        tell(0)
        occlusion = occlusion_of(core, options)
        walks = (motion.timing, core.safety.human, azimuths, seed, occlusion, start, tell)
        cell = (tuple(o.body for o in core.obstacles), floor_of(core))
        runs.append(approach(core.robot, walked, motion.moments, *walks, *cell))
    return SafetyReport(
        placed,
        Scene.of(core),
        _record(name, placed, core, options, motion, runs, began),
        runs[0],
        motion,
        start,
        name,
        f"place_rings.safety(..., seed={seed})",
        options.directions,
    )


def _share(approaches: Approaches, some: slice | np.ndarray = slice(None)) -> dict[str, float]:
    share, low, high = approaches.share(some)
    return {"percent": 100 * share, "low_percent": 100 * low, "high_percent": 100 * high}


def _by_direction(approaches: Approaches, directions: int) -> list[DirectionModel]:
    """Return the share of each sector that has an approach."""
    edges = np.linspace(0, 360, directions + 1)
    degrees = np.degrees(approaches.azimuth) % 360
    sector = np.clip(np.searchsorted(edges, degrees, side="right") - 1, 0, directions - 1)
    return [
        DirectionModel(
            from_deg=low,
            to_deg=high,
            approaches=int((sector == k).sum()),
            **_share(approaches, sector == k),
        )
        for k, (low, high) in enumerate(pairwise(edges))
        if (sector == k).any()
    ]


def _separation(scene: CoreScene, motion: SafetyMotion) -> Separations:
    """Return the record of the separation distances."""
    terms, fastest = motion.safety, float(motion.full.speed.max())
    return Separations.of(
        terms,
        separation(terms, fastest, stopping_time(terms, scene.robot.name, fastest)),
        float(motion.full.asked.min()),
        float(motion.moments.weight @ motion.full.asked.mean(axis=1)),
        fastest,
        motion.moments.together or all(p.rate is not None for p in scene.poses),
    )


def _record(
    name: str,
    setup: Setup,
    scene: CoreScene,
    options: SafetyOptions,
    motion: SafetyMotion,
    simulated: Sequence[Approaches],
    began: float,
) -> SafetyResult:
    """Return the record of a simulation.

    Args:
        name: name of the setup.
        setup: the rings.
        scene: scene of the simulation.
        options: options of the simulation.
        motion: the moments of the motion.
        simulated: approaches to the setup, and to the same with a range that suffices.
        began: clock reading at the start, s.
    """
    first, moments, needed = simulated[0], motion.moments, motion.full.asked
    range_m = float(sensor_optics(setup)[1].min())
    suffices = float(motion.full.weight @ (needed.max(axis=1) <= range_m))
    reported = np.isfinite(first.report)
    return SafetyResult(
        setup=name,
        approaches=options.approaches,
        moments=len(moments.weight),
        seconds_of_motion=STEP * (len(moments.weight) - 1) if moments.together else None,
        in_time=ShareModel(**_share(first)),
        if_far_enough=ShareModel(**_share(simulated[1])) if len(simulated) > 1 else None,
        never_reported=int((~reported).sum()),
        nearest_report_m=float(np.nanmin(first.report)) if reported.any() else None,
        by_direction=_by_direction(first, options.directions),
        separation=_separation(scene, motion),
        separation_at_report_m=float(moments.asked.max()),
        period_s=float(motion.timing.period.max()),
        latency_s=options.latency,
        rate_assumed=motion.assumed,
        range_m=range_m,
        range_needed_m=float(needed.max()),
        range_suffices_percent=min(100 * suffices, 100.0),  # the weights' sum is rounded
        occlusion=occlusion_of(scene, options),
        obstacles=[o.name for o in scene.obstacles],
        floor_m=floor_of(scene),
        seed=options.seed,
        sensors=sensor_records(setup),
        disclaimer=detection_page.DISCLAIMER,
        seconds=time.perf_counter() - began,
    )
