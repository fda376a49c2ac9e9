"""The command view."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ...viewer.options import LOOPBACK, ViewOptions
from ..options.common import Subject
from ..options.groups import AS_IT_IS, SubjectOptions
from ..options.offered import offering


@offering()
def view(
    subject: Subject,
    /,
    *,
    compare: Annotated[
        str | None, Parameter(help="Second setup, shown beside the first in the same scene.")
    ] = None,
    given: SubjectOptions = AS_IT_IS,
    urdf: Annotated[
        str | None,
        Parameter(
            help=(
                "URDF, xacro or MJCF file whose meshes show the surface of the robot, or a name of"
                " robot_descriptions. Default: that of --robot, if any."
            )
        ),
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
    options: ViewOptions,
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
    from dataclasses import replace

    from place_rings._validation import ResolvedSetup
    from place_rings._views import view as serve

    from ...formats.loader import resolve
    from ...reporting.terminal import Terminal, say
    from ..options.scenes import described
    from ..signals import serve_page

    urdf = urdf or described(given.place.robot)
    shown = given.resolved(subject, urdf)
    beside = None
    if compare is not None:
        beside = ResolvedSetup(compare, *resolve(compare, shown.scene))
        if compare.endswith(".toml"):
            say(f"{compare} is shown and counted in the scene of {subject}.", error=True)
    reading, console = given.place.reading.resolve(), Terminal(stderr=True)
    with console.status("drawing points"):
        page = serve(
            shown,
            compare=beside,
            folder=out,
            urdf=urdf,
            packages=reading.packages,
            package=reading.package,
            xacro_args=reading.xacro_args,
            wait=False,
            **vars(replace(options, browser=False)),  # it is opened once its address is printed
        )
    if options.host not in (LOOPBACK, "localhost", "::1"):
        console.print(
            f"Warning: anyone who can reach {options.host} and knows the address below can use this"
            " page; it is not encrypted.",
            highlight=False,
        )
    serve_page(page.url, page.close, options.browser, console)
