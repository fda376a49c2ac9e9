"""Show every pose and way of a check in a browser, and what to set before a first move."""

from collections.abc import Sequence

import numpy as np

from ...coverage.definitions.errors import UserError
from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import rounded
from ...objectives.scene import Scene
from ...reporting.terminal import Terminal, say
from ...rig.check.before_move import HEADING, before_move
from ...rig.check.dry_run import DryRun, dry_run
from ...rig.check.options import CheckOptions
from ...rig.check.plans import plan_check
from ...rig.check.preconditions import require_revolute
from ...rig.poses.routes import SLACK, Clearance
from ...rig.simulated_cell.cell import with_cell
from ...viewer.motion_page import MotionSession, PlannedMotion
from ...viewer.server import Server
from ..signals import serve_page

_NO_CELL = (
    "The scene states no obstacles; the dry run shows the cell of the simulated rig. State your own"
    " as [[obstacles]]."
)


def planned_dry_run(
    setup: Setup, given: Scene, options: CheckOptions
) -> tuple[Scene, Setup, DryRun]:
    """Return the scene, the setup and the motion of a check.

    Raises:
        UserError: if no plan is possible, no part of it moves the robot, or the robot cannot start
            from the scene's first pose.
    """
    if options.parts == ("self",):
        raise UserError("--dry-run: found --part self, wanted: mount or coverage, which have poses")
    require_revolute(given.robot)
    scene = with_cell(given)
    rings = rounded(setup, scene.sensor)
    if wrong := Clearance(scene, rings).fault(np.asarray(scene.poses[0].q, float), SLACK):
        raise UserError(
            f"--dry-run: the robot cannot start from the scene's first pose: {wrong}; put a clear"
            " pose first in [[poses]], or correct [[obstacles]] or the distances in [motion]"
        )
    with Terminal(stderr=True).status("planning"):
        plans = plan_check(rings, scene, options, moved=True)
        return scene, rings, dry_run(scene, rings, plans, options.seed)


def described(scene: Scene, setup: Setup, run: DryRun, known_cell: bool) -> list[str]:
    """Return the lines beside a dry run: its size, what it leaves out, and what to set."""
    seconds = float(run.time[-1])
    lines = [
        f"{len(run.stops) - 1} poses, {seconds:.0f} s of motion without pauses, from the scene's"
        " first pose; a robot that stands elsewhere takes another first way."
    ]
    if run.unreachable:
        lines.append(f"No clear way leads to: {', '.join(run.unreachable)}; they are left out.")
    if not known_cell:
        lines.append(_NO_CELL)
    lines.append(HEADING)
    lines += [f"- {line}" for line in before_move(scene, setup, run)]
    return lines


def show_dry_run(setup: Setup, given: Scene, options: CheckOptions, browser: bool) -> None:
    """Serve the dry run of a check on this machine until Ctrl-C."""
    scene, rings, run = planned_dry_run(setup, given, options)
    lines = described(scene, rings, run, bool(given.obstacles))
    _print(lines)
    stops = tuple((stop.name, stop.time) for stop in run.stops)
    motion = PlannedMotion(run.time, run.joints, stops)
    title = f"Dry run with {rings.sensors} sensors"
    server = Server(MotionSession(scene, rings, motion, tuple(lines), title))
    serve_page(server.url, server.close, browser, Terminal(stderr=True))


def _print(lines: Sequence[str]) -> None:
    for line in lines:
        say(line)
