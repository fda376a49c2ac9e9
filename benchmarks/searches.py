"""Searches: comparison of ours, CMA-ES, differential evolution, TPE, CRS2, ISRES.

Run: python benchmarks searches                              everything, hours; it can be resumed
     python benchmarks searches --runs=0                     the section from existing measurements
     python benchmarks/searches.py --scenes V_OT --seeds 2   a part of it
     python benchmarks/searches.py --quick                   a smoke test
"""

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from common import installed, missing
from place_rings.placement.search.search import search
from place_rings.studies.engine.digest import program
from place_rings.studies.engine.store import Cell, Store
from search_page import ANY, MINE, Run, pages
from search_peers import PEERS, ours, space_of, until_over
from search_task import (
    HELD_OUT,
    POINTS,
    RINGS_PER_LINK,
    SCENES,
    Question,
    Watch,
    held_out,
    layout,
    scene_named,
)

FOLDER = Path(__file__).parent.parent / "results" / "searches"
OURS = (MINE, ANY)
_FIRST = ("V_S(0.5)", "near + far", "trajectory")
_GAP = 0.05  # s, shortest interval between two judged setups
_MARK = "result: "
CLOCKS = ("wall", "work")
_TIMES = {
    "wall": "Seconds are wall time.",
    "work": (
        "Seconds are processor seconds / number of processors: the time on an idle machine for a"
        " method that keeps all processors busy, independent of other work. They flatter methods"
        " that use one processor at a time. Wall times are in `curves.csv`."
    ),
}
_ABOUT = """All methods choose the same numbers within the same bounds: positions, tilts and \
phases of the paper's five or seven rings of 16 sensors, which may touch. Only `{any}` also \
chooses rings and counts, which no peer can. Peers evaluate the exact share of {points:,} points \
by the function that our search scores with, on all processors, with their own defaults. CMA-ES \
and differential evolution evaluate batches and restart after convergence. Each run is a separate \
process: its clock starts after the imports and includes drawing points and compiling. The best \
answers of a method are judged afterwards on {held:,} points that none has used. Methods run \
alternately, so that other work on the machine affects all of them."""


def _about(clock: str) -> str:
    return " ".join(
        [*_ABOUT.format(any=OURS[1], points=POINTS, held=HELD_OUT).split(), _TIMES[clock]]
    )


def _digest() -> str:
    text = b"".join(
        (Path(__file__).parent / f"search_{part}.py").read_bytes() for part in ("task", "peers")
    )
    return hashlib.sha256(text).hexdigest()[:12]


def plan(
    scenes: list[str], sensors: list[int], seeds: int, seconds: float, clock: str
) -> list[Cell]:
    """Return all runs: for each scene, budget and seed all methods in a row.

    Other work on the machine then affects all methods. A peer's run is repeated for another version
    of the peer, one of ours for other code.
    """
    made_of = {
        name: f"{package} {version(package)}"
        for name, (package, _) in PEERS.items()
        if installed(package)
    }
    made_of = dict.fromkeys(OURS, program(search)) | made_of
    order = [(s, n) for s in SCENES for n in RINGS_PER_LINK if s in scenes and n in sensors]
    order.sort(key=lambda sn: (sn[1], sn[0] not in _FIRST))
    return [
        Cell(
            "search",
            {
                "scene": s,
                "sensors": n,
                "seed": seed,
                "method": method,
                "seconds": seconds,
                "clock": clock,
                "of": of,
            },
        )
        for s, n in order
        for seed in range(seeds)
        for method, of in made_of.items()
    ]


def measure(
    scene: str, sensors: int, seed: int, method: str, seconds: float, clock: str, of: str = ""
) -> dict[str, Any]:
    """Run once; return coverage of held-out points by the answers against the time since the
    start.
    """
    asked = scene_named(scene)
    watch = Watch(seconds, work=clock == CLOCKS[1])
    if method in OURS:
        ours(asked, space_of(asked, sensors, any_rings=method != OURS[0]), seed, watch)
    else:
        until_over(PEERS[method][1], Question(asked, layout(asked, sensors), seed, watch), seed)
    later = [*watch.shown[1:], None]
    shown = [
        s
        for s, after in zip(watch.shown, later, strict=True)
        if after is None or after.work - s.work > _GAP
    ]
    worth = held_out(asked, [s.setup for s in shown]) if shown else []
    curve = [
        [round(s.wall, 3), round(s.work, 3), round(100 * w, 4), round(100 * s.value, 4)]
        for s, w in zip(shown, worth, strict=True)
    ]
    return {"curve": curve, "evaluations": watch.evaluations}


def in_a_process(cell: Cell) -> dict[str, Any]:
    """Run in a separate process, so that compilation counts."""
    found = subprocess.run(
        [sys.executable, __file__, "--one", json.dumps(cell.arguments)],
        capture_output=True,
        text=True,
    )
    if found.returncode:
        raise SystemExit(f"{cell.key}: {found.stderr}")
    return json.loads(
        next(line for line in found.stdout.splitlines() if line.startswith(_MARK)).removeprefix(
            _MARK
        )
    )


def report(arguments: list[str] | None = None) -> list[str]:
    """Run missing measurements, write curves, tables and figures into a folder, and describe
    them.
    """
    parser = argparse.ArgumentParser()
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument(
        "--sensors", nargs="+", type=int, choices=list(RINGS_PER_LINK), default=list(RINGS_PER_LINK)
    )
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--methods", nargs="+", choices=[*OURS, *PEERS], default=[*OURS, *PEERS])
    parser.add_argument("--clock", choices=CLOCKS, default=CLOCKS[1])
    parser.add_argument(
        "--runs",
        type=int,
        default=10**6,
        help="largest number of new runs; the pages show all existing ones",
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help="one scene, one seed, few seconds, in a temporary folder",
    )
    asked = parser.parse_args(arguments or [])
    if asked.quick:
        with tempfile.TemporaryDirectory() as folder:
            return _into(
                Path(folder),
                plan(["V_S(0.5)"], [80], 1, min(asked.seconds, 6.0), asked.clock),
                asked.runs,
            )
    FOLDER.mkdir(parents=True, exist_ok=True)
    cells = plan(asked.scenes, asked.sensors, asked.seeds, asked.seconds, asked.clock)
    return _into(FOLDER, cells, asked.runs, asked.methods)


def _into(
    folder: Path, cells: list[Cell], runs: int, methods: Sequence[str] = (*OURS, *PEERS)
) -> list[str]:
    found: list[Run] = []
    with Store(folder / "runs.sqlite", _digest()) as store:
        for cell in cells:
            result = store.get(cell)
            if result is None and runs > 0 and cell.arguments["method"] in methods:
                runs -= 1
                result = in_a_process(cell)
                store.put(cell, result, cell.arguments["seconds"])
                last = result["curve"][-1] if result["curve"] else None
                print(
                    *(cell.arguments[k] for k in ("scene", "sensors", "seed", "method")),
                    last,
                    flush=True,
                )
            if result is not None:
                key = (cell.arguments[k] for k in ("scene", "sensors", "seed", "method"))
                found.append(Run(*key, result["evaluations"], result["curve"]))
    seconds, clock = (cells[0].arguments[key] for key in ("seconds", "clock"))
    lines = pages(found, folder, seconds, CLOCKS.index(clock))
    return [
        _about(clock),
        "",
        *lines,
        *(missing(package) for package, _ in PEERS.values() if not installed(package)),
    ]


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        print(_MARK + json.dumps(measure(**json.loads(sys.argv[2]))))
    else:
        print(*report(sys.argv[1:]), sep="\n")
