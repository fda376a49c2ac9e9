"""Firing schedules: which sensors may fire together, and the rates that follow."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ._arguments import stepwise
from ._errors import input_errors, new_files
from ._options import called_with
from ._pictures import Picture, drawn
from ._placement import Placement
from ._validation import SetupCall, resolve_setup
from .coverage.definitions.definition import json_of
from .coverage.rings.ring import Setup
from .formats.writing import write_text
from .objectives.firing.schedule import FiringSchedule
from .objectives.firing.schedule import firing_schedule as scheduled
from .objectives.options import FiringOptions
from .objectives.scene import Scene

FILES = ("schedule.csv", "schedule.png", "schedule.json")


@dataclass(frozen=True, repr=False)
class FiringReport(Placement):
    """Pairs of sensors that may disturb each other, and slots in which no two of them fire."""

    setup: Setup
    """The rings."""
    scene: Scene
    """Scene with the poses and the bodies."""
    record: FiringSchedule
    """Record that ``place-rings schedule --json`` prints."""
    name: str = "setup"
    """Name of the setup."""

    def plot(self, path: str | Path | None = None) -> Picture:
        """Draw which sensor fires when, ring by ring.

        Args:
            path: path of a PNG file; by default no file is written.

        Returns:
            The picture.

        Raises:
            InputError: if the file cannot be written.
        """
        from .reporting.firing_figure import firing_figure

        return drawn(lambda file: firing_figure(self.record, self.scene.robot, file), path)

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write schedule.csv, schedule.png and schedule.json.

        Args:
            folder: output folder; created if it does not exist.

        Returns:
            The paths of the files.

        Raises:
            InputError: if the folder cannot be written.
        """
        from .reporting.firing_text import firing_rows
        from .reporting.pages import csv_text

        with new_files(folder, *FILES, keep=True) as new:
            write_text(new / "schedule.csv", csv_text(firing_rows(self.record)))
            write_text(new / "schedule.json", json_of(self.record) + "\n")
            self.plot(new / "schedule.png")
        return tuple(Path(folder) / name for name in FILES)

    def rows(self) -> Iterable[Sequence[str]]:
        r = self.record
        yield "pairs that may disturb each other", str(len(r.pairs))
        yield "slots", ", ".join(str(len(group.slots)) for group in r.groups)
        yield "rate of the whole skin", f"{r.rate_hz:.3g} Hz"


@dataclass(frozen=True)
class FiringCall(FiringOptions, SetupCall):
    """A call of ``firing_schedule``."""

    progress: Callable[[int, int], None] | None = field(default=None, kw_only=True)
    """Receives the number of finished poses, from 0, and the number of all."""


@called_with(FiringCall)
def firing_schedule(call: FiringCall) -> FiringReport:
    """Find which sensors may disturb each other, and slots in which no two of them fire together.

    A pair that is not listed is proven apart at all poses of the scene. The rate of a ring follows
    from the slots, the ranging time of its mode and the time of its bus.

    Returns:
        Pairs, slots and rates.

    Raises:
        InputError: for a setup that does not fit the scene, or a value out of range.

    Example:
        >>> import place_rings as pr
        >>> report = pr.firing_schedule("n1_8_0", rate=5)
        >>> report.record.rate_hz < 10
        True
    """
    name, placed, core = resolve_setup(call.setup, call.scene)
    tell = stepwise(call.progress, len(core.poses))
    with input_errors():
        record = scheduled(name, placed, core, call, tell)
    return FiringReport(placed, core, record, name)
