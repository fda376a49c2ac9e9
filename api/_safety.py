"""Detection in time: the share of approaching people that a setup reports soon enough."""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import get_args

import numpy as np

from ._arguments import number, whole
from ._errors import InputError, input_errors, writable
from ._pictures import Picture, png_of
from ._placement import Placement
from ._scene import Scene
from ._trajectory import Trajectory
from ._validation import SetupLike, resolve_setup
from .coverage.occlusion.occlusion_mode import Occlusion
from .coverage.rings.ring import Setup, sensor_optics
from .coverage.robots.separation_distance import Safety, separation, stopping_time
from .coverage.sensors.catalogue import model_of
from .formats.schema.sensor_records import sensor_records
from .formats.schema.separation_models import (
    DirectionModel,
    SafetyResult,
    SeparationModel,
    ShareModel,
)
from .formats.writing import write_bytes, write_text
from .objectives.scene import CoreScene
from .reporting import detection_page
from .reporting.detection_figure import picture as detection_picture
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

ASSUMED_HZ = 20.0  # where the catalogue has no rate
FILES = ("README.md", "safety.png", "approaches.csv", "safety.json")
_MOST_APPROACHES, _MOST_DIRECTIONS, _MOST_HZ, _MOST_LATENCY = 100_000, 360, 10_000, 5


@dataclass(frozen=True)
class _Options:
    """How approaches are drawn and reported."""

    approaches: int
    """Number of approaches."""
    directions: int
    """Number of sectors with a share of their own."""
    rate: float | None
    """Readings of each sensor, Hz; None for the catalogue's."""
    latency: float
    """Time from a reading to the report, s."""
    occlusion: Occlusion
    """Model of occlusion."""
    seed: int
    """Random seed."""

    def check(self) -> None:
        """Check the options.

        Raises:
            InputError: for a value out of range.
        """
        whole("approaches", self.approaches, 1, _MOST_APPROACHES)
        whole("directions", self.directions, 1, _MOST_DIRECTIONS)
        whole("seed", self.seed, 0)
        if self.rate is not None:
            number("rate", self.rate, "Hz, above 0")
            if not 0 < self.rate <= _MOST_HZ:
                raise InputError(f"found {self.rate:g}, allowed: Hz, 0 to {_MOST_HZ:,}", "rate")
        number("latency", self.latency, "s, 0 or more")
        if not 0 <= self.latency <= _MOST_LATENCY:
            raise InputError(f"found {self.latency:g}, allowed: s, 0 to {_MOST_LATENCY}", "latency")
        if self.occlusion not in get_args(Occlusion):
            allowed = ", ".join(get_args(Occlusion))
            raise InputError(f"found {self.occlusion!r}, allowed: {allowed}", "occlusion")


@dataclass(frozen=True)
class _Motion:
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
    motion: _Motion
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
        with input_errors():
            png = png_of(lambda file: detection_picture(*what, self.directions, file))
            if path is not None:
                write_bytes(Path(path), png)
        return Picture(png, None if path is None else Path(path))

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write README.md, safety.png, approaches.csv and safety.json.

        Args:
            folder: output folder; created if it does not exist.

        Returns:
            The paths of the files.

        Raises:
            InputError: if the folder cannot be written.
        """
        out = writable(folder)
        self.plot(out / "safety.png")
        rows = detection_page.rows(self.approaches, self.motion.moments)
        with input_errors():
            write_text(out / "approaches.csv", csv_text(rows))
            write_text(out / "safety.json", self.record.model_dump_json(indent=2) + "\n")
            write_text(out / "README.md", detection_page.page(self.record, self.command))
        return tuple(out / name for name in FILES)

    def rows(self) -> Iterable[Sequence[str]]:
        r = self.record
        low, high = r.in_time.low_percent, r.in_time.high_percent
        yield "reported in time", f"{r.in_time.percent:.1f} % ({low:.1f} to {high:.1f})"
        yield "not before contact", f"{r.never_reported} of {r.approaches}"
        yield "range of the sensors", f"{r.range_m:.2f} m, needed: {r.range_needed_m:.2f} m"


def safety(
    setup: SetupLike,
    scene: Scene | CoreScene | None = None,
    *,
    trajectory: Trajectory | None = None,
    approaches: int = 720,
    directions: int = 12,
    rate: float | None = None,
    latency: float = 0.02,
    occlusion: Occlusion | None = None,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> SafetyReport:
    """Simulate people who walk in from all sides while the robot moves, and count how many are
    reported before they are closer than the separation distance of ISO/TS 15066.

    The result is an engineering aid and confers no safety rating. Choose the sensor with its
    effective range on dark clothes, such as
    ``pr.sensors.under("vl53l1x", reflectance=0.17, target_size=(0.45, 0.7))``.

    Args:
        setup, scene: as in ``verify``.
        trajectory: recorded motion of the robot; by default it stays in each of the scene's poses.
        approaches: number of people, 1 to 100,000.
        directions: number of sectors with a share of their own, 1 to 360.
        rate: readings of each sensor, Hz; by default the catalogue's, or 20.
        latency: time from a reading to the report, s, 0 to 5.
        occlusion: model of occlusion; by default the scene's, with ``shadow`` for ``ignore``.
        seed: random seed of directions and moments.
        progress: receives the number of finished approaches, from 0, and the number of all.

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
    began = time.perf_counter()
    name, placed, core = resolve_setup(setup, scene)
    own: Occlusion = "shadow" if core.occlusion == "ignore" else core.occlusion
    options = _Options(approaches, directions, rate, latency, occlusion or own, seed)
    options.check()
    with input_errors("safety"):  # before any work, for a robot without a stopping time
        stopping_time(core.safety, core.robot.name, 0.0)
    if not isinstance(trajectory, Trajectory | None):
        raise InputError(f"found {trajectory!r}, allowed: a Trajectory", "trajectory")
    motion = _motion(placed, core, trajectory, options)
    needed, range_m = float(motion.full.asked.max()), float(sensor_optics(placed)[1].min())
    farther = seeing_as_far(placed, needed)
    start = start_of(core.robot, farther, motion.moments)
    azimuths = np.random.default_rng((seed, 1)).uniform(0, 2 * np.pi, approaches)
    setups = [placed] if range_m >= needed else [placed, farther]
    simulated: list[Approaches] = []
    for one in setups:
        done = len(simulated) * approaches

        def tell(n: int, done: int = done) -> None:
            if progress is not None:
                progress(done + n, len(setups) * approaches)

        tell(0)
        walks = (motion.timing, core.safety.human, azimuths, seed, options.occlusion, start, tell)
        cell = (tuple(o.body for o in core.obstacles), floor_of(core))
        simulated.append(approach(core.robot, one, motion.moments, *walks, *cell))
    record = _record(name, placed, core, options, motion, simulated, began)
    return SafetyReport(
        placed,
        Scene.of(core),
        record,
        simulated[0],
        motion,
        start,
        name,
        f"place_rings.safety(..., seed={seed})",
        directions,
    )


def _motion(
    setup: Setup, scene: CoreScene, trajectory: Trajectory | None, options: _Options
) -> _Motion:
    """Return the moments of a motion, and the timing of the sensors.

    The simulation accounts for period and latency; the rest of the reaction time T_r stays in S.

    Raises:
        InputError: for a motion that does not fit the robot, or a robot without a stopping time.
    """
    rates = [
        options.rate or (model_of(r.sensor.use).rate_hz if r.sensor.use else None)
        for r in setup.groups
    ]
    period = np.repeat(
        [1 / (rate or ASSUMED_HZ) for rate in rates], [r.count for r in setup.groups]
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
    return _Motion(moments, full, whole_safety, timing, any(rate is None for rate in rates))


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


def _separation(scene: CoreScene, motion: _Motion) -> SeparationModel:
    """Return the record of the separation distances."""
    terms, fastest = motion.safety, float(motion.full.speed.max())
    return SeparationModel.from_domain(
        separation(terms, fastest, stopping_time(terms, scene.robot.name, fastest)),
        least_m=float(motion.full.asked.min()),
        mean_m=float(motion.moments.weight @ motion.full.asked.mean(axis=1)),
        fastest_m_s=fastest,
        speeds_known=motion.moments.together or all(p.rate is not None for p in scene.poses),
        human_speed=terms.human,
        reaction_s=terms.reaction,
    )


def _record(
    name: str,
    setup: Setup,
    scene: CoreScene,
    options: _Options,
    motion: _Motion,
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
        occlusion=options.occlusion,
        obstacles=[o.name for o in scene.obstacles],
        floor_m=floor_of(scene),
        seed=options.seed,
        sensors=sensor_records(setup),
        disclaimer=detection_page.DISCLAIMER,
        seconds=time.perf_counter() - began,
    )
