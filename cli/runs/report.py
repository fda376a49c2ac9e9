"""Write the report of a setup, and print its main result."""

import sys
from pathlib import Path

from place_rings._report import PDF, write_report
from place_rings._validation import ResolvedSetup

from ...formats.schema.written_models import ReportResult
from ...formats.writing import made_folder
from ...objectives.options import ReportOptions
from ...reporting.setup_report.coverage_section import answer
from ...reporting.setup_report.verdicts import verdicts
from ...reporting.tables import count_error_line
from ...reporting.terminal import Terminal, say, say_json


def report(
    subject: ResolvedSetup, options: ReportOptions, out: Path, as_json: bool = False
) -> None:
    """Write the report of a setup."""
    console = Terminal(stderr=True)
    with made_folder(out):
        page, facts = write_report(subject, None, out, options, sys.argv[1:], console)
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
