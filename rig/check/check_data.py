"""A check with its data: received live, from a recording, or from files."""

from dataclasses import dataclass
from pathlib import Path

from ..recording.recording import RecordingReader
from ..session.gathering import Gathered, replay
from .planned_check import PlannedCheck


@dataclass(frozen=True)
class CheckData:
    """A check that is complete or ended early, and what its rig sent."""

    check: PlannedCheck
    """The planned check."""
    gathered: Gathered
    """Data received."""
    wall: float
    """Start of the recording, s since 1970."""
    damage: str = ""
    """Damage of the recording; empty if it is intact."""
    file: Path | None = None
    """The recording; None for data from files."""

    @staticmethod
    def replayed(path: Path, thinned: bool = True) -> "CheckData":
        """Read a recording: all of it, or ``thinned`` to what its report needs.

        Raises:
            UserError: if it is no recording of a check.
        """
        recorded = RecordingReader(path)
        check = PlannedCheck.read(str(path), recorded.about.get("check"))
        scene, stale = check.scene, check.stale_s
        gathered = replay(recorded.records(), check.ports, stale, scene.link, thinned, scene.robot)
        return CheckData(check, gathered, recorded.wall, recorded.damage, path)
