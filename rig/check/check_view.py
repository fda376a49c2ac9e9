"""Live view of a check: distances and state of each ring, the robot, and the progress."""

import time
from contextlib import suppress

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from ...coverage.rings.ring import Setup
from ..rings.protocol import Frame, Status
from ..robot.vetting import LinkFaultError
from ..session.session import Session
from .models import DISCLAIMER
from .options import Part
from .planned_check import ring_names
from .procedure import EndedError

_BARS = "█▇▆▅▄▃▂▁"  # near to far
_PARTS = {"self": "self check", "mount": "mount check", "coverage": "coverage check"}
_RATE = 4  # updates per second


def bars(frame: Frame | None, range_m: float) -> Text:
    """Return one character for each sensor: a higher bar is nearer, a dot is no target, x a
    failure.
    """
    text = Text()
    if frame is None:
        return Text("no data", style="red")
    for distance, status in zip(frame.distance, frame.status, strict=True):
        if status == Status.FAILED:
            text.append("x", style="red")
        elif np.isnan(distance):
            text.append("·", style="dim")
        else:
            share = min(max(float(distance) / range_m, 0.0), 0.999)
            text.append(
                _BARS[int(share * len(_BARS))], style="yellow" if distance < 0.15 * range_m else ""
            )
    return text


class CheckView:
    """Live view of a session, with questions to the person at the rig."""

    def __init__(self, session: Session, setup: Setup, console: Console) -> None:
        self._session, self._console, self._names = session, console, ring_names(setup)
        self._ranges = [group.sensor.range_m for group in setup.groups]
        self._part, self._done, self._of, self._said = "", 0, 1, ""
        self._begin = time.monotonic()
        self._live = Live(
            get_renderable=self.table,
            console=console,
            refresh_per_second=_RATE,
            transient=True,
            redirect_stdout=False,
        )

    def __enter__(self) -> "CheckView":
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(OSError):  # the terminal may be gone
            self._live.stop()

    def show(self, part: Part, done: int, of: int) -> None:
        """Show that ``done`` of ``of`` steps are done; without a terminal, print each new part."""
        if not self._console.is_terminal and part != self._said:
            with suppress(OSError):
                self._console.print(f"{_PARTS[part]} …", highlight=False)
        self._part, self._done, self._of, self._said = _PARTS[part], done, of, part

    def ask(self, words: str) -> bool:
        """Tell a person what to do, and wait for the answer.

        Returns:
            True for Enter (done), False for s (skip).

        Raises:
            EndedError: for q, or at the end of the input.
        """
        answer = self._answer(f"{words}\n  Enter: done, s: skip, q: end the check > ", "q")
        if answer == "q":
            raise EndedError("ended by the user")
        return answer != "s"

    def resume(self, words: str) -> bool:
        """Tell a person why the robot was stopped; return whether it may go on: only with yes."""
        return self._answer(f"{words}\n  Type yes to let it go on > ", "") == "yes"

    def _answer(self, words: str, otherwise: str) -> str:
        """Return the answer to a question; ``otherwise`` at the end of the input."""
        try:
            self._live.stop()
            answer = self._console.input(Text(words)).strip().lower()
        except (EOFError, OSError, UnicodeDecodeError):
            answer = otherwise
        if self._console.is_terminal:
            self._live.start()
        return answer

    def table(self) -> Group:
        """Return the table, the progress and the disclaimer."""
        seconds = max(time.monotonic() - self._begin, 1e-3)
        table = Table(title=f"{self._robot()}, {seconds:.0f} s", title_justify="left")
        for name in ("ring", "frames/s", "lost", "late", "corrupt", "nearest, m"):
            table.add_column(name, justify="left" if name == "ring" else "right")
        table.add_column("sensors, as wired")
        rings = zip(
            self._names,
            self._session.rings.latest(),
            self._session.rings.counts,
            self._ranges,
            strict=True,
        )
        for name, frame, c, range_m in rings:
            near = np.inf if frame is None else np.nanmin(frame.distance, initial=np.inf)
            cells = (f"{c.frames / seconds:.1f}", str(c.lost), str(c.late), str(c.corrupt))
            table.add_row(
                name, *cells, f"{near:.3f}" if near < np.inf else "", bars(frame, range_m)
            )
        line = Table.grid(padding=(0, 1))
        line.add_row(
            self._part, ProgressBar(self._of, self._done, width=40), f"{self._done} of {self._of}"
        )
        foreign = [
            Text(f"{name}: the first foreign line: {c.foreign}")
            for name, c in zip(self._names, self._session.rings.counts, strict=True)
            if c.foreign
        ]
        return Group(table, *foreign, line, Text(DISCLAIMER, style="dim"))

    def _robot(self) -> str:
        try:
            q = np.degrees(self._session.link.latest().q)
        except LinkFaultError as fault:
            return f"robot: {fault}"
        return "robot at " + ", ".join(f"{a:.1f}" for a in q) + "°"
