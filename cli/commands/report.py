"""The command report."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from ..options.common import WHOLE, Json, Seed, Subject, Voxel
from ..options.groups import AS_IT_IS, SubjectOptions


def report(
    subject: Subject,
    /,
    *,
    given: SubjectOptions = AS_IT_IS,
    draws: Annotated[
        int,
        WHOLE,
        Parameter(
            validator=Number(gte=1, lte=100_000),
            help="Number of random mountings in the tolerance section.",
        ),
    ] = 100,
    seed: Seed = 0,
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
    revision: Annotated[str, Parameter(help="Revision of the report, for its cover.")] = "",
    pdf: Annotated[
        bool,
        Parameter(
            negative=(),
            help="Print report.pdf too, by a browser on PATH (Chromium, Chrome, Edge or Brave).",
        ),
    ] = False,
    voxel: Voxel = 0.01,
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
    from place_rings._report import ReportOptions

    from ..options.targets import with_floors
    from ..runs.report import report as run

    resolved = given.resolved(subject)
    resolved = replace(resolved, scene=with_floors(resolved.scene, require, "--require"))
    run(resolved, ReportOptions(voxel, draws, seed, revision, pdf), out, as_json)
