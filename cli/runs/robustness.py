"""Print how robust a setup is against failed sensors and rings and against mounting errors."""

from place_rings._robustness import robustness as assess
from place_rings._validation import ResolvedSetup

from ...coverage.definitions.definition import json_of
from ...objectives.options import RobustnessOptions
from ...reporting.robustness import lines, robustness_table
from ...reporting.tables import target_label
from ...reporting.terminal import Terminal, say_json
from .late_progress import late_progress


def robustness(subject: ResolvedSetup, options: RobustnessOptions, as_json: bool) -> None:
    """Print redundancy and tolerance of a setup for its scene's goals."""
    goals, each = subject.scene.targets, options.draws * len(subject.scene.poses)
    with late_progress(Terminal(stderr=True)) as bar:

        def tell(done: int, _: int) -> None:
            bar.start()
            if done:
                bar.advance(bar.task_ids[-1])
            if done % each == 0 and len(bar.task_ids) < len(goals):
                bar.add_task(str(goals[len(bar.task_ids)].target), total=each)

        report = assess(subject, progress=tell, **vars(options))
    results = list(report.records)
    if as_json:
        records = [json_of(r) for r in results]
        say_json(records[0] if len(records) == 1 else "[" + ",\n".join(records) + "]")
        return
    console = Terminal()
    console.print(robustness_table(results))
    for r in results:
        console.print(f"{target_label(r)}: {lines(r)}", soft_wrap=True, highlight=False)
