"""The command that betters what is mounted: run, tell step by step what to do, write what was
found.
"""

import math
import shlex
import sys
from contextlib import nullcontext
from pathlib import Path

from rich.table import Table

from ..._proposal import found_model
from ..._validation import check_scene, check_sight
from ...coverage.rings.ring import Setup
from ...coverage.robots.robot import Robot
from ...formats.schema.proposal_models import ProposalFile
from ...formats.schema.redesign_models import ChangeModel, ImproveResult, StepModel, WorkModel
from ...formats.schema.result_models import VerifyResult
from ...formats.schema.ring_models import ring_models
from ...formats.schema.scene_models import SceneModel
from ...formats.writing import made_folder, to_toml, write_text
from ...objectives.criterion import Criterion
from ...objectives.scene import Scene
from ...objectives.verify import Verifier
from ...placement.redesign import redesign as improving
from ...placement.redesign.beam_search import WORTH, Answer
from ...placement.redesign.changes import Change, ChangeKind, turn
from ...placement.search.progress import Outcome, Progress
from ...placement.search.search import SearchResult
from ...reporting.placement_picture import comparison_picture
from ...reporting.progress import ProgressBar
from ...reporting.tables import target_label
from ...reporting.terminal import Terminal, say_json
from ...reporting.text import counted

_MOST_TOLD = 5  # broken rules


def find(
    scene: Scene,
    setup: Setup,
    most: int,
    add_sensors: int,
    seed: int,
    time_cap: float,
    voxel: float,
    console: Terminal,
) -> improving.Improved:
    """Run the search with a progress bar on ``console``."""
    with ProgressBar(console) as bar:
        task = bar.add_task("drawing points", total=None, best="")

        def tell(p: Progress) -> None:
            what = f"change {p.stage} of {most}" if p.stage <= most else "a change less"
            best = f"best so far {100 * p.best:.1f} %"
            bar.update(task, description=what, total=p.climbs, completed=p.done, best=best)

        return improving.improve(
            scene, setup, most, add_sensors, seed, time_cap, voxel=voxel, tell=tell
        )


def told(change: Change, mounted: int, robot: Robot) -> str:
    """What to do to one ring, in a line."""
    before, after = change.before, change.after
    name = f"ring {change.place}" if change.place < mounted else "new ring"
    if after is None:
        there = f" ({before.link}, {before.count} sensors)" if before else ""
        return f"{name}{there}: take away"
    length = robot.mount(after.link).length
    place = f", {1000 * after.position * length:.0f} mm from its proximal end" if length > 0 else ""
    if before is None:
        angles = f"tilt {_deg(after.tilt)}, phase {math.degrees(after.phase):.1f}°"
        return f"{name}: {after.count} sensors on {after.link}{place}, {angles}"
    does = []
    if change.kind is ChangeKind.CARRIED:
        does.append(f"carry to {after.link}{place}")
    elif change.moved:
        way = "distal" if after.position > before.position else "proximal"
        does.append(
            f"move {1000 * change.moved:.0f} mm towards {way}{place.replace(',', ' to', 1)}"
        )
    if change.tilted:
        does.append(f"tilt {_deg(before.tilt)} → {_deg(after.tilt)}")
    if change.turned:
        does.append(f"turn by {_deg(turn(before, after))}")
    if change.sensors:
        does.append(f"{before.count} → {after.count} sensors")
    return f"{name} ({before.link}): {', '.join(does)}"


def _deg(angle: float) -> str:
    return f"{math.degrees(angle):+.1f}°"


def improve(
    name: str,
    setup: Setup,
    scene: Scene,
    most: int,
    add_sensors: int,
    seed: int,
    time_cap: float,
    voxel: float,
    out: Path | None,
    as_json: bool,
) -> None:
    """Find, print and write the best changes to ``setup``, which is called ``name``."""
    console, log = Terminal(), Terminal(stderr=True)
    check_scene(scene, voxel)
    check_sight(scene)
    with made_folder(out) if out else nullcontext() as folder:
        found = find(scene, setup, most, add_sensors, seed, time_cap, voxel, log)
        record = _record(found, scene, name, most, add_sensors, seed, voxel, log)
        if folder:
            record = _written(record, found, scene, folder)
    if as_json:
        say_json(record.model_dump_json(indent=2))
        return
    _show(record, found, scene, console)


def _record(
    found: improving.Improved,
    scene: Scene,
    name: str,
    most: int,
    add_sensors: int,
    seed: int,
    voxel: float,
    log: Terminal,
) -> ImproveResult:
    """What was found as a file holds it, each answer counted goal by goal; the rules that are
    broken are told.
    """
    if found.broken:
        some, more = [f.text for f in found.broken[:_MOST_TOLD]], len(found.broken) - _MOST_TOLD
        rest = f"; and {more} more" if more > 0 else ""
        log.print(
            f"Taken as it is, though it breaks rules: {'; '.join(some)}{rest}.",
            soft_wrap=True,
            highlight=False,
        )
    zetas = _verified(name, scene, [found.mounted, *found.steps], voxel, log)
    return ImproveResult(
        setup=name,
        scene=SceneModel.from_domain(scene),
        most_changes=most,
        add_sensors=add_sensors,
        outcome=found.outcome.value,
        seed=seed,
        seconds=found.statistics.seconds,
        exact_percent=100 * found.mounted.exact,
        short_percent=100 * found.mounted.short,
        rings=ring_models(found.mounted.setup, scene.sensor),
        zeta=zetas[0],
        broken=[f.text for f in found.broken],
        steps=[_step(a, found, scene, z) for a, z in zip(found.steps, zetas[1:], strict=True)],
    )


def _verified(
    name: str, scene: Scene, answers: list[Answer], voxel: float, log: Terminal
) -> list[list[VerifyResult]]:
    """Zeta of all answers for each goal; none of those that come after Ctrl-C."""
    verifier, found = Verifier(scene, voxel), []
    try:
        for answer in answers:
            label = f"{name}, {len(answer.changes)} changes" if answer.changes else name
            found.append(
                [
                    VerifyResult.of(label, verifier.verify(answer.setup, goal.target))
                    for goal in scene.goals
                ]
            )
    except KeyboardInterrupt:
        log.print("interrupted: the count goal by goal ends here, what was found is kept")
    return found + [[]] * (len(answers) - len(found))


def _step(
    answer: Answer, found: improving.Improved, scene: Scene, zeta: list[VerifyResult]
) -> StepModel:
    mounted = len(found.mounted.setup.rings)
    return StepModel(
        exact_percent=100 * answer.exact,
        gain_percent=100 * (answer.exact - found.mounted.exact),
        short_percent=100 * answer.short,
        work=WorkModel.from_domain(answer.work),
        changes=[ChangeModel.of(c, mounted, scene.sensor) for c in answer.changes],
        rings=ring_models(answer.setup, scene.sensor),
        zeta=zeta,
    )


def _written(
    record: ImproveResult, found: improving.Improved, scene: Scene, folder: Path
) -> ImproveResult:
    """The record with its files, which are written: a proposal of each step, a picture, the record
    itself.
    """
    files = {
        f"changes_{len(step.changes)}": folder / f"changes_{len(step.changes)}.toml"
        for step in record.steps
    }
    files |= {"picture": folder / "improve.png"} if found.steps else {}
    record = record.model_copy(update={"files": {k: str(path) for k, path in files.items()}})
    command = shlex.join(["place-rings", *sys.argv[1:]])
    for answer, step in zip(found.steps, record.steps, strict=True):
        result = SearchResult(
            answer.setup, answer.soft, answer.exact, answer.short, found.outcome, found.statistics
        )
        proposal = ProposalFile(
            rings=step.rings,
            scene=record.scene,
            zeta=step.zeta,
            found=found_model(result, record.seed, Criterion(), command),
        )
        n = len(step.changes)
        lines = [told(c, len(record.rings), scene.robot) for c in answer.changes]
        heading = f"What is mounted, with {_changes(n)} by place-rings improve:\n" + "\n".join(
            lines
        )
        write_text(files[f"changes_{n}"], to_toml(proposal, heading))
    if found.steps:
        last = found.steps[-1]
        captions = ("as mounted", f"after {_changes(len(last.changes))}")
        goals = "   ·   ".join(
            f"{target_label(a)}: {a.zeta_percent:.1f} → {b.zeta_percent:.1f} %"
            for a, b in zip(record.zeta, record.steps[-1].zeta, strict=False)
        )
        comparison_picture(
            files["picture"], scene, found.mounted.setup, last.setup, captions, goals
        )
    write_text(folder / "improve.json", record.model_dump_json(indent=2) + "\n")
    return record


def _changes(n: int) -> str:
    return counted(n, "change")


def _show(
    record: ImproveResult, found: improving.Improved, scene: Scene, console: Terminal
) -> None:
    """What each number of changes gains and costs, and what to do."""
    table = Table(title=f"{record.setup}: exact ζ in percent, and the work", title_justify="left")
    labels = [target_label(r) for r in record.zeta]
    for column in ("changes", *labels, "gain", "sensors", "mm", "tilt °", "turn °"):
        table.add_column(column, justify="right")
    table.add_row("0", *(f"{r.zeta_percent:.2f}" for r in record.zeta))
    for step in record.steps:
        cells = [f"{r.zeta_percent:.2f}" for r in step.zeta] or [""] * len(labels)
        w = step.work
        costs = (
            f"{w.sensors_added:+d}",
            f"{w.moved_mm:.0f}",
            f"{w.tilted_deg:.1f}",
            f"{w.turned_deg:.1f}",
        )
        table.add_row(str(len(step.changes)), *cells, f"{step.gain_percent:+.2f}", *costs)
    console.print(table)
    for answer in found.steps:
        console.print(f"{_changes(len(answer.changes))}:")
        for change in answer.changes:
            console.print(
                f"  {told(change, len(record.rings), scene.robot)}", highlight=False, soft_wrap=True
            )
    least = f"{100 * WORTH:g} points"
    last = len(found.steps[-1].changes) if found.steps else 0
    if not last:
        console.print(
            f"No gain: nothing of up to {_changes(record.most_changes)} was found that gains"
            f" {least} or more."
        )
    elif last < record.most_changes and found.outcome is Outcome.FINISHED:
        console.print(
            f"More changes, up to {record.most_changes}, were not found to gain {least} more."
        )
    if found.mounted.short:
        shorts = ", ".join(f"{step.short_percent:.2f}" for step in record.steps)
        console.print(
            f"Floors are missed by {record.short_percent:.2f} points as mounted; step by step:"
            f" {shorts or '–'}."
        )
    console.print(
        f"{found.statistics.evaluations} evaluations, {found.statistics.seconds:.0f} s;"
        f" {found.outcome.value}."
    )
    for path in record.files.values():
        console.print(f"  {path}", highlight=False, soft_wrap=True)
