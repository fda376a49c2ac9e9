"""The command that runs a study: show its progress and print the path of its page."""

import sys
from contextlib import nullcontext
from pathlib import Path

from place_rings._study import CELLS, StudyOptions, run_study
from rich.progress import TaskID

from ...reporting.progress import ProgressBar
from ...reporting.terminal import Terminal, say
from ...reporting.text import duration
from ...studies.engine.estimate import Estimate
from ..signals import gone_is_an_error


def study(folder: Path, options: StudyOptions) -> None:
    """Run a study into a folder and print the path of its page."""
    workers, scheduler = options.workers, options.scheduler
    tasks: dict[str, TaskID] = {}
    alone = workers == 1 and scheduler is None
    expected: list[Estimate] = []
    console = Terminal(stderr=True)

    def forecast(estimate: Estimate) -> None:
        expected.append(estimate)
        many = f"{estimate.cells} measurements"
        here = f" in {workers} processes" if scheduler is None and workers > 1 else ""
        per = " divided by the number of workers" if scheduler is not None else ""
        span = duration(estimate.seconds)
        console.print(
            f"{options.name}: {span} for {many}{here}{per}", highlight=False, soft_wrap=True
        )

    with ProgressBar(console) as bar, nullcontext() if alone else gone_is_an_error():

        def tell(heading: str, done: int, total: int) -> None:
            if heading not in tasks:
                tasks[heading] = bar.add_task(heading, total=total)
            left = f"{duration(expected[0].left)} left"
            bar.update(tasks[heading], total=total, completed=done, best=left)

        try:
            report = run_study(options, folder, tell, forecast)
        except KeyboardInterrupt:
            bar.stop()
            kept = folder / CELLS
            say(
                f"place-rings: stopped; finished measurements are kept in {kept}; run the same"
                " command again to resume",
                error=True,
            )
            sys.exit(130)
    say(str(report.page))
