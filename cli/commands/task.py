"""The command task."""

from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ..options.common import RobotOption


def task(
    *,
    robot: RobotOption = None,
    rate: Annotated[
        float, Parameter(validator=Number(gte=1, lte=1000), help="Rows a second.")
    ] = 25.0,
) -> None:
    """Print the paper's task (ten products from one table to the other, 100 s) as a recorded
    motion: CSV in radians.

    Example: place-rings task > task.csv
    """
    from ...coverage.robots.built_in import PAPER_ROBOTS
    from ...formats.errors import UserError, shown
    from ...objectives.scene import Scene
    from ..options.scenes import resolve_scene
    from ..runs.task import task as run

    if robot is not None and robot not in PAPER_ROBOTS:
        raise UserError(
            f"--robot: found {shown(robot)}, allowed: {', '.join(PAPER_ROBOTS)}, as the task is the"
            " paper's"
        )
    run(resolve_scene(None, robot) or Scene(), rate)
