"""Versions of one setup on a page, each with the name that the page and its files show for it."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from ..coverage.rings.ring import Setup

MOST = 200  # versions that are kept
_TOGETHER = 1.0  # s; edits of one control that follow each other faster are one step
_EDITED = ", edited"


@dataclass(frozen=True)
class Version:
    """A setup and what it is."""

    setup: Setup
    """The setup."""
    name: str
    """Its name: of a file or layout, or how it came about."""


class History:
    """The versions of one setup, for undo and redo; the caller holds a lock.

    Args:
        opened: the setup as opened.
        clock: time in s.
    """

    def __init__(self, opened: Version, clock: Callable[[], float] = time.monotonic) -> None:
        self.opened = opened
        self._versions, self._at = [opened], 0
        self._clock = clock
        self._last: tuple[object, float] = (None, 0.0)

    @property
    def now(self) -> Version:
        """The version that is shown."""
        return self._versions[self._at]

    @property
    def undoable(self) -> bool:
        """Whether there is an older version."""
        return self._at > 0

    @property
    def redoable(self) -> bool:
        """Whether there is a version that was undone."""
        return self._at + 1 < len(self._versions)

    def frozen(self) -> "History":
        """Return a copy that no later change reaches."""
        copy = History(self.opened, self._clock)
        copy._versions, copy._at = list(self._versions), self._at
        return copy

    def add(self, version: Version) -> None:
        """Add a version after the present one; those that were undone are dropped."""
        self._last = (None, 0.0)
        if version.setup == self.now.setup:
            return
        self._versions = [*self._versions[: self._at + 1], version][-MOST:]
        self._at = len(self._versions) - 1

    def edit(self, setup: Setup, control: object = None) -> None:
        """Add the setup after an edit.

        Args:
            setup: the edited setup. Where it equals the opened one, it is named like that.
            control: what was moved; steps of one control within a second count as one. None for
                an edit of its own.
        """
        base = self.now.name.removesuffix(_EDITED)
        version = Version(setup, f"{base}{_EDITED}")
        if setup == self.opened.setup:
            version = self.opened
        now = self._clock()
        last, before = self._last
        if control is not None and control == last and now - before < _TOGETHER and self.undoable:
            self._versions = [*self._versions[: self._at], version]
        else:
            self.add(version)
        self._last = (control, now)

    def searched(self, setup: Setup) -> None:
        """Add the result of a search."""
        self.add(Version(setup, f"search result from {self.opened.name}"))

    def saved(self, setup: Setup, name: str) -> None:
        """Name the present version after the file that holds it."""
        if setup == self.now.setup:
            self._versions[self._at] = replace(self.now, name=name)

    def undo(self) -> None:
        """Go back to the version before, if there is one."""
        self._step(-1)

    def redo(self) -> None:
        """Go forward to the version that was undone, if there is one."""
        self._step(1)

    def _step(self, by: int) -> None:
        self._last = (None, 0.0)
        self._at = min(max(self._at + by, 0), len(self._versions) - 1)
