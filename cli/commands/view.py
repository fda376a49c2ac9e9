"""The command view: a setup in a browser."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ..options.common import Subject
from ..options.groups import AS_IT_IS, SubjectOptions


def view(
    subject: Subject,
    /,
    *,
    compare: Annotated[
        str | None, Parameter(help="Another proposal or name, beside the first and in its scene.")
    ] = None,
    given: SubjectOptions = AS_IT_IS,
    urdf: Annotated[
        Path | None, Parameter(help="Show the robot's surface as this URDF's meshes have it.")
    ] = None,
    packages: Annotated[
        tuple[Path, ...], Parameter(negative=(), help="Folders with the meshes of --urdf.")
    ] = (),
    out: Annotated[
        Path | None, Parameter(help="Folder in which the page may save proposals and pictures.")
    ] = None,
    host: Annotated[
        str, Parameter(help="Address to serve at: this machine only, unless you say another.")
    ] = "127.0.0.1",
    port: Annotated[
        int, Parameter(validator=Number(gte=0, lte=65535), help="0: any that is free.")
    ] = 0,
    browser: Annotated[
        bool, Parameter(negative="--no-browser", help="Open the page in a browser.")
    ] = True,
) -> None:
    """Show a setup in a browser: robot, rings, cones, what is seen and what is not; change it,
    count it, search on from it.

    Example: place-rings view n3_16_55

    Example: place-rings view place-rings-out/proposal.toml --compare n3_16_55 --out mine
    """
    from ..._validation import ResolvedSetup
    from ...formats.loader import resolve
    from ..options.scenes import urdf_of
    from ..runs.view import view as run

    shown = given.resolved(subject)
    beside = None
    if compare is not None:
        beside = ResolvedSetup(compare, *resolve(compare, shown.scene))
    urdf = urdf or urdf_of(given.place.robot)
    run(shown, beside, urdf, packages, out, host, port, browser)
