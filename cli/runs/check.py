"""Check a setup on a real, simulated or recorded robot."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...coverage.definitions.errors import UserError
from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import rounded
from ...formats.writing import made_folder
from ...objectives.scene import Scene
from ...reporting.terminal import Terminal, say
from ...rig.check.assessment import assess
from ...rig.check.attendant import EXEMPT, Attendant
from ...rig.check.bag_log import write_bag
from ...rig.check.check_data import CheckData
from ...rig.check.live import LiveCheck
from ...rig.check.offline import file_check
from ...rig.check.options import CheckOptions, FileOptions
from ...rig.check.plans import plan_check, write_plans
from ...rig.check.preconditions import require_revolute
from ...rig.check.report import write_files
from ...rig.recording.recording import RecordingReader
from ...rig.rings.line_monitor import Port
from ..signals import ended_by_signals, gone_is_an_error
from .check_summary import tell


@dataclass(frozen=True)
class Output:
    """Where the report of a check goes, and in which forms."""

    folder: Path
    """Output folder."""
    as_json: bool
    """Print JSON instead of text."""
    bag: bool = False
    """Also write the data as a ROS 2 bag."""

    def report(self, data: CheckData, console: Terminal, more: Sequence[str] = ()) -> int:
        """Assess a check, write its report and, if wanted, its bag; return the exit code of the
        verdict, which counts whatever becomes of the bag. ``more`` names files written before.
        """
        with console.status("assessing"):
            assessment = assess(data)
        files = [*write_files(data.check, assessment, self.folder), *more]
        code = tell(assessment, files, self.folder, self.as_json)
        if self.bag and data.file is not None:
            with console.status("writing the bag"):
                whole = CheckData.replayed(data.file, thinned=False)
                epoch = RecordingReader(data.file).epoch
                files = write_bag(whole.check, whole.gathered, epoch, self.folder)
            say(f"  {self.folder / files[0]}", error=True)
        return code


def check_live(live: LiveCheck, ports: Sequence[Port], out: Output) -> int:
    """Run a check on a robot and write its report; return the exit code of the verdict.

    Args:
        live: the check.
        ports: serial ports of the rings; none for a simulated rig.
        out: where the report goes.
    """
    console = Terminal(stderr=True)
    attendant = Attendant(console)
    if live.host is None:
        attendant.note(EXEMPT)
    for warning in live.warnings:
        attendant.note(f"warning: {warning}")
    with console.status("planning"):
        plans = plan_check(live.setup, live.scene, live.options, live.moved)
    with made_folder(out.folder) as folder:
        files = write_plans(live.scene, plans, folder)
        with gone_is_an_error(), ended_by_signals():
            data = live.record(plans, ports, folder, attendant)
        assert data.file is not None
        try:
            return out.report(data, console, [*files, data.file.name])
        except KeyboardInterrupt:
            text = f"interrupted; the recording is complete: check --replay {data.file} assesses it"
            say(f"place-rings: {text}", error=True)
            raise SystemExit(130) from None


def check_replay(subject: str | None, path: Path, out: Output) -> int:
    """Assess a recording again and write its report; ``subject`` is the setup that must have been
    recorded, None for any. Return the exit code of the verdict.
    """
    console = Terminal(stderr=True)
    with console.status("reading"):
        data = CheckData.replayed(path)
    if subject not in (None, data.check.name):
        raise UserError(
            f"{path}: found a recording of {data.check.name}, allowed: a recording of {subject}"
        )
    with made_folder(out.folder):
        return out.report(data, console)


def check_files(
    name: str, setup: Setup, scene: Scene, files: FileOptions, options: CheckOptions, out: Output
) -> int:
    """Assess a check from files and write its report; return the exit code of the verdict."""
    console = Terminal(stderr=True)
    with console.status("reading"):
        data = file_check(name, setup, scene, files, options)
    with made_folder(out.folder):
        return out.report(data, console)


def write_only(setup: Setup, scene: Scene, options: CheckOptions, out: Path) -> None:
    """Write the plans of a check that another program runs, and print the names of the files.

    Raises:
        UserError: if no plan is possible.
    """
    if options.parts == ("self",):
        raise UserError(
            "--plan-only: found --part self, wanted: mount or coverage, which have plans"
        )
    require_revolute(scene.robot)
    with Terminal(stderr=True).status("planning"):
        plans = plan_check(rounded(setup, scene.sensor), scene, options, moved=True)
    with made_folder(out) as folder:
        for file in write_plans(scene, plans, folder):
            say(str(folder / file))
