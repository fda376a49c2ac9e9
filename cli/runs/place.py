"""The default command: search a placement, compare it, write and print it."""

import shlex
import sys
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from place_rings._proposal import Proposal, proposal_text, write_proposal
from place_rings._search import search

from ...coverage.definitions.errors import UserError
from ...formats.schema.proposal_models import SearchFile
from ...formats.writing import output_files, write_text
from ...objectives.pose_workers import PoseWorkers
from ...objectives.scene import Scene
from ...objectives.verified import Verified
from ...placement.search.options import SearchOptions
from ...placement.search.progress import Outcome, Progress
from ...placement.search.result import Reach, SearchResult
from ...reporting.comparison import papers
from ...reporting.fewest_rings import fewest_rings_line, fewest_rings_table
from ...reporting.lines.occlusion import (
    electronics_lines,
    part_lines,
    price_line,
    print_sight,
    record_line,
    shared_tilt_line,
    unmounted_lines,
    without_lines,
)
from ...reporting.lines.results import (
    fewest_sensors_line,
    gap_line,
    object_lines,
    protective_lines,
    reach_lines,
    sensor_lines,
    worst_line,
)
from ...reporting.placement_picture import placement_picture
from ...reporting.progress import ProgressBar, late_progress
from ...reporting.tables import (
    count_error_line,
    coverage_tables,
    result_caption,
    ring_table,
)
from ...reporting.terminal import Terminal, say_json, say_lines
from ...reporting.text import counted

_FILES = {"proposal": "proposal.toml", "picture": "placement.png", "result": "result.json"}
_INTERRUPTED = "interrupted: the comparison is incomplete; the proposal is kept"


def place(scene: Scene, options: SearchOptions, out: Path, as_json: bool) -> None:
    """Search a placement, compare it with the paper's layouts, and write and print it.

    Args:
        scene: the scene.
        options: options of the search.
        out: output folder.
        as_json: print JSON instead of text.

    Raises:
        InfeasibleError: if no setup satisfies the rules of the scene.
    """
    console, log = Terminal(), Terminal(stderr=True)
    workers = PoseWorkers.of_motion(len(scene.poses))
    with output_files(out, *_FILES.values(), keep=True) as new, workers:
        proposal = _searched(scene, options, log)
        comparison, criterion = _compared(proposal, log), _compared_criterion(proposal, log)
        with log.status("bounding the largest gap") if _gapped(scene) else nullcontext():
            mine = proposal.own_records(comparison)
        paths = {key: str(out / name) for key, name in _FILES.items()}
        record = proposal.search_file(comparison, criterion, paths)
        try:
            write_proposal(new / _FILES["proposal"], record.proposal)
        except UserError:  # a full disk: what was found is not lost
            say_lines(proposal_text(record.proposal))
            raise
        write_text(new / _FILES["result"], record.model_dump_json(indent=2) + "\n")
        captions = [result_caption(r) for r in mine]
        placement_picture(
            new / _FILES["picture"],
            scene,
            proposal.setup,
            captions or ["interrupted before it was verified"],
        )
    if as_json:
        say_json(record.model_dump_json(indent=2))
        return
    _show(proposal, record, mine, options.voxel, console)
    report = shlex.join(["place-rings", "report", paths["proposal"], "--out", str(out)])
    console.lines(*(f"  {path}" for path in paths.values()), f"For a report: {report}")


def _gapped(scene: Scene) -> bool:
    """Return whether a target states the largest gap."""
    return any(goal.largest_gap is not None for goal in scene.targets)


def _searched(scene: Scene, options: SearchOptions, console: Terminal) -> Proposal:
    """Return the result of the search; its progress goes to ``console``, and then the parts of the
    target that no sensor reaches, which are computed meanwhile."""
    lines = list[Future[list[str]]]()
    with ThreadPoolExecutor(1) as thread, late_progress(console) as bar:
        task = bar.add_task("drawing points", total=None, best="")

        def tell(p: Progress) -> None:
            if p == Progress():  # the request is valid, the search has not begun
                console.lines(*electronics_lines(scene))
                lines.append(thread.submit(reach_lines, scene))
            bar.start()
            if p == Progress():
                return
            total, done = p.stages or None, p.climbed
            what = f"stage {p.stage} of {p.stages}" if p.stages else "drawing points"
            if p.sensors is not None:
                what = f"{p.sensors} sensors"
            elif p.rings is not None:
                what = f"{counted(p.rings, 'ring')}, {what}"
            elif p.to_count:
                what, total, done = "counting the finalists", p.to_count, p.counted
            if p.searches > 1:
                what = f"search {p.search} of {p.searches}, {what}"
            best = f"best so far {100 * p.best:.1f} %"
            bar.update(task, description=what, total=total, completed=done, best=best)

        proposal = search(scene, progress=tell, **vars(options))
        command = shlex.join(["place-rings", *sys.argv[1:]])
        found = replace(proposal.found, command=command)  # type: ignore[type-var]
    console.lines(*(line for each in lines for line in each.result()))
    return replace(proposal, found=found)


def _compared(proposal: Proposal, console: Terminal) -> list[Verified]:
    """Return ζ of the proposal and of the paper's layouts for all targets."""
    with ProgressBar(console) as bar:
        task = bar.add_task("verifying", total=None)
        results = proposal.compare(
            lambda done, total: bar.update(task, completed=done, total=total)
        )
        total = bar.tasks[0].total
        if total is None or len(results) * len(proposal.scene.poses) < total:
            console.print(_INTERRUPTED)
    return results


def _compared_criterion(proposal: Proposal, console: Terminal) -> dict[str, float]:
    """Return the search criterion, in percent, of the proposal and of the paper's layouts.

    It is empty if the criterion is ζ itself.
    """
    if proposal.criterion.plain:
        return {}
    with console.status("counting the search criterion"):
        values = proposal.compare_criterion()
        if len(values) < 1 + len(papers(proposal.scene)):
            console.print(_INTERRUPTED)
    return values


def _show(
    proposal: Proposal,
    record: SearchFile,
    mine: list[Verified],
    voxel: float,
    console: Terminal,
) -> None:
    """Print the rings, ζ next to the paper's layouts, and how the search ended."""
    scene, setup, comparison = proposal.scene, proposal.setup, record.comparison
    console.print(ring_table(setup, scene.robot, record.sensitivity))
    compared = {"proposal": setup} | papers(scene)
    sensors = {name: one.sensors for name, one in compared.items()}
    prices = {
        name: scene.prices.text(price.total)
        for name, one in compared.items()
        if scene.prices is not None and (price := scene.price_of(one)) is not None
    }
    where = (
        f"robot {scene.robot.name}, occlusion {scene.occlusion},"
        f" {counted(len(scene.poses), 'pose')}, rule sampled, voxels of {voxel:g} m"
    )
    for table in coverage_tables(comparison, sensors, where, prices):
        console.print(table)
    console.lines(count_error_line(voxel))
    own = mine[0].unseeing if mine else []
    mount = [*without_lines(scene, setup), *unmounted_lines(mine)]
    if any(r.unmounted for r in comparison if r not in mine):
        mount.append("place-rings verify names the rings of a layout that cannot be mounted.")
    print_sight(console, comparison, own, scene, mount)
    if record.asked_percent:
        each = ", ".join(f"{name} {value:.2f}" for name, value in record.asked_percent.items())
        console.print(
            f"Search criterion ({proposal.criterion}), in percent: {each}.", highlight=False
        )
    console.lines(
        shared_tilt_line(scene, setup),
        *part_lines(mine),
        price_line(scene, setup),
        *(worst_line(r) for r in mine),
        record_line(scene),
        *protective_lines(mine, setup),
        *object_lines(mine),
        *sensor_lines(record.sensors),
    )
    if proposal.search is not None:
        _show_search(proposal.search, scene, voxel, console)
        console.lines(_chance_line(record, proposal.search))
    console.lines(gap_line(record.gap), fewest_sensors_line(record.gap, record.reach))
    if record.reach:
        console.print(_reached_line(record.reach))
    if record.fewest_rings:
        console.print(fewest_rings_table(record.fewest_rings, scene.prices))
        console.print(fewest_rings_line(record.fewest_rings), highlight=False)
    if record.short_percent:
        console.print(
            f"The minimum coverages (--at-least) are missed by {record.short_percent:.2f} points."
        )


def _show_search(result: SearchResult, scene: Scene, voxel: float, console: Terminal) -> None:
    sought = " in the worst pose" if scene.over_poses == "worst" and len(scene.poses) > 1 else ""
    sought += f" (voxels of {result.voxel:g} m)" if result.voxel != voxel else ""
    value = "coverage" if result.detection is None else "expected share with detection"
    console.print(
        f"Search{sought}: {value} {100 * result.exact:.2f} %; {result.starts} starts,"
        f" {result.seconds:.0f} s, of which start-up {result.start_up:.1f} s;"
        f" {result.outcome.value}.",
        highlight=False,
    )
    stages = [f"{one.name} {100 * one.value:.2f} % in {one.seconds:.1f} s" for one in result.stages]
    if stages:
        console.print(f"Stages: {', '.join(stages)}.", highlight=False)
    if result.slope is not None:
        console.print(
            f"After {result.evaluations} gradients the slope left is {100 * result.slope:.3f}"
            " points by mm and degree.",
            highlight=False,
        )


def _chance_line(record: SearchFile, result: SearchResult) -> str | None:
    """Return what chance decides and more time may add; None where searches share their time, or
    where time was short."""
    if record.searches:
        each = [
            f"{one.seed}: {100 * one.exact:.2f}"
            + (f" (misses minimums by {100 * one.short:.2f})" if one.short else "")
            for one in record.searches
        ]
        best = next(one.seed for one in record.searches if one.best)
        return (
            f"Coverage in percent by the seed of each search: {', '.join(each)}. The answer is that"
            f" of seed {best}."
        )
    fewest = record.reach is not None or record.fewest_rings is not None
    if fewest or result.outcome is not Outcome.FINISHED:
        return None
    return "Another random seed may end a little higher: --searches 3 keeps the best of three."


def _reached_line(reached: Reach) -> str:
    tried = ", ".join(f"{t.sensors}: {100 * t.exact:.2f}" for t in reached.tried)
    if not reached.reached:
        return (
            f"{100 * reached.wanted:g} % was not reached. Each search, as sensors: coverage in"
            f" percent: {tried}."
        )
    return (
        f"Fewest sensors that reached {100 * reached.wanted:g} %: see the table. Each search, as"
        f" sensors: coverage in percent: {tried}."
    )
