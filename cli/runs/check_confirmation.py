"""Tell a person what will move, and ask for confirmation."""

import math
from collections.abc import Sequence

from rich.table import Table

from ...coverage.rings.ring import Setup
from ...formats.errors import UserError
from ...objectives.scene import CoreScene
from ...reporting.terminal import Terminal
from ...rig.check.before_move import HEADING, before_move
from ...rig.check.dry_run import motion_of
from ...rig.check.models import DISCLAIMER
from ...rig.check.planned_check import ring_names
from ...rig.check.plans import Plans
from ...rig.check.stopping import UNDETECTED, StopBound
from ...rig.poses.itinerary import Itinerary
from ...rig.poses.near_stops import NearStops, by_ring
from ...rig.robot.motion import HELD

EXEMPT = (
    "The simulated rig moves without --move, without a floor and [motion] cell_complete in the"
    " scene, and with relaxed time limits. A real robot does not."
)


def show_near_stops(stops: NearStops, setup: Setup, scene: CoreScene, console: Terminal) -> None:
    """Print the share of the near stop that each ring keeps along the route, and what reduces
    it.
    """
    table = Table(
        title=(
            f"Near stop along the route: a reading below {1000 * stops.full:.0f} mm stops the robot"
        ),
        title_justify="left",
        caption=(
            "A sensor that may see the robot itself stops it at a shorter distance there, or not at"
            " all."
        ),
        caption_justify="left",
    )
    table.add_column("ring")
    for name in (
        "sensors",
        "always full",
        "sometimes less",
        "sometimes none",
        "full, % of the route",
    ):
        table.add_column(name, justify="right")
    table.add_column("lowered by the robot's own (sensors)")
    for name, ring in zip(
        ring_names(setup),
        by_ring(stops, setup, [b.name for b in scene.robot.enclosed().bodies]),
        strict=True,
    ):
        counts = (ring.sensors, ring.always_full, ring.sometimes_less, ring.sometimes_none)
        why = ", ".join(f"{body} ({count})" for body, count in ring.why)
        table.add_row(name, *map(str, counts), f"{100 * ring.share:.0f}", why)
    console.print(table)


def show_stopping(bounds: Sequence[StopBound], warning: str | None, console: Terminal) -> None:
    """Print how soon a real robot stops after each kind of event, and how far it travels."""
    table = Table(
        title="Stopping a real robot, at most, within the limits of [link] and [motion]",
        title_justify="left",
        caption=(
            "Distances are those of the fastest point on the route, until standstill. They do not"
            " include the sensors' own time, the network and the controller."
        ),
        caption_justify="left",
    )
    table.add_column("event")
    for name in ("stop begins, ms", "travelled, mm"):
        table.add_column(name, justify="right")
    for bound in bounds:
        table.add_row(bound.event, f"{1000 * bound.seconds:.0f}", f"{1000 * bound.metres:.0f}")
    console.print(table)
    console.print(UNDETECTED, highlight=False, soft_wrap=True)
    if warning:
        console.print(f"Warning: {warning}", highlight=False, soft_wrap=True)


def confirm(scene: CoreScene, plans: Plans, itinerary: Itinerary, console: Terminal) -> None:
    """Print what will move and what stops it, and ask for confirmation.

    Raises:
        UserError: unless the answer is yes.
    """
    reached, motion = sum(map(len, itinerary.reached)), scene.motion
    floors = ", ".join(f"{o.keys['floor']:g} m" for o in scene.obstacles if "floor" in o.keys)
    lines = [
        (
            f"The scene states: the floor lies at {floors} in the base frame; it and"
            f" {len(scene.obstacles) - 1} more obstacles are all that the robot can reach;"
            f" rings_as_proposed = {str(motion.rings_as_proposed).lower()}."
        ),
        (
            f"The robot will move to {reached} of {sum(map(len, plans.poses))} poses, its leading"
            f" joint at up to {math.degrees(motion.speed):g}°/s and"
            f" {math.degrees(motion.acceleration):g}°/s². It stops on a near reading as in the"
            " table above, on a ring that is silent, frozen, exchanged or reports failures, on a"
            " fault of a connection, and on Ctrl-C. If its speed slider holds it for more than"
            f" {HELD:g} s, it is stopped and you are asked before it goes on."
        ),
        HEADING,
        *(
            f"- {line}"
            for line in before_move(
                scene, itinerary.clearance.setup, motion_of(scene, plans, itinerary)
            )
        ),
        DISCLAIMER,
        "Keep out of its reach, and keep a hand on its emergency stop.",
    ]
    for line in lines:
        console.print(line, highlight=False, soft_wrap=True, markup=False)
    try:
        answer = console.input("Type yes to let it move > ").strip()
    except (EOFError, OSError, UnicodeDecodeError):
        answer = ""
    if answer != "yes":
        raise UserError('--move: not confirmed (type "yes"); the robot was not moved')
