"""Write the report of a setup, and print its main result."""

import sys
from pathlib import Path

from ..._report import write_report
from ..._validation import ResolvedSetup
from ...formats.schema.written_models import ReportResult
from ...reporting.setup_report.report_page import answer
from ...reporting.tables import count_error_line
from ...reporting.terminal import Terminal, say, say_json


def report(
    subject: ResolvedSetup, voxel: float, draws: int, seed: int, out: Path, as_json: bool = False
) -> None:
    """Write the report of a setup."""
    console = Terminal(stderr=True)
    page, facts = write_report(subject, None, out, voxel, draws, seed, sys.argv[1:], console)
    if as_json:
        record = ReportResult(setup=facts.name, page=str(page), zeta=facts.own)
        say_json(record.model_dump_json(indent=2))
        return
    say(answer(facts).replace("**", ""))
    if (line := count_error_line(voxel)) is not None:
        say(line)
    say(f"  {page}")
