"""Detection in time: the share of approaching people that a setup reports soon enough."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory

from ._arguments import check_question
from ._errors import InputError, input_errors, new_files
from ._options import called_with
from ._pictures import Picture, drawn
from ._placement import Placement
from ._trajectory import Trajectory
from ._validation import SetupCall, resolve_setup
from ._versions import versions
from .coverage.definitions.definition import json_of
from .coverage.detection.detection import Detection
from .coverage.rings.ring import Setup
from .coverage.robots.separation_distance import stopping_time
from .formats.model_reader import read_model
from .formats.stop_times import read_stop_times
from .formats.writing import write_text
from .objectives.scene import Scene
from .reporting import detection_page
from .reporting.detection_figure import detection_figure
from .reporting.dossier.floor_picture import floor_picture
from .reporting.dossier.page import PICTURE, heading, page
from .reporting.pages import csv_text, html
from .simulation.detection import floor_of, walker
from .simulation.dossier.capability import capability_of
from .simulation.dossier.dossier import Dossier, dossier_of
from .simulation.dossier.floor import floor_grid, floor_record
from .simulation.dossier.statements import Statements
from .simulation.safety import SimulatedApproaches, motion_of, simulate
from .simulation.safety_options import SafetyOptions

FILES = ("README.md", "safety.png", "approaches.csv", "safety.json")
DOSSIER = ("dossier.html", "dossier.json")


@dataclass(frozen=True, repr=False, kw_only=True)
class SafetyReport(Placement, SimulatedApproaches):
    """Share of simulated approaches of a person that a setup reports in time.

    It is an engineering aid and confers no safety rating.
    """

    setup: Setup
    """The rings."""
    scene: Scene
    """Scene of the simulation."""
    name: str = "setup"
    """Name of the setup."""
    command: str = "place_rings.safety(...)"
    """The call or the command that ran the simulation."""
    options: SafetyOptions = field(default_factory=SafetyOptions)
    """How approaches were drawn and reported."""
    detect: Detection | None = None
    """What is to be detected, for the dossier."""

    @property
    def directions(self) -> int:
        """Number of sectors with a share of their own."""
        return self.options.directions

    @property
    def in_time(self) -> float:
        """Share of the approaches reported in time, in [0, 1]."""
        return self.record.in_time.share

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval (Wilson) of that share, in [0, 1]."""
        return self.record.in_time.low, self.record.in_time.high

    def plot(self, path: str | Path | None = None) -> Picture:
        """Draw shares by direction, distances at first reports, and the latest reports.

        Args:
            path: path of a PNG file; by default no file is written.

        Returns:
            The picture.

        Raises:
            InputError: if the file cannot be written.
        """
        core, floor = self.scene, floor_of(self.scene)
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
            write_text(new / "safety.json", json_of(self.record) + "\n")
            write_text(new / "approaches.csv", csv_text(rows))
            self.plot(new / "safety.png")
        return tuple(Path(folder) / name for name in FILES)

    def dossier(
        self, folder: str | Path, statements: str | Path | Statements | None = None
    ) -> Dossier:
        """Write dossier.html and dossier.json: separation distances, stops, undetected access,
        what the sensors can detect, performance levels, and what is open.

        Args:
            folder: output folder; created if it does not exist.
            statements: what the user states, or a TOML file of it.

        Returns:
            The record in dossier.json.

        Raises:
            InputError: if the folder cannot be written, or the statements cannot be read.
        """
        stated = stated_in(statements)
        core, m = self.scene, self.motion
        floor = floor_grid(core, self.setup, m.full, self.record.occlusion)
        summary = floor_record(floor, len(m.full.weight))
        with input_errors():
            capability = capability_of(
                core, self.setup, m.full, self.record.occlusion, self.options, self.detect
            )
        what = (self.setup, core, self.options, self.record, m.safety, summary, capability, stated)
        record = dossier_of(*what)
        with new_files(folder, *DOSSIER, keep=True) as new, TemporaryDirectory() as pictures:
            floor_picture(core.robot, m.full, floor, Path(pictures) / PICTURE)
            created = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
            text = page(record, self.command, versions()["place-rings"], created)
            write_text(new / DOSSIER[0], html(text, Path(pictures), heading(record)))
            write_text(new / DOSSIER[1], json_of(record) + "\n")
        return record

    def rows(self) -> Iterable[Sequence[str]]:
        r, share = self.record, self.record.in_time
        between = f"{100 * share.low:.1f} to {100 * share.high:.1f}"
        yield "reported in time", f"{100 * share.share:.1f} % ({between})"
        yield "not before contact", f"{r.never_reported} of {r.approaches}"
        yield "range of the sensors", f"{r.range_m:.2f} m, needed: {r.range_needed_m:.2f} m"


@dataclass(frozen=True)
class SafetyCall(SafetyOptions, SetupCall):
    """A call of ``safety``."""

    stop_times: str | Path | None = field(default=None, kw_only=True)
    """CSV file of measured stops of the robot, in place of the scene's stopping times."""
    trajectory: Trajectory | None = field(default=None, kw_only=True)
    """Recorded motion of the robot; by default it stays in each of the scene's poses."""
    detect: Detection | None = field(default=None, kw_only=True)
    """For the dossier: compute the expected share of each target in which a test piece is detected
    in time."""
    progress: Callable[[int, int], None] | None = field(default=None, kw_only=True)
    """Receives the number of finished approaches, from 0, and the number of all."""


def stated_in(statements: str | Path | Statements | None) -> Statements:
    """Return what the user states, or what a TOML file of it does.

    Raises:
        InputError: if the file cannot be read or is not valid.
    """
    if statements is None or isinstance(statements, Statements):
        return statements or Statements()
    with input_errors():
        return read_model(Path(statements), Statements)


@called_with(SafetyCall)
def safety(call: SafetyCall) -> SafetyReport:
    """Simulate people who walk in from all sides while the robot moves, and count how many are
    reported before they are closer than the separation distance of ISO 10218-2:2025 (form of
    ISO/TS 15066).

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
    check_question(call.detect)
    name, placed, core = resolve_setup(call.setup, call.scene)
    if call.stop_times is not None:
        with input_errors():
            measured = read_stop_times(Path(call.stop_times), core.robot)
        own = replace(core.safety, stopping=None, stop_times=measured)
        core = replace(core, safety=own)
    with input_errors("safety"):  # before any work, for a robot without a stopping time
        stopping_time(core.safety, core.robot.name, 0.0)
    if not isinstance(call.trajectory, Trajectory | None):
        raise InputError(f"found {call.trajectory!r}, allowed: a Trajectory", "trajectory")
    record = None if call.trajectory is None else call.trajectory.record(core.robot)
    moving = call.scheduled and call.trajectory is not None
    visited = core.replace(poses=call.trajectory) if moving else core
    motion = motion_of(placed, core, record, call, visited)
    tell = call.progress or (lambda done, total: None)
    return SafetyReport(
        **vars(simulate(name, placed, core, motion, call, tell)),
        setup=placed,
        scene=core,
        name=name,
        command=f"place_rings.safety(..., seed={call.seed})",
        detect=call.detect,
        options=SafetyOptions(**{f.name: getattr(call, f.name) for f in fields(SafetyOptions)}),
    )
