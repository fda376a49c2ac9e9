"""Sensors that lie flush in a body, on the command line: lifted, with a note about each."""

from collections.abc import Sequence

from ...coverage.definitions.errors import UserError
from ...coverage.rings.ring import Setup
from ...coverage.rings.surface_lift import Lift, lift_to_surface
from ...objectives.scene import Scene
from ...reporting.lines.scene import lift_lines
from ...reporting.terminal import Terminal

_MOST = 1000.0  # mm


def lifted(setup: Setup, scene: Scene, most_mm: float) -> Setup:
    """Return a setup whose sensors are lifted to the surface of their links, and say which.

    Args:
        setup: the setup.
        scene: the scene, with the robot's bodies in use.
        most_mm: largest distance, mm.

    Raises:
        UserError: for another distance, or a robot without bodies.
    """
    if not 0 < most_mm <= _MOST:
        raise UserError(
            f"--lift-to-surface: found {most_mm:g}, allowed: mm, above 0 and at most {_MOST:g}"
        )
    try:
        setup, lifts = lift_to_surface(scene.robot, setup, most_mm / 1000)
    except ValueError as error:
        raise UserError(f"--lift-to-surface: {error}, in which a sensor could lie") from error
    _say(lifts, most_mm)
    return setup


def _say(lifts: Sequence[Lift], most_mm: float) -> None:
    log = Terminal(stderr=True)
    for line in lift_lines(lifts, most_mm):
        log.print(line, highlight=False, soft_wrap=True, markup=False)
