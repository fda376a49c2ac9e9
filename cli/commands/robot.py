"""The command robot."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ...coverage.choices import Surface


def robot(
    what: Annotated[
        str, Parameter(name="URDF_OR_NAME", help="A URDF, or a robot that is built in.")
    ],
    /,
    *,
    base: Annotated[str | None, Parameter(help="The link that stands still: the root.")] = None,
    tip: Annotated[
        str | None, Parameter(help="The link at the TCP: the end of the longest chain.")
    ] = None,
    packages: Annotated[
        tuple[Path, ...],
        Parameter(
            negative=(),
            help="A folder with packages that package:// may mean, beside the URDF's. Repeatable.",
        ),
    ] = (),
    capsules: Annotated[
        int, Parameter(validator=Number(gte=1, lte=8), help="Capsules of a link, at most.")
    ] = 3,
    surface: Annotated[Surface, Parameter(help="The meshes that capsules contain.")] = "collision",
    name: Annotated[str | None, Parameter(help="The robot's name: as in the URDF.")] = None,
    out: Annotated[Path, Parameter(help="Folder for robot.toml, scene.toml and robot.png.")] = Path(
        "place-rings-robot"
    ),
) -> None:
    """Fit capsules to a robot's meshes, propose mount axes, and write them with a picture to check
    and a scene to edit.

    Example: place-rings robot my.urdf --packages ~/robots --out mine

    Example: place-rings --scene mine/scene.toml --target V_S --radius 0.5
    """
    from ..runs.robot import robot as run

    run(what, base, tip, packages, capsules, surface, name, out)
