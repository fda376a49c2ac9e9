"""The command report."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ...objectives.options import ReportOptions
from ..options.common import Json, Subject
from ..options.groups import AS_IT_IS, SubjectOptions
from ..options.offered import offering


@offering()
def report(
    subject: Subject,
    /,
    *,
    given: SubjectOptions = AS_IT_IS,
    options: ReportOptions,
    require: Annotated[
        tuple[str, ...],
        Parameter(
            negative=(),
            help=(
                "Required coverage of a target in percent: NAME[:RADIUS]=PERCENT, for example"
                " V_S:0.5=90. The cover says whether a proved lower bound reaches it. Repeatable."
                " Default: the minimum coverages of the scene."
            ),
        ),
    ] = (),
    out: Annotated[Path, Parameter(help="Output folder for report.html and report.pdf.")] = Path(
        "place-rings-report"
    ),
    as_json: Json = False,
) -> None:
    """Write a report of a setup on one HTML page, to read, to print and to build from.

    The page has a verdict, the coverage, the blind spots, the robustness, mounting drawings, cables
    and a parts list.

    For example:

    ```bash
    place-rings report place-rings-out/proposal.toml --require V_S:0.5=90 --pdf
    ```

    ``place-rings --help`` explains the terms.
    """
    from ..options.targets import with_floors
    from ..runs.report import report as run

    resolved = given.resolved(subject)
    resolved = replace(resolved, scene=with_floors(resolved.scene, require, "--require"))
    run(resolved, options, out, as_json)
