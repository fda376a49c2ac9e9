"""Scale of searches.

Sensors, points and poses are doubled; answers of 1,000 sensors are checked independently.

Run: python benchmarks scale                      everything, about half an hour on a quiet machine
     python benchmarks scale --only=sensors       the rows whose name holds the word
     python benchmarks scale --runs=0             the section from existing measurements
"""

import csv
import json
import math
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from common import table
from matplotlib.ticker import FixedLocator, NullLocator
from place_rings.formats.writing import write_text
from place_rings.reporting.pages import csv_text
from place_rings.reporting.plots import COLOURS, GREY, MARKERS, plain, save, sheet
from place_rings.studies.engine.provenance import BUSY, OtherWork

PEERS: tuple[str, ...] = ()
FOLDER = Path(__file__).parent.parent / "results" / "scale"
DATA, PICTURE = FOLDER / "runs.csv", FOLDER / "scale.png"
CHECKED = 1000  # sensors whose answer is checked
_DRAWN = 100_000  # points of that check
LIMITS = {"sensors": 1.0, "points": 1.0, "poses": 1.0, "poses, worst": 1.0}
"""Largest exponent wanted of each series that doubles."""
NOISE = 0.1  # tolerance of a fitted exponent
MEMORY = 1500  # MB, wanted at most
_POSES_SEED, _SWING = 1, 0.4  # rad, by which joints differ from the reference pose


@dataclass(frozen=True)
class Run:
    """One search of a series; defaults are what the series do not vary."""

    series: str
    """What is doubled."""
    size: float
    """Its value."""
    sensors: int = 250
    """Sensors, in any rings."""
    points: float = 1.0
    """Factor of the points of each round of the exchange."""
    poses: int = 1
    """Poses."""
    radius: float = 1.5
    """Radius of the shell, m."""
    worst: bool = False
    """Whether the worst pose counts."""
    mount: str = "free"
    """Whether rings have bodies."""
    occlusion: str = "shadow"
    """Model of self-occlusion."""


RUNS = (
    *(Run("sensors", n, sensors=n) for n in (125, 250, 500, 1000, 2000)),
    *(Run("points", f, points=f) for f in (0.5, 1, 2, 4)),
    *(Run("poses", n, sensors=96, poses=n, radius=0.5) for n in (8, 16, 32, 64)),
    *(Run("poses, worst", n, sensors=96, poses=n, radius=0.5, worst=True) for n in (32, 64, 128)),
    Run("real mounts", CHECKED, sensors=CHECKED, mount="real"),
    Run("paper", CHECKED, sensors=CHECKED, occlusion="ignore"),
)
COLUMNS = ("processor", "wall", "counting", "peak", "rings", "exact", "others", "estimate", "half")


def scene_of(run: Run) -> Any:
    """Return the scene of a run: a UR10 on whose links up to 32 rings fit."""
    from place_rings.coverage.targets import Target
    from place_rings.objectives.mount_rules import Rules
    from place_rings.objectives.scene import CoreScene, Goal, Pose

    real = run.mount == "real"
    rules = Rules(
        mount="real" if real else "free",
        spacing=0.02,
        sensors=(3, 64 if real else 48),
        max_rings_per_link=32,
    )
    scene = CoreScene(
        goals=(Goal(Target("V_S", run.radius)),),
        occlusion="ignore" if run.occlusion == "ignore" else "shadow",
        rules=rules,
        over_poses="worst" if run.worst else "mean",
        **({"ring_radius": 0.15} if real else {}),
    )
    if run.poses > 1:
        rng, base = np.random.default_rng(_POSES_SEED), scene.poses[0].q
        swings = rng.uniform(-_SWING, _SWING, (run.poses, len(base)))
        scene = replace(scene, poses=tuple(Pose(base + swing) for swing in swings))
    return scene


def measure(run: Run) -> dict[str, float]:
    """Search once in this process.

    Returns:
        Processor and wall seconds of the whole search, from the rules to the exact count of the
            finalists; wall seconds of that count; peak memory of the process, MB; rings, exact ζ in
            percent; share of each core that other processes used during the search; and the
            independent estimate with half its interval, or NaN.
    """
    import resource

    from monte_carlo import estimate
    from place_rings.objectives.criterion import Criterion
    from place_rings.placement.search.design import Space
    from place_rings.placement.search.schedule import usual
    from place_rings.placement.search.search import search

    scene, other = scene_of(run), OtherWork()
    work, wall = time.process_time(), time.perf_counter()
    space = Space(scene, sensors=run.sensors)
    schedule = usual(scene, space, Criterion())
    rounds = [replace(r, points=int(r.points * run.points)) for r in schedule]
    result = search(scene, space, schedule=tuple(rounds))
    work, wall = time.process_time() - work, time.perf_counter() - wall
    others = other.share()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    zeta, half = math.nan, math.nan
    if run.sensors >= CHECKED:
        zeta, half = (100 * v for v in estimate(scene, result.setup, _DRAWN, 0))
    counting = result.statistics.counting
    values = (work, wall, counting, peak, len(result.setup.rings), 100 * result.exact, others)
    return dict(zip(COLUMNS, (*values, zeta, half), strict=True))


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Return the slope of a straight line through the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def _key(run: Run) -> tuple[str, str]:
    return run.series, f"{run.size:g}"


def _read() -> dict[tuple[str, str], dict[str, float]]:
    """Return existing measurements by series and size; NaN for a column that the file lacks."""
    if not DATA.exists():
        return {}
    with DATA.open() as file:
        return {
            (row["series"], row["size"]): {c: float(row.get(c, "nan")) for c in COLUMNS}
            for row in csv.DictReader(file)
        }


def _write(run: Run, measured: dict[str, float]) -> None:
    """Put one measurement into the file."""
    each = _read() | {_key(run): measured}
    rows = [
        dict(zip(("series", "size"), _key(one), strict=True))
        | {c: f"{each[_key(one)][c]:.6g}" for c in COLUMNS}
        for one in RUNS
        if _key(one) in each
    ]
    write_text(DATA, csv_text(rows))


def _in_a_process(run: Run) -> dict[str, float]:
    words = [sys.executable, __file__, json.dumps(asdict(run))]
    said = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    measured: dict[str, float] = json.loads(said.splitlines()[-1])
    return measured


def _series(
    name: str, each: dict[tuple[str, str], dict[str, float]]
) -> list[tuple[float, dict[str, float]]]:
    some = [run for run in RUNS if run.series == name and _key(run) in each]
    return [(run.size, each[_key(run)]) for run in some]


def _slopes(each: dict[tuple[str, str], dict[str, float]]) -> list[tuple[str, str, str, str]]:
    """Return the exponents of processor time and of memory for each series that doubles."""
    rows = []
    for name, limit in LIMITS.items():
        some = _series(name, each)
        if len(some) > 1:
            sizes = [size for size, _ in some]
            work, peak = (
                exponent(sizes, [one[key] for _, one in some]) for key in ("processor", "peak")
            )
            held = "yes" if max(work, peak) <= limit + NOISE else "no"
            rows.append((name, f"{work:.2f}", f"{peak:.2f}", held))
    return rows


def _draw(each: dict[tuple[str, str], dict[str, float]]) -> None:
    """Draw processor seconds and memory of each series."""
    figure = sheet(9.6, 3.9)
    work, memory = figure.subplots(1, 2)
    for colour, marker, name in zip(COLOURS, MARKERS, LIMITS, strict=False):
        some = _series(name, each)
        if not some:
            continue
        sizes = np.array([size for size, _ in some]) / some[0][0]
        for ax, key in ((work, "processor"), (memory, "peak")):
            values = [one[key] for _, one in some]
            ax.loglog(sizes, values, color=colour, marker=marker, ms=5, label=name)
    most = work.get_xlim()[1]
    low = work.get_ylim()[0]
    work.loglog([1, most], [low, low * most], color=GREY, ls=":", label="linear")
    plain(work, "Processor seconds of a search", "size, as a multiple of the smallest")
    plain(memory, "Peak memory of its process, MB", "size, as a multiple of the smallest")
    memory.axhline(MEMORY, color=GREY, ls=":")
    for ax in (work, memory):
        ax.xaxis.set_major_locator(FixedLocator([1, 2, 4, 8, 16]))
        ax.yaxis.set_major_locator(FixedLocator([30, 50, 100, 200, 300, 500, 1000, 1500]))
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter("{x:g}")
            axis.set_minor_locator(NullLocator())
    work.legend(frameon=False, fontsize=8)
    save(figure, PICTURE)


def _rows(each: dict[tuple[str, str], dict[str, float]]) -> list[tuple[str, ...]]:
    rows = []
    for run in RUNS:
        if (one := each.get(_key(run))) is None:
            continue
        checked = "-"
        if not math.isnan(one["estimate"]):
            checked = f"{one['estimate']:.2f} ± {one['half']:.2f}"
        numbers = (f"{one[c]:.0f}" for c in ("processor", "wall"))
        more = (f"{one['counting']:.1f}", f"{one['peak']:.0f}", f"{one['rings']:.0f}")
        others = "-" if math.isnan(one["others"]) else f"{one['others']:.2f}"
        rows.append((*_key(run), *numbers, *more, f"{one['exact']:.2f}", checked, others))
    return rows


def report(options: Sequence[str] = ()) -> list[str]:
    """Run what the options name, each search in a new process, and return Markdown."""
    given = dict(word.lstrip("-").split("=", 1) for word in options)
    for run in RUNS:
        if given.get("runs") != "0" and given.get("only", "") in run.series:
            measured = _in_a_process(run)
            _write(run, measured)
            print(run.series, run.size, measured, flush=True)
    each = _read()
    _draw(each)
    columns = (
        *("series", "size", "processor s", "wall s", "of it the exact count", "peak, MB", "rings"),
        *("exact ζ, %", "independent estimate, %", "other work"),
    )
    return [
        "Searches with free rings for V_S(1.5) on a UR10 under `shadow` with the default schedule:"
        ' `mount = "free"`, `spacing = 0.02`, `max_rings_per_link = 32`,'
        " `sensors_per_ring = [3, 48]`, up to 61 rings; 250 sensors unless sensors are doubled."
        " Points are those of the rounds of the exchange, as multiples of the default ones. Poses"
        " have 96 sensors and V_S(0.5); joints differ by up to 0.4 rad. Real mounts are rings of"
        " 0.15 m radius with 3 to 64 sensors, up to 21 of them. `paper` has transparent"
        " bodies.",
        "",
        "Each search runs in a new process with everything that it needs, the exact"
        " count with voxels of 1 cm included. Exponents are slopes of straight lines through the"
        " logarithms of processor seconds and memory, and linear growth is 1. Other work is the"
        " share of each core that other processes used during a search. The"
        f" independent estimate is a 95 % interval from {_DRAWN:,} random points by"
        " `benchmarks/monte_carlo.py`, plain NumPy that tests every point with every sensor and"
        " body.",
        "",
        f"![Growth](scale/{PICTURE.name})",
        "",
        *table(
            ("doubled", "exponent of time", "of memory", f"at most linear, within {NOISE:g}"),
            _slopes(each),
        ),
        "",
        *table(columns, _rows(each)),
        "",
        *_busy(each),
        "A search is NumPy on one thread; only its exact count uses all processors. It uses no"
        " accelerator.",
    ]


def _busy(each: dict[tuple[str, str], dict[str, float]]) -> list[str]:
    """Return a note where other work shared the machine."""
    known = [one["others"] for one in each.values() if not math.isnan(one["others"])]
    if (most := max(known, default=0.0)) <= BUSY:
        return []
    return [
        f"**Provisional:** other processes used up to {100 * most:.0f} % of each core during a"
        " search. Wall seconds say nothing here, and processor seconds may be too high.",
        "",
    ]


if __name__ == "__main__":
    print(json.dumps(measure(Run(**json.loads(sys.argv[1])))))
