"""The command that runs a study into a folder."""

import shlex
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from ..placement.loader import output_folder, write_text
from ..studies.convergence import measure
from ..studies.convergence_report import page, picture


def convergence(out: Path) -> None:
    """Measure, draw and write the convergence study; what ``out`` holds already is not measured again."""
    folder = output_folder(out)
    columns = (TextColumn("measuring"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)
        try:
            rows = measure(folder / "data.csv", lambda done, total: bar.update(task, completed=done, total=total))
        except KeyboardInterrupt:
            print(f"place-rings: stopped; what is measured is in {folder / 'data.csv'}, run again to go on", file=sys.stderr)
            sys.exit(130)
    picture(rows, folder / "convergence.png")
    write_text(folder / "README.md", page(rows, shlex.join(["place-rings", "study", "convergence"])))
    print(folder / "README.md")
