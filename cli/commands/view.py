"""The command view."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ..options.common import WHOLE, Subject
from ..options.groups import AS_IT_IS, SubjectOptions


def view(
    subject: Subject,
    /,
    *,
    compare: Annotated[
        str | None, Parameter(help="Second setup, shown beside the first in the same scene.")
    ] = None,
    given: SubjectOptions = AS_IT_IS,
    urdf: Annotated[
        Path | None, Parameter(help="URDF whose meshes show the surface of the robot.")
    ] = None,
    out: Annotated[
        Path | None,
        Parameter(
            help=(
                "Folder in which the page may save proposals and pictures. Default: none; the page"
                " cannot save."
            )
        ),
    ] = None,
    host: Annotated[
        str, Parameter(help="Address to serve on; the default serves this machine only.")
    ] = "127.0.0.1",
    port: Annotated[
        int,
        WHOLE,
        Parameter(
            validator=Number(gte=0, lte=65535), help="Port to serve on; 0 selects a free one."
        ),
    ] = 0,
    browser: Annotated[
        bool, Parameter(negative="--no-browser", help="Open the page in a browser.")
    ] = True,
) -> None:
    """Show a setup in a browser: robot, rings, beams, covered and uncovered points.

    On the page you can move rings, count the coverage again, continue the search, and save
    proposals.

    For example:

    ```bash
    place-rings view n3_16_55
    place-rings view place-rings-out/proposal.toml --compare n3_16_55
    ```

    ``place-rings --help`` explains the terms.
    """
    from place_rings._validation import ResolvedSetup

    from ...formats.loader import resolve
    from ...reporting.terminal import say
    from ..options.scenes import urdf_of
    from ..runs.view import view as run

    urdf = urdf or urdf_of(given.place.robot)
    shown = given.resolved(subject, urdf)
    beside = None
    if compare is not None:
        beside = ResolvedSetup(compare, *resolve(compare, shown.scene))
        if compare.endswith(".toml"):
            say(f"{compare} is shown and counted in the scene of {subject}.", error=True)
    run(shown, beside, urdf, given.place.reading.resolve(), out, host, port, browser)
