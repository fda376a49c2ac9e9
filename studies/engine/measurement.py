"""Header line of a results page: the version that its figures hold for, and how they were measured.

A page belongs to a release: its figures hold for the version that it names until the next one is
measured.
"""

import os
import platform
import subprocess
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import psutil

from ...formats.writing import write_text

_ROOT = Path(__file__).resolve().parents[2]  # folder of the rooms, in a checkout and installed
_COMMIT_DIGITS = 12
# without results/, whose pages a measurement itself writes
_STATUS = ("status", "--porcelain", "--untracked-files=no", "--", ".", ":(exclude)results")


@dataclass(frozen=True)
class Measurement:
    """Circumstances of a measurement, read when it begins."""

    command: str
    """Command that measures the page again."""
    version: str
    """Version of place-rings."""
    commit: str | None
    """Commit of the checkout, with ``+`` if tracked files outside results/ differ from it; None
    outside one."""
    date: str
    """Day of its beginning, UTC."""
    processor: str
    """Model of the processor, and number of cores."""
    load: float
    """Load average per core of the minute before it began."""

    @classmethod
    def begin(cls, command: str, root: Path = _ROOT) -> "Measurement":
        """Read version, commit, date, processor and load.

        Args:
            command: command that measures the page again.
            root: folder of the checkout; by default that of the rooms.
        """
        cores = os.cpu_count() or 1
        return cls(
            command,
            version("place-rings"),
            _commit(root),
            datetime.now(UTC).strftime("%Y-%m-%d"),
            f"{_processor()}, {cores} cores",
            psutil.getloadavg()[0] / cores,
        )

    @property
    def header(self) -> str:
        """The line below a page's title."""
        commit = f", commit `{self.commit}`" if self.commit else ""
        return (
            f"Version {self.version}{commit}, {self.date}, {self.processor},"
            f" load per core {self.load:.2f}: `{self.command}`"
        )

    def head(self, page: Path, kept: int = 0, note: str = "") -> None:
        """Write the header below the title of a page of Markdown.

        Args:
            page: the page.
            kept: number of its measurements that earlier runs had stored, with another date or
                commit than the header's.
            note: more to state at the end of the header.
        """
        title, _, rest = page.read_text("utf-8").partition("\n")
        earlier = f"; {kept} measurements are from earlier runs of this version" if kept else ""
        write_text(page, f"{title}\n\n{self.header}{earlier}{note}\n{rest}")


def _processor() -> str:
    """Return the model of the processor as the system names it."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.machine())


def _commit(root: Path) -> str | None:
    """Return the commit of a checkout; None if the folder is none."""
    if not (root / ".git").exists():
        return None
    git = ["git", "-C", str(root)]
    try:
        head, changes = (
            subprocess.run([*git, *words], capture_output=True, text=True, check=True).stdout
            for words in (("rev-parse", "HEAD"), _STATUS)
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return head[:_COMMIT_DIGITS] + ("+" if changes else "")
