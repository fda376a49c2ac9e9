"""The command schedule."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ...objectives.options import FiringOptions
from ..options.common import Json, Subject
from ..options.groups import AS_IT_IS, SubjectOptions
from ..options.offered import offering


@offering()
def schedule(
    subject: Subject,
    /,
    *,
    given: SubjectOptions = AS_IT_IS,
    options: FiringOptions,
    out: Annotated[
        Path | None,
        Parameter(help="Output folder for schedule.csv, schedule.png, schedule.json."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Find which sensors may disturb each other, and slots in which no two of them fire together.

    Two sensors of the same wavelength that light the same place may both lose their target. Pairs
    that are not listed are proven apart at all poses of the scene. The slots, the ranging time of
    the sensors' mode and the time on each ring's bus give the rate of each ring.

    For example:

    ```bash
    place-rings schedule n2_16_25 --sensor vl53l1x
    place-rings schedule n2_16_25 --sensor vl53l1x --rate 15 --out firing
    ```

    ``place-rings --help`` explains the terms.
    """
    from place_rings._firing import FILES, firing_schedule

    from ...coverage.definitions.definition import json_of
    from ...reporting.firing_text import firing_lines, firing_table
    from ...reporting.progress import late_progress
    from ...reporting.terminal import Terminal, say_json

    resolved = given.resolved(subject)
    with late_progress(Terminal(stderr=True)) as bar:

        def tell(done: int, total: int) -> None:
            bar.start()
            if done:
                bar.advance(bar.task_ids[-1])
            else:
                bar.add_task("comparing beams", total=total)

        report = firing_schedule(resolved, progress=tell, **vars(options))
    if out is not None:
        report.save(out)
    if as_json:
        say_json(json_of(report.record))
        return
    console = Terminal()
    console.print(firing_table(report.record))
    console.lines(*firing_lines(report.record))
    if out is not None:
        console.lines(f"{out}: {', '.join(FILES)}")
