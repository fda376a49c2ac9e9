"""Interface to the person who runs a check on a rig."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Protocol

from ...coverage.rings.ring import Setup
from ...objectives.scene import CoreScene
from ..poses.itinerary import Itinerary
from ..poses.near_stops import NearStops
from ..session.session import Session
from .options import Part
from .plans import Plans
from .stopping import StopBound


class LiveView(AbstractContextManager["LiveView"], Protocol):
    """Shows a session while it runs, and asks the person at the rig."""

    def show(self, part: Part, done: int, of: int) -> None:
        """Show that ``done`` of ``of`` steps of a part are complete."""
        ...

    def ask(self, words: str) -> bool:
        """Show an instruction and wait for the person.

        Returns:
            True if the person did it, False if they skipped it.

        Raises:
            EndedError: if the person ended the check.
        """
        ...

    def resume(self, words: str) -> bool:
        """Say why the robot was stopped, and ask whether it may go on."""
        ...


class Attendant(Protocol):
    """Interface to the person who runs a check."""

    def working(self, what: str) -> AbstractContextManager[object]:
        """Show what the program is doing meanwhile."""
        ...

    def view(self, session: Session, setup: Setup) -> LiveView:
        """Return the live view of a session."""
        ...

    def show_near_stops(self, stops: NearStops, setup: Setup, scene: CoreScene) -> None:
        """Show how much of the near stop each ring keeps along the route."""
        ...

    def show_stopping(self, bounds: Sequence[StopBound], warning: str | None) -> None:
        """Show how soon the robot stops after each kind of event, and how far it travels."""
        ...

    def confirm(self, scene: CoreScene, plans: Plans, itinerary: Itinerary) -> None:
        """Ask whether a real robot may move; raise UserError unless the answer is yes."""
        ...

    def note(self, text: str) -> None:
        """Show a line."""
        ...

    def alarm(self, text: str) -> None:
        """Warn at once that the robot was not seen to stand still."""
        ...
