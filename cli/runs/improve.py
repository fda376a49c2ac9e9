"""The command that improves a mounted setup: run, print and write it."""

import shlex
import sys
from contextlib import nullcontext
from dataclasses import replace
from math import degrees
from pathlib import Path

from place_rings._improve import improve as improved
from place_rings._improvement import Improvement, improvement_files, write_improvement
from place_rings._validation import ResolvedSetup

from ...formats.schema.redesign_models import ImproveResult
from ...formats.writing import output_files
from ...placement.redesign.beam_search import WORTH
from ...placement.search.options import ImproveOptions
from ...placement.search.progress import Outcome, Progress
from ...reporting.explained import Explained
from ...reporting.progress import ProgressBar
from ...reporting.tables import count_error_line, percent, target_label, target_legend
from ...reporting.terminal import Terminal, say_json
from ...reporting.text import counted

_MOST_LISTED = 5  # violated rules that are printed


def improve(
    subject: ResolvedSetup, options: ImproveOptions, out: Path | None, as_json: bool
) -> None:
    """Search for changes to a mounted setup, print them, and write them to ``out``, if given."""
    console, log, changes = Terminal(), Terminal(stderr=True), options.changes
    with output_files(out, *improvement_files(changes), keep=True) if out else nullcontext() as new:
        command = shlex.join(["place-rings", *sys.argv[1:]])
        improvement = replace(_searched(subject, options, log), command=command)
        _print_broken(improvement, log)
        record = improvement.record
        if not all([record.zeta, *(step.zeta for step in record.steps)]):
            log.print("interrupted: the count of each target is incomplete; the changes are kept")
        if out and new:
            record = write_improvement(improvement, new, out)
    if as_json:
        say_json(record.model_dump_json(indent=2))
        return
    _show(record, improvement, options.voxel, console)


def _searched(subject: ResolvedSetup, options: ImproveOptions, console: Terminal) -> Improvement:
    """Run the search with a progress bar on ``console``."""
    changes = options.changes
    with ProgressBar(console) as bar:
        task = bar.add_task("drawing points", total=None, best="")

        def tell(p: Progress) -> None:
            what = (
                f"change {p.stage} of {changes}" if p.stage <= changes else "trying fewer changes"
            )
            best = f"best so far {100 * p.best:.1f} %"
            bar.update(task, description=what, total=p.climbs, completed=p.done, best=best)

        return improved(subject, progress=tell, **vars(options))


def _print_broken(improvement: Improvement, log: Terminal) -> None:
    """Print the rules that the mounted rings violate."""
    broken = improvement.result.broken
    if not broken:
        return
    some, more = [fault.text for fault in broken[:_MOST_LISTED]], len(broken) - _MOST_LISTED
    rest = f"; and {more} more" if more > 0 else ""
    log.lines(
        f"The mounted rings violate rules of the scene and are kept: {'; '.join(some)}{rest}."
    )


def _changes(n: int) -> str:
    return counted(n, "change")


def _show(record: ImproveResult, improvement: Improvement, voxel: float, console: Terminal) -> None:
    """Print the gain and the work of each number of changes, and what to do."""
    result = improvement.result
    console.print(_table(record))
    console.lines(count_error_line(voxel))
    for answer, lines in zip(result.steps, improvement.instructions, strict=True):
        console.print(f"{_changes(len(answer.changes))}:")
        console.lines(*(f"  {line}" for line in lines))
    least = f"{100 * WORTH:g} points"
    last = len(result.steps[-1].changes) if result.steps else 0
    if not last:
        console.print(
            f"No gain: no improvement of {least} or more with up to"
            f" {_changes(record.most_changes)}."
        )
    elif last < record.most_changes and result.outcome is Outcome.FINISHED:
        console.print(
            f"Up to {_changes(record.most_changes)} were searched; more than {last} gain less than"
            f" {least}."
        )
    if result.mounted.short:
        shorts = ", ".join(f"{100 * step.short:.2f}" for step in record.steps)
        console.print(
            f"The minimum coverages (--at-least) are missed by {record.short_percent:.2f} points as"
            f" mounted; after the changes: {shorts or '–'}."
        )
    console.print(
        f"{result.evaluations} evaluations, {result.seconds:.0f} s; {result.outcome.value}."
    )
    console.lines(*(f"  {path}" for path in record.files.values()))


def _table(record: ImproveResult) -> Explained:
    """Return the table of coverage and work by the number of changes."""
    labels = [target_label(r) for r in record.zeta]
    rows = [["0", *(percent(r, r.rule) for r in record.zeta)]]
    for step in record.steps:
        cells = [percent(r, r.rule) for r in step.zeta] or [""] * len(labels)
        w = step.work
        costs = (f"{1000 * w.moved:.0f}", f"{degrees(w.tilted):.1f}", f"{degrees(w.turned):.1f}")
        gain = f"{100 * step.gain:+.2f}"
        rows.append([str(len(step.changes)), *cells, gain, f"{w.sensors:+d}", *costs])
    return Explained.of(
        f"{record.setup}: coverage ζ in percent, and the work of each number of changes",
        ("changes", *labels, "gain", "sensors", "mm", "tilt °", "turn °"),
        rows,
        "changes: rings changed; gain: in percentage points; sensors: added; mm: moved along"
        f" links; tilt, turn: degrees. {target_legend(record.zeta)}",
    )
