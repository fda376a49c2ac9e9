"""Changes of a page's setups by the user: rings, single sensors, and steps back and forth."""

import math
from collections.abc import Callable
from typing import Any

from .browser import set_value
from .controls import STEPS, UNDO, Controls
from .edited_setup import EditedSetup
from .page_state import PageState, Version
from .ring_controls import NO_PRESET, POSITIONS
from .session import ViewerSession


class PageEdits:
    """Changes the active setup of one page, and shows the result."""

    def __init__(
        self,
        state: PageState,
        room: ViewerSession,
        controls: Controls,
        show: Callable[[], None],
    ) -> None:
        """Take over the page's state.

        Args:
            state: the state.
            room: what all pages share.
            controls: of the page.
            show: shows the newest state.
        """
        self._state, self._room, self._controls, self._show = state, room, controls, show

    def edit(
        self,
        edit: Callable[[EditedSetup], EditedSetup],
        last: bool = False,
        control: Any = None,
    ) -> None:
        """Change the setup; see ``PageState.edit``."""
        with self._state.held() as state:
            state.edit(edit, last, control)
        self._show()

    def change(self, **what: Any) -> None:
        """Change the selected ring."""
        with self._state.held() as state:
            ring = state.choice.ring
        self.edit(lambda draft: draft.changed(ring, **what), control=(ring, *what))

    def move_along(self, value: Any) -> None:
        """Move the selected ring to a place in mm along its link."""
        with self._state.held() as state:
            ring = state.history.now.setup.rings[state.choice.ring]
        length = 1000 * self._room.scene.robot.mount(ring.link).length
        self.change(position=finite(value) / length if length > 0 else 0.0)

    def drag(self, position: float | None, phase: float | None) -> None:
        """Move the selected ring with its handles: along its link, or about it, rad."""
        if position is not None:
            self.change(position=position)
        if phase is not None:
            self.change(phase_deg=math.degrees(phase))

    def relink(self, label: str) -> None:
        """Move the selected ring to a link; of a single sensor it is the link for a new ring."""
        with self._state.held() as state:
            rings, ring = len(state.history.now.setup.rings), state.choice.ring
        if ring < rings:
            self.change(link=self._controls.rings.link_named(label))

    def move(self, key: str, value: float) -> None:
        """Change one number of the selected single sensor's pose."""
        number = float(value) / (1000.0 if key in POSITIONS else 1.0)
        with self._state.held() as state:
            ring = state.choice.ring
        self.edit(lambda draft: draft.moved(ring, **{key: number}), control=(ring, key))

    def add(self) -> None:
        """Add a ring on the chosen link, and select it."""
        rings = self._controls.rings
        self.edit(lambda draft: draft.added(rings.link_named(rings.link.value)), True)

    def remove(self) -> None:
        """Remove the selected ring or single sensor."""
        with self._state.held() as state:
            ring = state.choice.ring
        self.edit(lambda draft: draft.removed(ring))

    def as_opened(self) -> None:
        """Replace the setup by the one that was opened."""
        with self._state.held() as state:
            state.replaced(state.history.opened)
        self._show()

    def start_from(self, name: str) -> None:
        """Replace the rings by those of a layout of the paper."""
        if name == NO_PRESET:
            return
        with self._state.held() as state:
            state.replaced(Version(self._room.presets[name], name))
        set_value(self._controls.rings.preset, NO_PRESET)
        self._show()

    def step(self, label: str) -> None:
        """Undo a change, or redo it.

        Raises:
            ValueError: for another label.
        """
        if label not in STEPS:
            raise ValueError(f"found {label!r}, allowed: {', '.join(STEPS)}")
        with self._state.held() as state:
            state.step(label == UNDO)
        self._show()


def finite(value: Any) -> float:
    """Return a number that a browser sent.

    Raises:
        ValueError: if it is not finite.
    """
    number = float(value)
    if not math.isfinite(number):
        raise ValueError("numbers must be finite")
    return number
