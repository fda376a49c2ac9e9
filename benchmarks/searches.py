"""Searches under self-occlusion on real mounts: ours, CMA-ES, differential evolution and others.

Run: python benchmarks searches                          everything, hours; it can be resumed
     python benchmarks searches --runs=0                 the section from existing measurements
     python benchmarks searches --scenes=UR10 --seeds=2  a part of it
     python benchmarks searches --only=ours,CMA-ES       some methods
     python benchmarks/searches.py --quick               a smoke test: one robot, one seed, 10 s
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import psutil
from cell_runs import ONE, answer, listed, measured
from common import installed, missing
from place_rings.studies.engine.digest import digest
from place_rings.studies.engine.import_closure import read_code
from place_rings.studies.engine.store import Cell
from search_page import ANY, MINE, Run, pages
from search_peers import PEERS, ours, space_of, until_over
from search_scenes import PAPER, ROBOTS, SENSORS, layout, scene_named
from search_task import POINTS, VOXEL, Judge, Question, Watch, thinned

World = Literal["real", "paper"]

HERE = Path(__file__).parent
SCENES: dict[World, tuple[str, ...]] = {"real": tuple(ROBOTS), "paper": PAPER}
FOLDERS: dict[World, str] = {"real": "searches", "paper": "searches_paper"}
OURS = (MINE, ANY)
# with CMA-ES and differential evolution: the best of the others in the paper's world
USUAL = (*OURS, "CMA-ES", "differential evolution", "CRS2")
SECONDS = 60.0  # processor seconds of a peer: 30 s on two cores
_RULES: dict[World, str] = {
    "real": (
        "The robot's body hides points (`shadow`), and rings have bodies on real mounts. Target:"
        " V_S(0.5) at each robot's default pose. All methods choose position, tilt and phase of"
        " the same rings: two on each link that carries rings and one on the tool, or one on each"
        " link where there is no room for two (Panda), with counts as even as the boards allow"
    ),
    "paper": (
        "Beams pass through the robot, and rings need no room. All methods choose position, tilt"
        " and phase of the rings of the paper's layouts: five for 80 sensors, seven for 112, which"
        " may touch"
    ),
}
_ABOUT = """{rules}. Only `{any}` also chooses links, rings and counts, which no peer can. Peers \
evaluate the share of {points:,} points by the package's own compiled estimator, the fastest \
objective that we have, with their own defaults. They see the feasible set of \
our search: a ring goes to the nearest place that the rules allow, and a candidate that would be \
the best but whose rings collide is rejected. CMA-ES and differential evolution evaluate batches, \
and restart after convergence. Our search ends by its own schedule; a peer ends after {seconds:g} \
processor seconds, as much as two cores do in {half:g} s. Each run is a separate process on a \
core of its own, while the other cores run other methods. The \
clock of ours starts after the imports and includes drawing points; a peer's starts \
after compiling. Afterwards every answer that was a method's best is counted exactly (voxels of \
{voxel:g} cm) and checked against all rules; one that breaks a rule does not count. Values are ζ \
in percent."""


def plan(
    scenes: Sequence[str], sensors: Sequence[int], seeds: int, seconds: float, names: Sequence[str]
) -> list[Cell]:
    """Return all runs: for each scene, budget and seed all methods in a row.

    Other work on the machine then affects all methods. A run is repeated if the code that it
    measures changed, a peer's also for another version of the peer.
    """
    peers = read_code((HERE / "search_peers.py").read_bytes()).form[:12]
    task = digest(HERE / "search_task.py"), digest(HERE / "search_scenes.py")
    rules = " ".join((*task, peers))
    made_of = {
        name: f"{package} {version(package)}, {rules}"
        for name, (package, _) in PEERS.items()
        if installed(package)
    }
    made_of |= dict.fromkeys(OURS, digest(HERE / "search_peers.py"))
    order = [
        (scene, n, seed, name, made_of[name])
        for n in sensors
        for scene in scenes
        for seed in range(seeds)
        for name in names
        if name in made_of
    ]
    keys = ("scene", "sensors", "seed", "method", "of")
    return [
        Cell("search", dict(zip(keys, row, strict=True)) | {"seconds": seconds}) for row in order
    ]


def measure(
    scene: str, sensors: int, seed: int, method: str, seconds: float, of: str = ""
) -> dict[str, Any]:
    """Run once; return the exact values of its answers against the time since the start."""
    where = scene_named(scene)
    if method in OURS:
        watch = Watch(float("inf"))
        ours(where, space_of(where, sensors, any_rings=method != OURS[0]), seed, watch)
    else:
        question = Question(where, layout(where, sensors), seed, Watch(float("inf")))
        watch = question.watch = Watch(seconds)
        until_over(PEERS[method][1], question, seed)
    spent, judge = watch.spent, Judge(where)
    counted = [(s, judge.value(s.setup)) for s in thinned(watch.shown)]
    curve = [
        [round(s.wall, 3), round(s.work, 3), round(100 * value, 4), round(100 * s.value, 4)]
        for s, value in counted
        if value is not None
    ]
    return {
        "curve": curve,
        "evaluations": watch.evaluations,
        "seconds": round(spent, 2),
        "rejected": sum(value is None for _, value in counted),
    }


def report(arguments: list[str] | None = None, world: World = "real") -> list[str]:
    """Run missing measurements, write curves, tables and a figure into a folder, and describe
    them.
    """
    parser = argparse.ArgumentParser(formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument("--scenes", default=",".join(SCENES[world]), help="separated by commas")
    parser.add_argument("--sensors", default=",".join(map(str, SENSORS[world])), help="budgets")
    parser.add_argument("--seeds", type=int, default=5, help="number of seeds, from 0")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="of a peer's processor time")
    parser.add_argument("--only", default=",".join(USUAL), help="methods, separated by commas")
    parser.add_argument(
        "--runs",
        type=int,
        default=10**6,
        help="largest number of new runs; the page shows all existing ones",
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help="one scene, one budget, one seed, 10 s, in a temporary folder unless --out is given",
    )
    parser.add_argument("--out", type=Path, help="folder; by default below results/")
    given = parser.parse_args(arguments or [])
    scenes, names = listed(given.scenes), listed(given.only)
    for option, some, known in (
        ("scenes", scenes, SCENES[world]),
        ("only", names, (*OURS, *PEERS)),
    ):
        if unknown := [one for one in some if one not in known]:
            parser.error(f"--{option}: found {unknown[0]!r}, allowed: {', '.join(known)}")
    budgets = [int(n) for n in listed(given.sensors)]
    every = [*USUAL, *(name for name in PEERS if name not in USUAL)]
    if given.quick:
        cells = plan(scenes[:1], budgets[:1], 1, min(given.seconds, 10.0), names)
        with tempfile.TemporaryDirectory() as temporary:
            return _into(given.out or Path(temporary), cells, given.runs, names, world)
    cells = plan(scenes, budgets, given.seeds, given.seconds, every)
    folder = given.out or HERE.parent / "results" / FOLDERS[world]
    return _into(folder, cells, given.runs, names, world)


def _into(
    folder: Path, cells: list[Cell], runs: int, names: Sequence[str], world: World
) -> list[str]:
    """Measure missing cells of the methods ``names``; describe all that are there."""
    results = measured(
        Path(__file__), folder, cells, runs, lambda cell: cell.arguments["method"] in names
    )
    keys = ("scene", "sensors", "seed", "method")
    every = [Run(*(cell.arguments[k] for k in keys), **result) for cell, result in results]
    seconds = cells[0].arguments["seconds"]
    about = _ABOUT.format(
        rules=_RULES[world],
        any=ANY,
        points=POINTS,
        seconds=seconds,
        half=seconds / 2,
        voxel=100 * VOXEL,
    )
    absent = [missing(package) for package, _ in PEERS.values() if not installed(package)]
    cores = f"This machine has {psutil.cpu_count()} cores."
    return [f"{about} {cores}", "", *pages(every, folder, seconds), *dict.fromkeys(absent)]


if __name__ == "__main__":
    if sys.argv[1:2] == [ONE]:
        answer(measure, sys.argv[1:])
    else:
        print(*report(sys.argv[1:]), sep="\n")
