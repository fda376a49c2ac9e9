"""The command robustness."""

from ...objectives.options import RobustnessOptions
from ..options.common import Json, Subject
from ..options.groups import NO_FRAMES, REFERENCE, FrameOptions, SceneOptions, SubjectOptions
from ..options.offered import offering


@offering()
def robustness(
    subject: Subject,
    /,
    *,
    place: SceneOptions = REFERENCE,
    mounted: FrameOptions = NO_FRAMES,
    options: RobustnessOptions,
    as_json: Json = False,
) -> None:
    """Compute the coverage that remains after a failure, and with mounting errors.

    It counts the share of the target that at least 1, 2 and 3 sensors cover, the coverage without
    the most important sensor or ring, and the coverage of randomly misplaced rings.

    For example:

    ```bash
    place-rings robustness n2_16_25 --target V_S --radius 0.5
    ```

    ``place-rings --help`` explains the terms.
    """
    from place_rings._robustness import robustness as assess

    from ...coverage.definitions.definition import json_of
    from ...reporting.progress import late_progress
    from ...reporting.tables import losses_line, robustness_table, target_label
    from ...reporting.terminal import Terminal, say_json

    resolved = SubjectOptions(place, mounted=mounted).resolved(subject)
    goals, each = resolved.scene.targets, options.draws * len(resolved.scene.poses)
    with late_progress(Terminal(stderr=True)) as bar:

        def tell(done: int, _: int) -> None:
            bar.start()
            if done:
                bar.advance(bar.task_ids[-1])
            if done % each == 0 and len(bar.task_ids) < len(goals):
                bar.add_task(str(goals[len(bar.task_ids)].target), total=each)

        report = assess(resolved, progress=tell, **vars(options))
    results = list(report.records)
    if as_json:
        say_json(json_of(results if len(results) > 1 else results[0]))
        return
    console = Terminal()
    console.print(robustness_table(results))
    console.lines(*(f"{target_label(r)}: {losses_line(r)}" for r in results))
