"""The command task."""

import csv
import io
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number


def task(
    *,
    robot: Annotated[
        str | None,
        Parameter(
            help=(
                "UR10 that moves: ur10 (joint frames of its URDF) or ur10_dh (its"
                " Denavit-Hartenberg table). Default: ur10."
            )
        ),
    ] = None,
    rate: Annotated[
        float, Parameter(validator=Number(gte=1, lte=1000), help="Rows per second.")
    ] = 25.0,
) -> None:
    """Print the pick-and-place task of the paper as a recorded motion (CSV, radians).

    The task moves ten products from one table to another in 100 s. Pass the file to --trajectory.

    For example:

    ```bash
    place-rings task > task.csv
    place-rings verify n2_16_25 --trajectory task.csv --voxel 0.04
    ```

    ``place-rings --help`` explains the terms.
    """
    from ...coverage.definitions.errors import UserError, shown
    from ...coverage.robots.built_in import PAPER_ROBOTS
    from ...objectives.scene import Scene
    from ...reporting.terminal import say_lines
    from ...simulation.pick_and_place import pick_and_place
    from ..options.scenes import resolve_scene

    if robot is not None and robot not in PAPER_ROBOTS:
        raise UserError(
            f"--robot: found {shown(robot)}, allowed: {', '.join(PAPER_ROBOTS)}, because the paper"
            " uses a UR10"
        )
    arm = (resolve_scene(None, robot) or Scene()).robot
    motion, text = pick_and_place(arm).every(rate), io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time_s", *(f"q{i}" for i in range(len(arm.chain)))])
    writer.writerows(
        [round(float(v), 9) + 0.0 for v in (t, *q)]
        for t, q in zip(motion.time_s, motion.q, strict=True)
    )
    say_lines(text.getvalue())
