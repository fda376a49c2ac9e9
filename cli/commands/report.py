"""The command report."""

import sys
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
    from place_rings._report import PDF, write_report

    from ...formats.schema.written_models import ReportResult
    from ...formats.writing import made_folder
    from ...objectives.pose_workers import PoseWorkers
    from ...reporting.setup_report.coverage_section import answer
    from ...reporting.setup_report.verdicts import verdicts
    from ...reporting.tables import count_error_line
    from ...reporting.terminal import Terminal, say, say_json
    from ..options.targets import with_floors

    resolved = given.resolved(subject)
    resolved = replace(resolved, scene=with_floors(resolved.scene, require, "--require"))
    console = Terminal(stderr=True)
    workers = PoseWorkers.of_motion(len(resolved.scene.poses))
    with made_folder(out), workers:
        page, facts = write_report(resolved, None, out, options, sys.argv[1:], console)
    pdf = page.with_name(PDF) if options.pdf else None
    if as_json:
        record = ReportResult(
            setup=facts.name,
            page=str(page),
            pdf=None if pdf is None else str(pdf),
            zeta=facts.own,
            requirements=facts.required,
            verdicts=list(verdicts(facts)),
        )
        say_json(record.model_dump_json(indent=2))
        return
    say(answer(facts).replace("**", ""))
    for verdict in verdicts(facts):
        say(f"{verdict.question}: {verdict.state}: {verdict.figure}")
    say(count_error_line(options.voxel))
    say(f"  {page}")
    if pdf is not None:
        say(f"  {pdf}")
