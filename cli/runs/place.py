"""The default command: search, verify, compare, show."""

import shlex
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from ...coverage.rings.ring import Setup
from ...formats.scene_checks import check_scene, check_scene_sight
from ...formats.schema.proposal_models import (
    FoundModel,
    ProposalFile,
    ReachedModel,
    ReachModel,
    SearchFile,
)
from ...formats.schema.result_models import VerifyResult
from ...formats.schema.robustness_models import ErrorsModel
from ...formats.schema.sensor_records import sensor_records
from ...formats.writing import made_folder, to_toml, write_text
from ...objectives.criterion import Criterion, judge
from ...objectives.pose_subset import MANY
from ...objectives.scene import Scene
from ...objectives.verify import Verified, Verifier
from ...placement.search import search as searching
from ...placement.search.design import Space
from ...placement.search.fewest_sensors import fewest_sensors
from ...placement.search.progress import Progress as Told
from ...reporting.comparison import PAPER_TARGETS, compared, counted, papers
from ...reporting.lines.motion import record_line, worst_line
from ...reporting.lines.occlusion import mounting_lines, print_sight, without_lines
from ...reporting.lines.protective_volume import protective_lines
from ...reporting.lines.sensors import sensor_lines
from ...reporting.placement_picture import placement_picture
from ...reporting.tables import ring_table, target_label, zeta_table
from ...reporting.terminal import Terminal, say_json

PACKAGES = ("place-rings", "jax", "nlopt", "numpy", "scipy")


def find(
    scene: Scene,
    space: Space,
    seed: int,
    time_cap: float,
    verifier: Verifier,
    console: Terminal,
    aim: Criterion,
) -> searching.SearchResult:
    """Run the search with a progress bar on ``console``; ``verifier`` counts its answer."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.fields[best]}", markup=False),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("drawing points", total=None, best="")

        def tell(p: Told) -> None:
            total, done = p.stages, p.climbed
            what = f"stage {p.stage} of {p.stages}"
            if p.to_count:
                what, total, done = "counting the finalists", p.to_count, p.counted
            bar.update(
                task,
                description=what,
                total=total,
                completed=done,
                best=f"best so far {100 * p.best:.1f} %",
            )

        return searching.search(scene, space, seed, time_cap, tell=tell, aim=aim, verifier=verifier)


def find_fewest(
    scene: Scene,
    wanted: float,
    seed: int,
    time_cap: float,
    voxel: float,
    console: Terminal,
    aim: Criterion,
) -> tuple[searching.SearchResult, ReachModel]:
    """Run the searches for fewest sensors with a progress bar on ``console``."""
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.fields[best]}", markup=False),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("drawing points", total=None, best="")

        def tell(sensors: int, p: Told) -> None:
            bar.update(
                task,
                description=f"{sensors} sensors",
                total=p.stages,
                completed=p.climbed,
                best=f"best so far {100 * p.best:.1f} %",
            )

        found = fewest_sensors(scene, wanted, seed, time_cap, voxel=voxel, tell=tell, aim=aim)
    tried = [
        ReachedModel(sensors=n, exact_percent=100 * v, reached=ok)
        for n, (v, ok) in found.tried.items()
    ]
    return found.result, ReachModel(wanted_percent=100 * wanted, reached=found.reached, tried=tried)


def compare(
    scene: Scene, setup: Setup, known: tuple[Verified, ...], verifier: Verifier, console: Terminal
) -> list[VerifyResult]:
    """Zeta of the proposal and of the paper's setups for all targets, by one verifier; ``known``:
    what is counted already of the proposal."""
    setups = {"proposal": setup} | papers(scene)
    goals, targets = [g.target for g in scene.goals], compared(scene)
    results: list[VerifyResult] = []
    with Progress(*Progress.get_default_columns(), console=console, transient=True) as bar:
        task = bar.add_task("verifying", total=len(targets) * len(setups) * len(scene.poses))
        verifier.at = lambda _: bar.advance(task)
        try:
            for result in counted(
                verifier, setups, targets, goals, {("proposal", v.target): v for v in known}
            ):
                results.append(result)
                bar.update(task, completed=len(results) * len(scene.poses))
        except KeyboardInterrupt:
            console.print("interrupted: the comparison ends here, the proposal is kept")
    return results


def asked_values(
    scene: Scene, setup: Setup, value: float, voxel: float, console: Terminal, aim: Criterion
) -> dict[str, float]:
    """What was asked for, in percent, of the proposal and of the paper's setups, where it is not
    zeta itself.
    """
    if aim.plain:
        return {}
    verifier, found = Verifier(scene, voxel), {"proposal": 100 * value}
    try:
        with console.status("counting what was asked for"):
            for name, one in papers(scene).items():
                found[name] = 100 * judge(verifier, one, aim)[1]
    except KeyboardInterrupt:
        console.print("interrupted: the comparison ends here, the proposal is kept")
    return found


def place(
    scene: Scene,
    space: Space | None,
    reach: float | None,
    seed: int,
    time_cap: float,
    voxel: float,
    out: Path,
    as_json: bool,
    aim: Criterion,
) -> None:
    """Search a placement for ``scene`` that is good by ``aim``, verify it beside the paper's
    setups, and write proposal, picture and result; InfeasibleError where the rules leave none."""
    console, log = Terminal(), Terminal(stderr=True)
    check_scene(scene, voxel)
    check_scene_sight(scene)
    verifier, reached = Verifier(scene, voxel), None
    with made_folder(out) as folder:
        if space is not None:
            result = find(scene, space, seed, time_cap, verifier, log, aim)
        else:
            result, reached = find_fewest(scene, reach or 0.0, seed, time_cap, voxel, log, aim)
        comparison = compare(scene, result.setup, result.verified, verifier, log)
        asked = asked_values(scene, result.setup, result.exact, voxel, log, aim)
        goals = {(g.target.name, g.target.radius) for g in scene.goals}
        mine = [r for r in comparison if r.setup == "proposal" and (r.target, r.radius) in goals]
        files = {key: folder / name for key, name in _FILES.items()}
        proposal = ProposalFile.of(
            result.setup,
            scene,
            zeta=(
                mine
                if len(scene.poses) <= MANY
                else [r.model_copy(update={"poses": []}) for r in mine]
            ),
            found=found_model(result, seed, aim),
        )
        captions = [f"{target_label(r)}: {r.zeta_percent:.1f} % covered" for r in mine]
        placement_picture(
            files["picture"],
            scene,
            result.setup,
            captions or ["interrupted before it was verified"],
        )
        record = SearchFile(
            proposal=proposal,
            soft_minus_exact_percent=100 * (result.soft - result.exact),
            comparison=comparison,
            asked_percent=asked,
            files={key: str(path) for key, path in files.items()},
            reach=reached,
            short_percent=100 * result.short,
            sensors=sensor_records(result.setup),
        )
        write_text(files["result"], record.model_dump_json(indent=2) + "\n")
        write_text(files["proposal"], to_toml(proposal, _HEADING))
    if as_json:
        say_json(record.model_dump_json(indent=2))
        return
    console.print(ring_table(result.setup, scene.robot))
    sensors = {"proposal": result.setup.sensors} | {
        name: one.sensors for name, one in papers(scene).items()
    }
    where = f"robot {scene.robot.name}, occlusion {scene.occlusion}, {len(scene.poses)} pose(s)"
    title = f"ζ in percent, rule centre, voxels of {voxel:g} m, {where}"
    order = {(t.name, t.radius): i for i, t in enumerate(PAPER_TARGETS)}
    console.print(
        zeta_table(
            sorted(comparison, key=lambda r: order.get((r.target, r.radius), -1)), sensors, title
        )
    )
    own = mine[0].unseeing if mine else []
    mount = [f"No real mount: {line}." for line in mounting_lines(scene, result.setup)]
    print_sight(console, comparison, own, scene, [*without_lines(scene, result.setup), *mount])
    if asked:
        each = ", ".join(f"{name} {value:.2f}" for name, value in asked.items())
        console.print(f"Asked for, {aim}, in percent: {each}.", highlight=False)
    spent = result.statistics
    lines = (
        *(worst_line(r) for r in mine),
        record_line(scene),
        *protective_lines(mine, result.setup),
        *sensor_lines(record.sensors),
    )
    for line in lines:
        if line:
            console.print(line, highlight=False, soft_wrap=True)
    sought = " in the worst pose" if scene.over_poses == "worst" and len(scene.poses) > 1 else ""
    sought += f" (voxels of {result.voxel:g} m)" if result.voxel != voxel else ""
    console.print(
        f"Found{sought}: exact {100 * result.exact:.2f} %, soft {100 * result.soft:.2f} % (width"
        f" {1000 * spent.width:g} mm, difference {100 * (result.soft - result.exact):+.2f});"
        f" {spent.starts} starts, {spent.evaluations} evaluations, {spent.seconds:.0f} s;"
        f" {result.outcome.value}."
    )
    if reached:
        console.print(_told(reached))
    if result.short:
        console.print(f"The floors are missed by {100 * result.short:.2f} points.")
    for path in files.values():
        console.print(f"  {path}", highlight=False, soft_wrap=True)
    report = shlex.join(["place-rings", "report", str(files["proposal"]), "--out", str(folder)])
    console.print(f"For a report to read and to print: {report}", highlight=False, soft_wrap=True)


def _told(reached: ReachModel) -> str:
    tried = ", ".join(f"{t.sensors}: {t.exact_percent:.2f}" for t in reached.tried)
    if not reached.reached:
        return (
            f"{reached.wanted_percent:g} % was not reached; sensors and ζ in percent of each"
            f" search: {tried}."
        )
    return (
        f"Fewest sensors found for {reached.wanted_percent:g} %; each search, sensors and ζ in"
        f" percent: {tried}."
    )


_FILES = {"proposal": "proposal.toml", "picture": "placement.png", "result": "result.json"}
_HEADING = """A placement of sensor rings, found by place-rings. Edit it freely, then check it \
again:
  place-rings verify proposal.toml
Positions run from 0 (proximal) to 1 (distal) along a link's mount axis; a tilt is positive \
towards distal."""


def found_model(
    result: searching.SearchResult, seed: int, aim: Criterion | None = None
) -> FoundModel:
    """How a proposal was found, with this command and these versions."""
    spent, aim = result.statistics, aim or Criterion()
    return FoundModel(
        outcome=result.outcome.value,
        seed=seed,
        soft_percent=100 * result.soft,
        exact_percent=100 * result.exact,
        width=spent.width,
        starts=spent.starts,
        evaluations=spent.evaluations,
        seconds=round(spent.seconds, 1),
        command=shlex.join(["place-rings", *sys.argv[1:]]),
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        versions={name: version(name) for name in PACKAGES} | {"python": sys.version.split()[0]},
        redundancy=aim.seen,
        losing=aim.losing,
        tolerant=ErrorsModel.of(aim),
    )
