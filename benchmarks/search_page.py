"""What the runs of searches show: curves, tables and a picture."""

import itertools
import math
import statistics
from dataclasses import dataclass
from pathlib import Path

from place_rings.reporting.pages import csv_text, table
from place_rings.reporting.plots import COLOURS, GREY, plain, save, sheet

MINE, ANY = "ours", "ours, any rings"
SLACK = 0.3  # points below the best peer's last value: the level to be reached
WANTED = 5.0  # times as soon as the best peer
# of a curve's points: seconds, processor seconds over processors, percent of held-out points
WALL, WORK, HELD = range(3)


@dataclass(frozen=True)
class Run:
    """One run: its curve is made of (wall s, work s, percent of held-out points, percent of its own
    points).
    """

    scene: str
    sensors: int
    seed: int
    method: str
    evaluations: int
    curve: list[list[float]]

    def best(self, seconds: float, clock: int) -> float:
        """Best percent of held-out points until then; 0 before the first answer."""
        return max((p[HELD] for p in self.curve if p[clock] <= seconds), default=0.0)

    def reached(self, level: float, clock: int) -> float:
        """Seconds to a level; infinite where it was not reached."""
        return next((p[clock] for p in self.curve if p[HELD] >= level), math.inf)

    def steps(self, clock: int) -> list[tuple[float, float]]:
        """Seconds and best so far."""
        tops = itertools.accumulate((p[HELD] for p in self.curve), max)
        return [(p[clock], top) for p, top in zip(self.curve, tops, strict=True)]


@dataclass(frozen=True)
class Match:
    """All methods on one scene and budget: medians over the seeds of the best at the end, percent;
    the best peer; the level to be reached, and the median seconds to it of each method."""

    scene: str
    sensors: int
    seeds: dict[str, int]
    ends: dict[str, float]
    rival: str
    level: float
    seconds: dict[str, float]

    @property
    def sooner(self) -> float:
        """How many times as soon ours reaches the level as the best peer does; 0: never."""
        return self.seconds[self.rival] / self.seconds[MINE]

    @property
    def ahead(self) -> float:
        """Points by which ours ends above the best peer."""
        return self.ends[MINE] - self.ends[self.rival]


def matches(runs: list[Run], seconds: float, clock: int) -> list[Match]:
    """A match for each scene and budget on which ours and a peer ran."""
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
    """Who was how good at the end, and how soon."""
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
        "ours is sooner by",
        f"{ANY}, s",
    )
    return [
        (
            f"Held-out points covered after {seconds:g} s, percent, medians over the seeds (how"
            " many, in brackets); ahead: ours"
        ),
        "less the best peer, on the same layout.",
        "",
        table(("scene", "sensors", *methods, "ahead"), ends),
        f"Seconds to {SLACK:g} points below the best peer's last value:",
        "",
        table(heads, soon),
        *_verdict(found),
    ]


def _end(match: Match, method: str) -> str:
    return f"{match.ends[method]:.2f} ({match.seeds[method]})" if method in match.ends else "-"


def _verdict(found: list[Match]) -> list[str]:
    """Where ours is not as much better as it should be."""
    late = [f"{m.scene} with {m.sensors}" for m in found if not m.sooner >= WANTED]
    behind = [f"{m.scene} with {m.sensors}" for m in found if m.ahead < 0]
    return [
        (
            f"Not {WANTED:g} times as soon: {', '.join(late) or 'nowhere'}. Below the best peer at"
            f" the end: {', '.join(behind) or 'nowhere'}."
        ),
    ]


_IN_A_ROW, _FIRST = 3, 0.2  # pictures; s, where they begin


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
            "held-out covered, %" if k % _IN_A_ROW == 0 else "",
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
    """Write curves and picture into a folder and describe them."""
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
        return ["Nothing is measured yet."]
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
