"""The command robot."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ...coverage.choices import Surface
from ..options.common import WHOLE
from ..options.reading import AS_WRITTEN, ReadingOptions


def robot(
    what: Annotated[
        str,
        Parameter(
            name="URDF_OR_NAME",
            help=(
                "A URDF (.urdf), a xacro file (.xacro), an MJCF (.xml), a name of"
                " robot_descriptions such as ur5e_description, or a built-in robot."
            ),
        ),
    ],
    /,
    *,
    reading: ReadingOptions = AS_WRITTEN,
    capsules: Annotated[
        int,
        WHOLE,
        Parameter(validator=Number(gte=1, lte=8), help="Largest number of capsules for a link."),
    ] = 3,
    surface: Annotated[
        Surface, Parameter(help="Meshes to which capsules are fitted.")
    ] = "collision",
    name: Annotated[
        str | None, Parameter(help="Name of the robot. Default: the name in the URDF.")
    ] = None,
    out: Annotated[
        Path, Parameter(help="Output folder for robot.toml, scene.toml and robot.png.")
    ] = Path("place-rings-robot"),
) -> None:
    """Make a robot file from a URDF: fit capsules to its links and propose where rings can sit.

    A capsule is a cylinder with round ends; a few of them contain each link. Check the picture
    robot.png, edit robot.toml and scene.toml, then search in that scene.

    For example:

    ```bash
    place-rings robot my.urdf --packages ~/robots --out mine
    place-rings robot my.urdf.xacro --xacro-arg gripper=false --out mine
    place-rings --scene mine/scene.toml --target V_S --radius 0.5
    ```

    ``place-rings --help`` explains the terms.
    """
    from ..runs.robot import robot as run

    run(what, reading, capsules, surface, name, out)
