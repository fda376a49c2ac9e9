"""Improve mounted rings: search the best changes, print what to do, and write the proposals."""

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
from ...reporting.tables import Explained, count_error_line, target_label, target_legend
from ...reporting.terminal import Terminal, say_json
from ...reporting.text import counted

_MOST_LISTED = 5  # violated rules that are printed


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
    """Search the best changes, with a progress bar on ``console``.

    Args:
        scene, setup: the scene and the mounted setup.
        most: largest number of changes.
        add_sensors: largest number of sensors to add.
        seed: random seed.
        time_cap: time limit, s.
        voxel: side of a voxel, m.
        console: terminal for the progress.
    """
    with ProgressBar(console) as bar:
        task = bar.add_task("drawing points", total=None, best="")

        def tell(p: Progress) -> None:
            what = f"change {p.stage} of {most}" if p.stage <= most else "trying fewer changes"
            best = f"best so far {100 * p.best:.1f} %"
            bar.update(task, description=what, total=p.climbs, completed=p.done, best=best)

        return improving.improve(
            scene, setup, most, add_sensors, seed, time_cap, voxel=voxel, tell=tell
        )


def change_line(change: Change, mounted: int, robot: Robot) -> str:
    """Return one line that says what to do to one ring."""
    before, after = change.before, change.after
    name = f"ring {change.place}" if change.place < mounted else "new ring"
    if after is None:
        there = f" ({before.link}, {before.count} sensors)" if before else ""
        return f"{name}{there}: remove"
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
            f"move {1000 * change.moved:.0f} mm towards the {way} end, to{place.removeprefix(',')}"
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
    """Search, print and write the best changes to ``setup``, whose name is ``name``."""
    console, log = Terminal(), Terminal(stderr=True)
    check_scene(scene, voxel)
    check_sight(scene, setup)
    with made_folder(out) if out else nullcontext() as folder:
        improved = find(scene, setup, most, add_sensors, seed, time_cap, voxel, log)
        record = _record(improved, scene, name, most, add_sensors, seed, voxel, log)
        if folder:
            record = _written(record, improved, scene, folder)
    if as_json:
        say_json(record.model_dump_json(indent=2))
        return
    _show(record, improved, scene, voxel, console)


def _record(
    improved: improving.Improved,
    scene: Scene,
    name: str,
    most: int,
    add_sensors: int,
    seed: int,
    voxel: float,
    log: Terminal,
) -> ImproveResult:
    """Return the result as a file holds it, with ζ of each target; print the violated rules."""
    if improved.broken:
        some, more = (
            [f.text for f in improved.broken[:_MOST_LISTED]],
            len(improved.broken) - _MOST_LISTED,
        )
        rest = f"; and {more} more" if more > 0 else ""
        log.print(
            f"The mounted rings violate rules of the scene and are kept: {'; '.join(some)}{rest}.",
            soft_wrap=True,
            highlight=False,
        )
    zetas = _verified(name, scene, [improved.mounted, *improved.steps], voxel, log)
    return ImproveResult(
        setup=name,
        scene=SceneModel.from_domain(scene),
        most_changes=most,
        add_sensors=add_sensors,
        outcome=improved.outcome.value,
        seed=seed,
        seconds=improved.statistics.seconds,
        exact_percent=100 * improved.mounted.exact,
        short_percent=100 * improved.mounted.short,
        rings=ring_models(improved.mounted.setup, scene.sensor),
        zeta=zetas[0],
        broken=[f.text for f in improved.broken],
        steps=[
            _step(a, improved, scene, z) for a, z in zip(improved.steps, zetas[1:], strict=True)
        ],
    )


def _verified(
    name: str, scene: Scene, answers: list[Answer], voxel: float, log: Terminal
) -> list[list[VerifyResult]]:
    """Return ζ of all answers for each target; empty lists for answers after Ctrl-C."""
    verifier, counts = Verifier(scene, voxel), []
    try:
        for answer in answers:
            label = f"{name}, {len(answer.changes)} changes" if answer.changes else name
            counts.append(
                [
                    VerifyResult.of(label, verifier.verify(answer.setup, goal.target))
                    for goal in scene.goals
                ]
            )
    except KeyboardInterrupt:
        log.print("interrupted: the count of each target is incomplete; the changes are kept")
    return counts + [[]] * (len(answers) - len(counts))


def _step(
    answer: Answer, improved: improving.Improved, scene: Scene, zeta: list[VerifyResult]
) -> StepModel:
    mounted = len(improved.mounted.setup.rings)
    return StepModel(
        exact_percent=100 * answer.exact,
        gain_percent=100 * (answer.exact - improved.mounted.exact),
        short_percent=100 * answer.short,
        work=WorkModel.from_domain(answer.work),
        changes=[ChangeModel.of(c, mounted, scene.sensor) for c in answer.changes],
        rings=ring_models(answer.setup, scene.sensor),
        zeta=zeta,
    )


def _written(
    record: ImproveResult, improved: improving.Improved, scene: Scene, folder: Path
) -> ImproveResult:
    """Write a proposal for each number of changes, a picture and the record; return the record."""
    files = {
        f"changes_{len(step.changes)}": folder / f"changes_{len(step.changes)}.toml"
        for step in record.steps
    }
    files |= {"picture": folder / "improve.png"} if improved.steps else {}
    record = record.model_copy(update={"files": {k: str(path) for k, path in files.items()}})
    command = shlex.join(["place-rings", *sys.argv[1:]])
    for answer, step in zip(improved.steps, record.steps, strict=True):
        result = SearchResult(
            answer.setup,
            answer.soft,
            answer.exact,
            answer.short,
            improved.outcome,
            improved.statistics,
        )
        proposal = ProposalFile(
            rings=step.rings,
            scene=record.scene,
            zeta=step.zeta,
            found=found_model(result, record.seed, Criterion(), command),
        )
        n = len(step.changes)
        lines = [change_line(c, len(record.rings), scene.robot) for c in answer.changes]
        heading = f"The mounted setup with {_changes(n)} by place-rings improve:\n" + "\n".join(
            lines
        )
        write_text(files[f"changes_{n}"], to_toml(proposal, heading))
    if improved.steps:
        last = improved.steps[-1]
        captions = ("as mounted", f"after {_changes(len(last.changes))}")
        goals = "   ·   ".join(
            f"{target_label(a)}: {a.zeta_percent:.1f} → {b.zeta_percent:.1f} %"
            for a, b in zip(record.zeta, record.steps[-1].zeta, strict=False)
        )
        comparison_picture(
            files["picture"], scene, improved.mounted.setup, last.setup, captions, goals
        )
    write_text(folder / "improve.json", record.model_dump_json(indent=2) + "\n")
    return record


def _changes(n: int) -> str:
    return counted(n, "change")


def _show(
    record: ImproveResult,
    improved: improving.Improved,
    scene: Scene,
    voxel: float,
    console: Terminal,
) -> None:
    """Print the gain and the work of each number of changes, and what to do."""
    table = Table()
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
    console.print(
        Explained(
            f"{record.setup}: coverage ζ in percent, and the work of each number of changes",
            table,
            "changes: rings changed; gain: in percentage points; sensors: added; mm: moved along"
            f" links; tilt, turn: degrees. {target_legend(record.zeta)}",
        )
    )
    if (line := count_error_line(voxel)) is not None:
        console.print(line, highlight=False, soft_wrap=True)
    for answer in improved.steps:
        console.print(f"{_changes(len(answer.changes))}:")
        for change in answer.changes:
            console.print(
                f"  {change_line(change, len(record.rings), scene.robot)}",
                highlight=False,
                soft_wrap=True,
            )
    least = f"{100 * WORTH:g} points"
    last = len(improved.steps[-1].changes) if improved.steps else 0
    if not last:
        console.print(
            f"No gain: no improvement of {least} or more with up to"
            f" {_changes(record.most_changes)}."
        )
    elif last < record.most_changes and improved.outcome is Outcome.FINISHED:
        console.print(
            f"Up to {_changes(record.most_changes)} were searched; more than {last} gain less than"
            f" {least}."
        )
    if improved.mounted.short:
        shorts = ", ".join(f"{step.short_percent:.2f}" for step in record.steps)
        console.print(
            f"The minimum coverages (--at-least) are missed by {record.short_percent:.2f} points as"
            f" mounted; after the changes: {shorts or '–'}."
        )
    console.print(
        f"{improved.statistics.evaluations} evaluations, {improved.statistics.seconds:.0f} s;"
        f" {improved.outcome.value}."
    )
    for path in record.files.values():
        console.print(f"  {path}", highlight=False, soft_wrap=True)
