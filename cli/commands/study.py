"""The command study."""

import shlex
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from ...coverage.definitions.errors import UserError
from ...studies.engine.options import StudyName, StudyOptions
from ..options.offered import offering

if TYPE_CHECKING:
    from place_rings._study import StudyCall


@offering()
def study(
    name: Annotated[StudyName, Parameter(help="Study to run.")],
    /,
    *,
    target: Annotated[
        tuple[str, ...],
        Parameter(
            name="--target",
            negative=(),
            help="pareto: one of its two targets, as NAME[:RADIUS]. Default: V_S:0.5 and V_S:1.5.",
        ),
    ] = (),
    scene: Annotated[
        Path | None,
        Parameter(name="--scene", help="pareto: scene file. Default: the reference scene."),
    ] = None,
    paper: Annotated[
        bool,
        Parameter(
            name="--paper",
            negative=(),
            help=(
                "pareto: count as the paper does, as bound, convergence, gap and paper always do:"
                " beams pass through the robot, and rings need no room on it."
            ),
        ),
    ] = False,
    layout: Annotated[
        tuple[Path, ...],
        Parameter(
            name="--layout",
            negative=(),
            help=(
                "layouts: layout file (.csv, .toml) to score besides those of the package."
                " Repeatable."
            ),
        ),
    ] = (),
    options: StudyOptions,
    out: Annotated[Path | None, Parameter(help="Output folder. Default: results/NAME.")] = None,
) -> None:
    """Run a study, and write its data, pictures and a page. A stopped study resumes.

    - benchmark: the entries of the benchmark, scored again.
    - bound: how far the search can be from the best setup on a grid, from linear and integer
      programmes.
    - convergence: how coverage depends on the size of the voxels, for each way to count them.
    - detection: predictions of who is noticed, beside a twin in MuJoCo that casts rays.
    - gap: an upper bound on every layout with a number of sensors, beside the best known one.
    - layouts: published layouts of on-robot sensors, scored under the same rules.
    - paper: the measurements of Kumar and Sahin (2019), repeated, beside searched setups.
    - pareto: the best trade-offs between two targets, by default V_S:0.5 and V_S:1.5.
    - robots: what it costs on six robots to ignore the robot's body in the search.

    A study takes minutes to hours; it begins with an estimate, and shows the time left.

    For example:

    ```bash
    place-rings study paper --workers 16
    place-rings study pareto --sensors 24 --quick
    place-rings study pareto --sensors 64 --target V_S:0.5 --target V_OT
    place-rings study layouts --layout mine.csv
    ```

    ``place-rings --help`` explains the terms.
    """
    from place_rings._study import StudyCall

    from ...formats.loader import read_scene
    from ...objectives.scene import Scene
    from ..options.scenes import in_paper
    from ..options.targets import resolve_pair

    if paper and name != "pareto":
        raise UserError(f"--paper: found with study {name}, allowed: only with pareto")
    where = read_scene(scene) if scene else None
    where = in_paper(where or Scene()) if paper else where
    pair = resolve_pair(target, where or Scene()) if target else None
    _run(StudyCall(name, **vars(options), scene=where, targets=pair, layouts=layout, folder=out))


def _run(call: "StudyCall") -> None:
    """Run a study with a progress bar, and print the path of its page."""
    from dataclasses import replace

    from place_rings._study import CELLS, run_study
    from rich.progress import TaskID

    from ...reporting.progress import ProgressBar
    from ...reporting.terminal import Terminal, say
    from ...reporting.text import duration
    from ...studies.engine.estimate import Estimate
    from ..signals import gone_is_an_error

    tasks, expected = dict[str, TaskID](), list[Estimate]()
    alone, console = call.workers == 1 and call.scheduler is None, Terminal(stderr=True)

    def forecast(estimate: Estimate) -> None:
        expected.append(estimate)
        here = f" in {call.workers} processes" if call.workers > 1 else ""
        per = " divided by the number of workers" if call.scheduler is not None else ""
        line = f"{duration(estimate.seconds)} for {estimate.cells} measurements{here}{per}"
        console.lines(f"{call.name}: {line}")

    with ProgressBar(console) as bar, nullcontext() if alone else gone_is_an_error():

        def tell(heading: str, done: int, total: int) -> None:
            if heading not in tasks:
                tasks[heading] = bar.add_task(heading, total=total)
            left = f"{duration(expected[0].left)} left"
            bar.update(tasks[heading], total=total, completed=done, best=left)

        command = shlex.join(["place-rings", *sys.argv[1:]]) if call.name == "pareto" else ""
        try:
            report = run_study(replace(call, progress=tell), forecast, command)
        except KeyboardInterrupt:
            bar.stop()
            say(
                "place-rings: stopped; finished measurements are kept in"
                f" {call.path / CELLS}; run the same command again to resume",
                error=True,
            )
            sys.exit(130)
    say(str(report.page))
