"""Seeds: the spread of the search's answers over random seeds, with given and with free rings.

Run: python benchmarks seeds                                       an hour or two; can be resumed
     python benchmarks seeds --runs=0                              from existing measurements
     python benchmarks seeds --worlds=paper --scenes=V_OT --rings=free --seeds=3   a part of it
     python benchmarks/seeds.py --quick                            a smoke test
"""

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cell_runs import ONE, answer, listed, measured
from common import table
from place_rings.objectives.scene import CoreScene, paper_scene
from place_rings.placement.search.design import Space
from place_rings.placement.search.layout import ring_layout
from place_rings.placement.search.search import search
from place_rings.reporting.pages import csv_text
from place_rings.studies.engine.digest import digest
from place_rings.studies.engine.provenance import BUSY
from place_rings.studies.engine.store import Cell
from search_scenes import GOALS, poses_of_task

SENSORS, SEEDS = 80, 10
RINGS = ("given", "free")
LIMITS = {"given": 0.3, "free": 0.5}  # points, largest spread
WORLDS = {
    "shadow": "the robot's body hides points, rings have bodies on real mounts",
    "paper": "beams pass through the robot, rings need no room",
}
BEFORE = {("paper", "V_S(1.5)", "free"): 59.04}  # best of three seeds of an earlier search, %
FOLDER = Path(__file__).parent.parent / "results" / "seeds"


@dataclass(frozen=True)
class Spread:
    """The answers of all seeds to one question."""

    world: str
    """Key of ``WORLDS``."""
    scene: str
    """Key of ``GOALS``."""
    rings: str
    """``given``: the paper's five rings; ``free``: any rings."""
    zetas: list[float]
    """Exact ζ of each seed, in percent."""
    seconds: list[float]
    """Processor time of each search, s."""
    others: list[float]
    """Mean share of each core that other processes used."""

    @property
    def points(self) -> float:
        """Best less worst, in points."""
        return max(self.zetas) - min(self.zetas)

    @property
    def too_wide(self) -> bool:
        """Whether the spread exceeds its limit."""
        return self.points > LIMITS[self.rings]


def scene_of(world: str, name: str) -> CoreScene:
    """Return a scene of the UR10."""
    fields: dict[str, Any] = {"goals": GOALS[name]}
    if name == "trajectory":
        fields["poses"] = poses_of_task()
    return paper_scene(**fields) if world == "paper" else CoreScene(**fields)


def measure(world: str, scene: str, rings: str, seed: int, of: str = "") -> dict[str, Any]:
    """Search once; return the exact ζ in percent and the processor time in s."""
    where, start = scene_of(world, scene), time.process_time()
    given = ring_layout(where, 2, SENSORS // 5) if rings == "given" else None
    space = Space(where, given) if given else Space(where, sensors=SENSORS)
    result = search(where, space, seed)
    spent = time.process_time() - start
    return {
        "zeta_percent": round(100 * result.exact, 4),
        "seconds": round(spent, 2),
        "number_of_rings": len(result.setup.rings),
    }


def spreads(results: Sequence[tuple[Cell, dict[str, Any]]]) -> list[Spread]:
    """Return the spread of each question, in their order."""
    by_question: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for cell, result in results:
        key = (cell.arguments["world"], cell.arguments["scene"], cell.arguments["rings"])
        by_question.setdefault(key, []).append(result)
    names = ("zeta_percent", "seconds", "others")
    return [
        Spread(*key, *([result[name] for result in some] for name in names))
        for key, some in by_question.items()
    ]


def page(found: Sequence[Spread]) -> list[str]:
    """Return the tables and what they show."""
    lines = []
    for world, text in WORLDS.items():
        rows = [
            (
                s.scene,
                s.rings,
                len(s.zetas),
                f"{statistics.median(s.zetas):.2f}",
                f"{max(s.zetas):.2f}",
                f"{min(s.zetas):.2f}",
                f"{s.points:.2f}" + (" (too wide)" if s.too_wide else ""),
                f"{statistics.median(s.seconds):.1f}",
            )
            for s in found
            if s.world == world
        ]
        if rows:
            heads = ("scene", "rings", "seeds", "median", "best", "worst", "spread", "processor s")
            lines += [f"World `{world}`: {text}.", "", *table(heads, rows), ""]
    if not lines:
        return ["There are no measurements yet."]
    wide = [f"{s.world}, {s.scene}, {s.rings}" for s in found if s.too_wide]
    lines.append(f"Spread above its limit: {'; '.join(wide) or 'nowhere'}.")
    for s in found:
        if (best := BEFORE.get((s.world, s.scene, s.rings))) is not None:
            median = statistics.median(s.zetas)
            word = "not below" if median >= best else "below"
            lines.append(
                f"{s.scene} with {s.rings} rings in the world `{s.world}`: the median {median:.2f}"
                f" is {word} {best:.2f}, the best of three seeds of an earlier search."
            )
    busy = sum(share > BUSY for s in found for share in s.others)
    runs = sum(len(s.zetas) for s in found)
    lines.append(
        f"During {busy} of {runs} searches other processes used more than {BUSY:g} of the search's"
        " core, which lengthens processor time a little and changes no ζ."
    )
    return lines


def report(arguments: Sequence[str] = ()) -> list[str]:
    """Run missing searches and return Markdown."""
    parser = argparse.ArgumentParser(formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    choices = {"worlds": list(WORLDS), "scenes": list(GOALS), "rings": list(RINGS)}
    for option, some in choices.items():
        parser.add_argument(f"--{option}", default=",".join(some), help="separated by commas")
    parser.add_argument("--seeds", type=int, default=SEEDS, help="number of seeds, from 0")
    parser.add_argument("--runs", type=int, default=10**6, help="largest number of new searches")
    parser.add_argument("--quick", action="store_true", help="one question, two seeds, no files")
    given = parser.parse_args(list(arguments))
    picked = {option: listed(getattr(given, option)) for option in choices}
    for option, some in picked.items():
        if unknown := [one for one in some if one not in choices[option]]:
            parser.error(f"--{option}: found {unknown[0]!r}, allowed: {', '.join(choices[option])}")
    seeds = given.seeds
    if given.quick:
        picked, seeds = {"worlds": ["paper"], "scenes": ["V_S(1.5)"], "rings": ["free"]}, 2
    of = digest(Path(__file__))
    cells = [
        Cell("seeds", {"world": w, "scene": s, "rings": r, "seed": i, "of": of})
        for w in picked["worlds"]
        for s in picked["scenes"]
        for r in picked["rings"]
        for i in range(seeds)
    ]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) if given.quick else FOLDER
        results = measured(Path(__file__), folder, cells, given.runs)
        records = [{k: v for k, v in c.arguments.items() if k != "of"} | r for c, r in results]
        if records:
            (folder / "seeds.csv").write_text(csv_text(records))
    about = (
        f"Exact ζ in percent (voxels of 1 cm) of {SENSORS} sensors on the UR10, searched with"
        f" different random seeds, each in a new process. *Given* rings are the paper's five rings"
        f" of {SENSORS // 5}; with *free* rings the search chooses links, rings and counts. The"
        f" spread is best less worst, in points; its limit is {LIMITS['given']:g} with given and"
        f" {LIMITS['free']:g} with free rings. Processor seconds are medians on one thread, and"
        " include drawing points and the exact count. `results/seeds/seeds.csv` has"
        " every search."
    )
    return [about, "", *page(spreads(results))]


if __name__ == "__main__":
    if sys.argv[1:2] == [ONE]:
        answer(measure, sys.argv[1:])
    else:
        print(*report(sys.argv[1:]), sep="\n")
