"""Result of a simulation of approaches: its shares, picture and files."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ._errors import new_files
from ._pictures import Picture, drawn
from ._placement import Placement
from ._safety_conditions import SafetyMotion
from ._scene import Scene
from .coverage.rings.ring import Setup
from .formats.schema.separation_models import SafetyResult
from .formats.writing import write_text
from .reporting import detection_page
from .reporting.detection_figure import picture as detection_picture
from .reporting.pages import csv_text
from .simulation.detection import Approaches, floor_of, walker

FILES = ("README.md", "safety.png", "approaches.csv", "safety.json")


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
        return drawn(lambda file: detection_picture(*what, self.directions, file), path)

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
