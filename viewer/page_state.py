"""What one page shows and edits, without a browser: setups with their histories, and the view; and
its lock, as callbacks come from several threads."""

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

from ..coverage.occlusion.occlusion_mode import OCCLUSIONS
from ..coverage.rings.ring import Setup
from ..coverage.targets.target import Target
from ..objectives.scene import Scene
from .drawn_parts import BEHIND, DrawnParts
from .edited_setup import EditedSetup
from .link_state import LinkState, ring_values

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


@dataclass
class PageState:
    """The state of one page, which one thread at a time reads or changes."""

    scene: Scene
    """The scene."""
    targets: Mapping[str, Target]
    """Targets by label."""
    histories: list[History]
    """Versions of each setup."""
    choice: DrawnParts
    """What the page shows of the active setup; its cut is found when it is drawn."""
    active: int = 0
    """Index of the setup that controls change."""
    cut: str = BEHIND
    """Which points are cut away, one of ``CUTS``."""
    plane: float = 0.0
    """Distance of a plane across an axis from the base, m."""
    dark: bool = False
    """Whether the page is dark."""
    spheres: bool = True
    """Whether a map of unseen spheres is drawn."""
    handles: bool = False
    """Whether the selected ring has handles."""
    view: str | None = None
    """Standard view that was chosen last, or None."""
    _lock: threading.RLock = field(default_factory=threading.RLock, repr=False, compare=False)

    @contextmanager
    def held(self) -> Iterator["PageState"]:
        """Hold the lock, for changes and for several values of one moment; yield the state."""
        with self._lock:
            yield self

    def snapshot(self) -> "PageState":
        """Return a copy that later changes leave as it is."""
        with self._lock:
            return replace(self, histories=[history.frozen() for history in self.histories])

    @staticmethod
    def of(scene: Scene, targets: Mapping[str, Target], setups: Mapping[str, Setup]) -> "PageState":
        """Return the state of a page that was just opened."""
        choice = DrawnParts(0, next(iter(targets.values())), scene.occlusion)
        histories = [History(Version(setup, name)) for name, setup in setups.items()]
        return PageState(scene, targets, histories, choice)

    @property
    def setups(self) -> list[Setup]:
        """The setups as they are now."""
        return [history.now.setup for history in self.histories]

    @property
    def names(self) -> list[str]:
        """What the setups are now."""
        return [history.now.name for history in self.histories]

    @property
    def history(self) -> History:
        """Versions of the active setup."""
        return self.histories[self.active]

    @property
    def draft(self) -> EditedSetup:
        """The active setup, to edit."""
        return EditedSetup(self.scene, self.history.now.setup)

    def choose(self, **what: Any) -> None:
        """Change what is shown.

        Raises:
            ValueError: for a ring that does not exist.
        """
        if not 0 <= what.get("ring", 0) < len(self.history.now.setup.groups):
            raise ValueError(f"ring {what['ring']} does not exist")
        if what.get("ring", self.choice.ring) != self.choice.ring:
            what.setdefault("sensor", None)
        self.choice = replace(self.choice, **what)
        self._settle()

    def edit(
        self, edit: Callable[[EditedSetup], EditedSetup], last: bool = False, control: Any = None
    ) -> None:
        """Change the active setup.

        Args:
            edit: the change.
            last: whether to select the last ring afterwards.
            control: what the user moved, so that one movement is one step to undo.
        """
        after = edit(self.draft).setup
        self.history.edit(after, control)
        if last:
            self.choice = replace(self.choice, ring=len(after.rings) - 1, sensor=None)
        self._settle()

    def step(self, undo: bool) -> None:
        """Undo a change of the active setup, or redo it."""
        self.history.undo() if undo else self.history.redo()
        self._settle()

    def replaced(self, version: Version) -> None:
        """Replace the active setup."""
        self.history.add(version)
        self._settle()

    def searched(self, i: int, setup: Setup) -> None:
        """Take the result of a search for setup ``i``."""
        self.histories[i].searched(setup)
        self._settle()

    def _settle(self) -> None:
        """Keep the selected ring and sensor among those that exist."""
        groups = self.history.now.setup.groups
        ring = min(self.choice.ring, len(groups) - 1)
        sensor = self.choice.sensor
        if sensor is not None and sensor >= groups[ring].count:
            sensor = None
        self.choice = replace(self.choice, ring=ring, sensor=sensor)

    def link(self) -> LinkState:
        """Return what a link to this state says."""
        now, opened = self.history.now.setup, self.history.opened.setup
        first = next(iter(self.targets.values()))
        return LinkState(
            None if self.choice.target == first else str(self.choice.target),
            self.choice.pose or None,
            None if self.choice.occlusion == self.scene.occlusion else self.choice.occlusion,
            None if now == opened else ring_values(now),
            self.view,
            self.dark or None,
        )

    def open(self, link: LinkState) -> None:
        """Take over what a link states.

        Raises:
            ValueError: for a target, pose, model or ring that this page does not have; nothing
                changes then.
        """
        what: dict[str, Any] = {}
        if link.target is not None:
            if link.target not in self.targets:
                raise ValueError(
                    f"link: found target {link.target[:60]!r}, allowed: {', '.join(self.targets)}"
                )
            what["target"] = self.targets[link.target]
        if link.pose is not None:
            if not 0 <= link.pose < len(self.scene.poses):
                raise ValueError(
                    f"link: found pose {link.pose}, allowed: 0 to {len(self.scene.poses) - 1}"
                )
            what["pose"] = link.pose
        if link.occlusion is not None:
            allowed = OCCLUSIONS if self.scene.robot.bodies else OCCLUSIONS[:1]
            if link.occlusion not in allowed:
                raise ValueError(
                    f"link: found occlusion {link.occlusion[:40]!r}, allowed: {', '.join(allowed)}"
                )
            what["occlusion"] = link.occlusion
        rings = link.rings
        if rings is not None:
            self.edit(lambda draft: draft.arranged(rings))
        self.choose(**what)
        self.dark = self.dark if link.dark is None else link.dark
