"""Curves, tables and figure of the compared searches."""

import itertools
import math
import statistics
from dataclasses import dataclass
from pathlib import Path

from place_rings.reporting.pages import csv_text, table
from place_rings.reporting.plots import COLOURS, GREY, plain, save, sheet

MINE, ANY = "ours", "ours, any rings"
SLACK = 0.3  # points below the best peer's last value that define the level
WANTED = 5.0  # required speed relative to the best peer
# columns of a curve: seconds, processor seconds / processors, percent of held-out points
WALL, WORK, HELD = range(3)


@dataclass(frozen=True)
class Run:
    """One run.

    Its curve holds (wall s, work s, percent of held-out points, percent of its own points).
    """

    scene: str
    sensors: int
    seed: int
    method: str
    evaluations: int
    curve: list[list[float]]

    def best(self, seconds: float, clock: int) -> float:
        """Return the best percentage of held-out points until then; 0 before the first answer."""
        return max((p[HELD] for p in self.curve if p[clock] <= seconds), default=0.0)

    def reached(self, level: float, clock: int) -> float:
        """Return the seconds to a level; infinite if it was not reached."""
        return next((p[clock] for p in self.curve if p[HELD] >= level), math.inf)

    def steps(self, clock: int) -> list[tuple[float, float]]:
        """Return seconds and the best percentage until then."""
        tops = itertools.accumulate((p[HELD] for p in self.curve), max)
        return [(p[clock], top) for p, top in zip(self.curve, tops, strict=True)]


@dataclass(frozen=True)
class Match:
    """All methods on one scene and budget, as medians over the seeds.

    It holds the best percentage at the end, the best peer, the level, and the seconds to it of each
    method.
    """

    scene: str
    sensors: int
    seeds: dict[str, int]
    ends: dict[str, float]
    rival: str
    level: float
    seconds: dict[str, float]

    @property
    def sooner(self) -> float:
        """Ratio of the best peer's time to the level and ours; 0 if ours never reaches it."""
        return self.seconds[self.rival] / self.seconds[MINE]

    @property
    def ahead(self) -> float:
        """Points by which ours ends above the best peer."""
        return self.ends[MINE] - self.ends[self.rival]


def matches(runs: list[Run], seconds: float, clock: int) -> list[Match]:
    """Return a match for each scene and budget with runs of ours and of a peer."""
    found = []
    for scene, sensors in dict.fromkeys((r.scene, r.sensors) for r in runs):
        mine = [r for r in runs if (r.scene, r.sensors) == (scene, sensors)]
        by_method = {
            m: [r for r in mine if r.method == m] for m in dict.fromkeys(r.method for r in mine)
        }
        peers = [m for m in by_method if m not in (MINE, ANY)]
        if MINE not in by_method or not peers:
            continue
        ends = {
            m: statistics.median(r.best(seconds, clock) for r in some)
            for m, some in by_method.items()
        }
        rival = max(peers, key=lambda m: ends[m])
        level = ends[rival] - SLACK
        times = {
            m: statistics.median(r.reached(level, clock) for r in some)
            for m, some in by_method.items()
        }
        found.append(
            Match(
                scene, sensors, {m: len(s) for m, s in by_method.items()}, ends, rival, level, times
            )
        )
    return found


def _seconds(value: float) -> str:
    return f"{value:.1f}" if math.isfinite(value) else "not reached"


def tables(found: list[Match], seconds: float) -> list[str]:
    """Return tables of the final values and of the times to the level."""
    methods = list(dict.fromkeys(m for match in found for m in match.ends))
    ends = [
        [match.scene, str(match.sensors), *(_end(match, m) for m in methods), f"{match.ahead:+.2f}"]
        for match in found
    ]
    soon = [
        [
            match.scene,
            str(match.sensors),
            f"{match.level:.2f}",
            _seconds(match.seconds[MINE]),
            f"{match.rival}: {_seconds(match.seconds[match.rival])}",
            f"{match.sooner:.1f}" if math.isfinite(match.sooner) else "-",
            _seconds(match.seconds.get(ANY, math.inf)),
        ]
        for match in found
    ]
    heads = (
        "scene",
        "sensors",
        "level, %",
        "ours, s",
        "best peer, s",
        "best peer / ours",
        f"{ANY}, s",
    )
    return [
        (
            f"Percentage of held-out points covered after {seconds:g} s: medians over the seeds"
            " (their number in brackets). *Ahead* is ours"
        ),
        "minus the best peer, on the same layout.",
        "",
        table(("scene", "sensors", *methods, "ahead"), ends),
        (
            f"Seconds until a method is within {SLACK:g} points of the best peer's final value"
            " (the level):"
        ),
        "",
        table(heads, soon),
        *_verdict(found),
    ]


def _end(match: Match, method: str) -> str:
    return f"{match.ends[method]:.2f} ({match.seeds[method]})" if method in match.ends else "-"


def _verdict(found: list[Match]) -> list[str]:
    """Return where ours misses the requirements."""
    late = [f"{m.scene} with {m.sensors}" for m in found if not m.sooner >= WANTED]
    behind = [f"{m.scene} with {m.sensors}" for m in found if m.ahead < 0]
    return [
        (
            f"Less than {WANTED:g} times faster: {', '.join(late) or 'nowhere'}. Below the best"
            f" peer at the end: {', '.join(behind) or 'nowhere'}."
        ),
    ]


_IN_A_ROW, _FIRST = 3, 0.2  # panels in a row; s, start of their axes


def picture(runs: list[Run], seconds: float, clock: int, file: Path) -> None:
    """Draw all curves: axes for each scene and budget, three in a row."""
    panels = list(dict.fromkeys((r.scene, r.sensors) for r in runs))
    methods = list(dict.fromkeys(r.method for r in runs))
    colours = dict(zip(methods, itertools.cycle(COLOURS), strict=False))
    rows = -(-len(panels) // _IN_A_ROW)
    figure = sheet(4.0 * _IN_A_ROW, 3.4 * rows + 0.6)
    axes = figure.subplots(rows, _IN_A_ROW, squeeze=False)
    for ax in axes.flat[len(panels) :]:
        ax.set_axis_off()
    for k, (ax, (scene, sensors)) in enumerate(zip(axes.flat, panels, strict=False)):
        mine = [r for r in runs if (r.scene, r.sensors) == (scene, sensors) and r.curve]
        for r in mine:
            steps = r.steps(clock)
            x, y = zip(*steps, (seconds, steps[-1][1]), strict=True)
            ax.step(
                x,
                y,
                where="post",
                color=colours[r.method],
                lw=1.8 if r.method == MINE else 1,
                alpha=0.85,
            )
        plain(
            ax,
            f"{scene}, {sensors} sensors",
            "seconds of work",
            "held-out points covered, %" if k % _IN_A_ROW == 0 else "",
        )
        ax.set_xscale("log")
        ax.set_xlim(_FIRST, seconds)
        ax.xaxis.set_major_formatter("{x:g}")
        if mine:
            ends = [r.best(seconds, clock) for r in mine]
            ax.set_ylim(min(ends) - 4, max(ends) + 1)
        else:
            ax.text(0.5, 0.5, "not measured", transform=ax.transAxes, ha="center", color=GREY)
    handles = [axes[0][0].plot([], [], color=colours[m], lw=2, label=m)[0] for m in methods]
    figure.legend(
        handles=handles, loc="outside upper center", ncols=len(methods), frameon=False, fontsize=9
    )
    save(figure, file)


def pages(runs: list[Run], folder: Path, seconds: float, clock: int) -> list[str]:
    """Write curves and figure into a folder and describe them."""
    records = [
        {
            "scene": r.scene,
            "sensors": r.sensors,
            "seed": r.seed,
            "method": r.method,
            "evaluations": r.evaluations,
        }
        | dict(zip(("wall_s", "work_s", "held_out_percent", "own_percent"), point, strict=True))
        for r in runs
        for point in r.curve
    ]
    if not records:
        return ["There are no measurements yet."]
    (folder / "curves.csv").write_text(csv_text(records))
    picture(runs, seconds, clock, folder / "searches.png")
    found = matches(runs, seconds, clock)
    shown = [
        (
            "![Held-out points covered against seconds of work, method by"
            " method](searches/searches.png)"
        ),
        "",
    ]
    return (
        [*shown, *tables(found, seconds)]
        if found
        else ["No scene has runs of ours and of a peer yet."]
    )
