"""The person who runs a check on a rig: what is shown to them, and asked."""

import math
from collections.abc import Sequence
from contextlib import AbstractContextManager

from rich.table import Table

from ...coverage.definitions.errors import UserError
from ...coverage.rings.ring import Setup
from ...objectives.scene import Scene
from ...reporting.terminal import Terminal, say
from ..poses.itinerary import Itinerary
from ..poses.near_stops import NearStops, by_ring
from ..robot.motion import HELD
from ..session.session import Session
from .before_move import HEADING, before_move
from .check_view import CheckView
from .dry_run import motion_of
from .models import DISCLAIMER
from .planned_check import ring_names
from .plans import Plans
from .stopping import UNDETECTED, StopBound

EXEMPT = (
    "The simulated rig moves without --move, without a floor and [motion] cell_complete in the"
    " scene, and with relaxed time limits. A real robot does not."
)


class Attendant:
    """The person at a rig, in front of a terminal."""

    def __init__(self, console: Terminal) -> None:
        self._console = console

    def working(self, what: str) -> AbstractContextManager[object]:
        """Show what the program is doing meanwhile."""
        return self._console.status(what)

    def view(self, session: Session, setup: Setup) -> CheckView:
        """Return the live view of a session."""
        return CheckView(session, setup, self._console)

    def note(self, text: str) -> None:
        """Show a line."""
        self._console.print(text, highlight=False, soft_wrap=True, markup=False)

    def alarm(self, text: str) -> None:
        """Warn at once that the robot was not seen to stand still."""
        say(f"ATTENTION: {text}", error=True)

    def show_near_stops(self, stops: NearStops, setup: Setup, scene: Scene) -> None:
        """Print the share of the near stop that each ring keeps along the route, and what reduces
        it.
        """
        table = _table(
            f"Near stop along the route: a reading below {1000 * stops.full:.0f} mm stops the"
            " robot",
            "A sensor that may see the robot itself stops it at a shorter distance there, or not"
            " at all.",
            ("ring", "sensors", "always full", "sometimes less", "sometimes none"),
        )
        table.add_column("full, % of the route", justify="right")
        table.add_column("lowered by the robot's own (sensors)")
        for name, ring in zip(
            ring_names(setup),
            by_ring(stops, setup, [b.name for b in scene.robot.enclosed().bodies]),
            strict=True,
        ):
            counts = (ring.sensors, ring.always_full, ring.sometimes_less, ring.sometimes_none)
            why = ", ".join(f"{body} ({count})" for body, count in ring.why)
            table.add_row(name, *map(str, counts), f"{100 * ring.share:.0f}", why)
        self._console.print(table)

    def show_stopping(self, bounds: Sequence[StopBound], warning: str | None) -> None:
        """Print how soon a real robot stops after each kind of event, and how far it travels."""
        table = _table(
            "Stopping a real robot, at most, within the limits of [link] and [motion]",
            "Distances are those of the fastest point on the route, until standstill. They do not"
            " include the sensors' own time, the network and the controller.",
            ("event", "stop begins, ms", "travelled, mm"),
        )
        for bound in bounds:
            table.add_row(bound.event, f"{1000 * bound.seconds:.0f}", f"{1000 * bound.metres:.0f}")
        self._console.print(table)
        self.note(UNDETECTED)
        if warning:
            self.note(f"Warning: {warning}")

    def confirm(self, scene: Scene, plans: Plans, itinerary: Itinerary) -> None:
        """Print what will move and what stops it, and ask for confirmation.

        Raises:
            UserError: unless the answer is yes.
        """
        reached, motion = sum(map(len, itinerary.reached)), scene.motion
        floors = ", ".join(f"{o.floor:g} m" for o in scene.obstacles if o.floor is not None)
        run = motion_of(scene, plans, itinerary)
        lines = [
            f"The scene states: the floor lies at {floors} in the base frame; it and"
            f" {len(scene.obstacles) - 1} more obstacles are all that the robot can reach;"
            f" rings_as_proposed = {str(motion.rings_as_proposed).lower()}.",
            f"The robot will move to {reached} of {sum(map(len, plans.poses))} poses, its"
            f" leading joint at up to {math.degrees(motion.speed):g}°/s and"
            f" {math.degrees(motion.acceleration):g}°/s². It stops on a near reading as in the"
            " table above, on a ring that is silent, frozen, exchanged or reports failures, on"
            " a fault of a connection, and on Ctrl-C. If its speed slider holds it for more"
            f" than {HELD:g} s, it is stopped and you are asked before it goes on.",
            HEADING,
            *(f"- {line}" for line in before_move(scene, itinerary.clearance.setup, run)),
            DISCLAIMER,
            "Keep out of its reach, and keep a hand on its emergency stop.",
        ]
        for line in lines:
            self.note(line)
        try:
            answer = self._console.input("Type yes to let it move > ").strip()
        except (EOFError, OSError, UnicodeDecodeError):
            answer = ""
        if answer != "yes":
            raise UserError('--move: not confirmed (type "yes"); the robot was not moved')


def _table(title: str, caption: str, heads: Sequence[str]) -> Table:
    """Return a table of which all columns but the first hold numbers."""
    table = Table(title=title, title_justify="left", caption=caption, caption_justify="left")
    for i, head in enumerate(heads):
        table.add_column(head, justify="right" if i else "left")
    return table
