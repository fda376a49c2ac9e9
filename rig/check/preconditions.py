"""What must hold before a check moves a real robot: a known cell, and sensors that stop it."""

from ...formats.errors import UserError
from ...objectives.scene import Scene
from ..poses.clear import sunk
from ..poses.near_stops import NearStops


def require_known_cell(scene: Scene) -> None:
    """UserError that says what to add, where a scene does not say all that a moving robot could
    hit.
    """
    lacks = []
    if not any("floor" in o.keys for o in scene.obstacles):
        lacks.append("[[obstacles]] floor = HEIGHT_OF_YOUR_FLOOR (m, in the base frame)")
    if not scene.robot.bodies:
        lacks.append(
            "a robot with bodies (`place-rings robot` fits them), as nothing else keeps it off the"
            " cell and itself"
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
            f"--move: {inside[0]}{more}; allowed: poses at which nothing stands in an obstacle"
        )


def require_near_stop(stops: NearStops, scene: Scene, waived: bool) -> None:
    """UserError where too few sensors keep the near stop, unless that is waived."""
    least = scene.motion.near_share
    if stops.share >= least or waived:
        return
    hint = (
        ""
        if scene.motion.rings_as_proposed
        else "; rings_as_proposed = true, if every ring is the right way round, helps"
    )
    raise UserError(
        f"--move: along the route {100 * stops.share:.0f} % of the sensors keep the whole near"
        f" stop, allowed: {100 * least:.0f} % and more (near_share under [motion]){hint};"
        " --allow-reduced-near-stop moves all the same"
    )
