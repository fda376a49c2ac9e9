"""Preconditions for moving a real robot: a completely described cell, and sensors that can stop the
robot.
"""

from collections.abc import Sequence

from ...coverage.definitions.errors import UserError
from ...coverage.rings.ring import Setup
from ...coverage.robots.robot import Robot
from ...objectives.motion_limits import Motion
from ...objectives.scene import Scene
from ..poses.clear import sunk
from ..poses.near_stops import NearStops
from ..rings.protocol import Counts
from ..robot.rtde_requests import inputs_in_use
from ..robot.state import not_running
from .planned_check import ring_names
from .port_matching import by_lines, text


def require_revolute(robot: Robot) -> None:
    """Raise UserError if a joint of the robot is prismatic, which a rig neither moves nor reads."""
    if robot.chain.prismatic:
        name = robot.chain.joints[robot.chain.prismatic[0]]
        raise UserError(
            f"check: joint {name} of {robot.name} is prismatic; a rig has revolute joints only, so"
            " check the arm alone, with a scene in its base frame"
        )


def require_known_cell(scene: Scene) -> None:
    """Raise UserError that says what to add if the scene does not describe everything a moving
    robot could hit.
    """
    lacks = []
    if all(o.floor is None for o in scene.obstacles):
        lacks.append("[[obstacles]] floor = HEIGHT_OF_YOUR_FLOOR (m, in the base frame)")
    if not scene.robot.bodies:
        lacks.append(
            "a robot with bodies (`place-rings robot` fits them); without them nothing keeps it"
            " from hitting the cell or itself"
        )
    if not scene.motion.cell_complete:
        lacks.append(
            "cell_complete = true under [motion], once everything the robot can reach is in"
            " [[obstacles]]"
        )
    if lacks:
        raise UserError(f"--move: the cell is not known; add to the scene: {'; and '.join(lacks)}")
    if inside := sunk(scene):
        more = f" (and {len(inside) - 1} more)" if len(inside) > 1 else ""
        raise UserError(
            f"--move: {inside[0]}{more}; correct the scene so that no body is inside an obstacle"
        )


def least_near_share(scene: Scene) -> float:
    """Return which share of the sensors must keep the full near stop. A scene may ask for more than
    by default, not for less: that is a waiver.
    """
    return max(scene.motion.near_share, Motion.near_share)


def require_near_stop(stops: NearStops, scene: Scene, waived: bool) -> None:
    """Raise UserError if too few sensors keep the full near stop, unless ``waived``."""
    least = least_near_share(scene)
    if stops.share >= least or waived:
        return
    hint = (
        ""
        if scene.motion.rings_as_proposed
        else "; if every ring is the right way round, set rings_as_proposed = true to raise it"
    )
    raise UserError(
        f"--move: along the route {100 * stops.share:.0f} % of the sensors keep the full near"
        f" stop; at least {100 * least:.0f} % are required (near_share under [motion]){hint};"
        " --allow-reduced-near-stop moves anyway"
    )


def require_running(mode: int | None) -> None:
    """Raise UserError if a robot in this mode does not move."""
    if why := not_running(mode):
        raise UserError(f"--move: {why}")


def require_free_inputs(host: str, seconds: float) -> None:
    """Raise UserError if another client of the controller holds an input that moves the robot."""
    if held := inputs_in_use(host, seconds):
        raise UserError(
            f"--move: another client of controller {host} holds {', '.join(held)}, which ur-rtde"
            " needs: disable EtherNet/IP, PROFINET, MODBUS and other RTDE clients, or restart the"
            " controller"
        )


def require_boards(setup: Setup, counts: Sequence[Counts]) -> None:
    """Raise UserError if a board other than the proposal's answers at the port of a ring."""
    for ring, name, c in zip(setup.rings, ring_names(setup), counts, strict=False):
        if ring.serial and (others := set(c.serials) - {ring.serial}):
            raise UserError(
                f"--ring {name}: found board {', '.join(sorted(others))}, wanted: {ring.serial}, as"
                f" the proposal names it; if the board is meant, correct serial in [[rings]] {name}"
            )


def require_ports(setup: Setup, counts: Sequence[Counts], devices: Sequence[str]) -> None:
    """Raise UserError if the lines say that ports were given for other rings than theirs."""
    names, ports = ring_names(setup), by_lines(setup, counts)
    if not ports:
        return
    right = " ".join(
        f"--ring {names[ring]}={devices[port]}" for port, ring in sorted(ports.items())
    )
    raise UserError(f"--ring: {text(ports, names, devices)}; give {right}")
