"""Curves, tables and figure of the compared searches."""

import itertools
import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from place_rings.reporting.pages import csv_text, table
from place_rings.reporting.plots import COLOURS, GREY, plain, save, sheet
from place_rings.studies.engine.provenance import BUSY

MINE, ANY = "ours", "ours with free rings"
WANTED = 5.0  # required speed relative to the best peer
CLOSE = 0.1  # points that ours may end below the best peer
# columns of a curve: seconds, processor seconds, exact ζ in percent, percent of its own points
WALL, WORK, EXACT = range(3)
_START = 0.5  # s, start of the figure's axes
_IN_A_ROW = 3


@dataclass(frozen=True)
class Run:
    """One run of a method."""

    scene: str
    """Scene of the benchmark."""
    sensors: int
    """Number of sensors."""
    seed: int
    """Random seed."""
    method: str
    """Name of the method."""
    curve: list[list[float]]
    """Wall s, processor s, exact ζ in percent and percent of its own points, for each answer that
    was its best."""
    evaluations: int
    """Number of evaluated candidates."""
    seconds: float
    """Processor time of the whole run, s."""
    rejected: int
    """Answers that break a rule."""
    others: float
    """Mean share of each core that other processes used."""

    @property
    def task(self) -> tuple[str, int]:
        """Scene and number of sensors."""
        return self.scene, self.sensors

    @property
    def end(self) -> float:
        """Best value of the whole run; 0 without an answer."""
        return self.best(math.inf)

    def best(self, seconds: float) -> float:
        """Return the best value until then; 0 before the first answer."""
        return max((p[EXACT] for p in self.curve if p[WORK] <= seconds), default=0.0)

    def reached(self, level: float) -> float:
        """Return the processor seconds to a level; infinite if it was not reached."""
        return next((p[WORK] for p in self.curve if p[EXACT] >= level), math.inf)

    def on(self, times: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
        """Return the best value until each of ``times``; NaN before the first answer."""
        values = np.array([self.best(t) for t in times])
        return np.where(values > 0, values, np.nan)


@dataclass(frozen=True)
class Match:
    """All methods on one scene and budget, as medians over the seeds."""

    scene: str
    """Scene of the benchmark."""
    sensors: int
    """Number of sensors."""
    seeds: dict[str, int]
    """Number of runs of each method."""
    values: dict[str, float]
    """Value of each method when the peers' time is over."""
    ends: dict[str, float]
    """Value of each method at its end."""
    spent: dict[str, float]
    """Processor seconds of each method at its end."""
    rival: str
    """Peer with the best value."""
    times: dict[str, float]
    """Processor seconds of each method to that value; infinite where it is not reached."""

    @property
    def level(self) -> float:
        """The best peer's value."""
        return self.values[self.rival]

    @property
    def sooner(self) -> float:
        """Ratio of the best peer's time to its value and ours; 0 if ours never reaches it."""
        return self.times[self.rival] / self.times[MINE]

    @property
    def ahead(self) -> float:
        """Points by which ours ends above the best peer."""
        return self.ends[MINE] - self.level


def matches(runs: Sequence[Run], seconds: float) -> list[Match]:
    """Return a match for each scene and budget with runs of ours and of a peer."""
    found = []
    for task in dict.fromkeys(r.task for r in runs):
        by_method: dict[str, list[Run]] = {}
        for run in runs:
            if run.task == task:
                by_method.setdefault(run.method, []).append(run)
        peers = [m for m in by_method if m not in (MINE, ANY)]
        if MINE not in by_method or not peers:
            continue

        def medians(
            of: str, argument: float, some: dict[str, list[Run]] = by_method
        ) -> dict[str, float]:
            return {
                m: statistics.median(getattr(r, of)(argument) for r in each)
                for m, each in some.items()
            }

        values = medians("best", seconds)
        rival = max(peers, key=lambda m: values[m])
        found.append(
            Match(
                *task,
                {m: len(each) for m, each in by_method.items()},
                values,
                medians("best", math.inf),
                {m: statistics.median(r.seconds for r in each) for m, each in by_method.items()},
                rival,
                medians("reached", values[rival]),
            )
        )
    return found


def _seconds(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.1f}" if math.isfinite(value) else "not reached"


def _value(match: Match, of: dict[str, float], method: str) -> str:
    if method not in of:
        return "-"
    return f"{of[method]:.2f} ({match.seeds[method]})" if of[method] else "no answer yet"


def tables(found: list[Match], seconds: float) -> list[str]:
    """Return tables of the values and of the times to the best peer's value."""
    peers = [m for m in dict.fromkeys(m for x in found for m in x.values) if m not in (MINE, ANY)]
    values = [
        [
            x.scene,
            str(x.sensors),
            _value(x, x.values, MINE),
            f"{x.ends[MINE]:.2f}",
            *(_value(x, x.values, m) for m in peers),
            f"{x.ahead:+.2f}",
            _value(x, x.ends, ANY),
        ]
        for x in found
    ]
    times = [
        [
            x.scene,
            str(x.sensors),
            f"{x.rival}: {x.level:.2f}",
            _seconds(x.times[x.rival]),
            _seconds(x.times[MINE]),
            f"{x.sooner:.1f}" if x.sooner > 0 else "-",
            _seconds(x.times.get(ANY)),
            _seconds(x.spent[MINE]),
            _seconds(x.spent.get(ANY)),
        ]
        for x in found
    ]
    at = f"at {seconds:g} s"
    return [
        (
            "ζ in percent: medians over the seeds (their number in brackets). *Ahead* is ours at"
            f" its end minus the best peer {at}, on the same rings."
        ),
        "",
        table(
            (
                *("scene", "sensors", f"ours {at}", "ours, end"),
                *(f"{m} {at}" for m in peers),
                *("ahead", f"{ANY}, end"),
            ),
            values,
        ),
        f"Processor seconds until a method's exact value is that of the best peer {at}:",
        "",
        table(
            (
                *("scene", "sensors", f"best peer {at}, %", "the peer, s", "ours, s"),
                *("peer / ours", f"{ANY}, s", "ours until its end, s", f"{ANY}, until its end, s"),
            ),
            times,
        ),
        *_verdict(found),
    ]


def _verdict(found: list[Match]) -> list[str]:
    """Return where ours misses the requirements."""

    def where(wrong: list[Match]) -> str:
        return ", ".join(f"{m.scene} with {m.sensors}" for m in wrong) or "nowhere"

    late = [m for m in found if not m.sooner >= WANTED]
    behind = [m for m in found if m.ahead < -CLOSE]
    below = [m for m in found if ANY in m.ends and m.ends[ANY] < max(m.level, m.ends[MINE])]
    return [
        (
            f"Less than {WANTED:g} times sooner at the best peer's value: {where(late)}. More than"
            f" {CLOSE:g} points below the best peer at the end: {where(behind)}. Free rings not on"
            f" top: {where(below)}."
        ),
        "",
    ]


def picture(runs: Sequence[Run], seconds: float, file: Path) -> None:
    """Draw median and range over the seeds of each method: axes for each scene and budget, three
    in a row.
    """
    panels = list(dict.fromkeys(r.task for r in runs))
    methods = list(dict.fromkeys(r.method for r in runs))
    colours = dict(zip(methods, itertools.cycle(COLOURS), strict=False))
    rows, across = -(-len(panels) // _IN_A_ROW), min(len(panels), _IN_A_ROW)
    figure = sheet(max(4.0 * across, 7.0), 3.4 * rows + 0.8)
    axes = figure.subplots(rows, across, squeeze=False)
    for ax in axes.flat[len(panels) :]:
        ax.set_axis_off()
    last = max([seconds, *(r.seconds for r in runs)])
    times = np.geomspace(_START, last, 300)
    for k, (ax, panel) in enumerate(zip(axes.flat, panels, strict=False)):
        mine = [r for r in runs if r.task == panel and r.curve]
        for method in dict.fromkeys(r.method for r in mine):
            some = [r for r in mine if r.method == method]
            # all seeds have an answer, and none has ended, but for its last value
            upto = times <= max(r.seconds for r in some)
            each = np.array([r.on(times) for r in some])
            known = upto & ~np.isnan(each).any(axis=0)
            if not known.any():
                continue
            low, middle, high = np.quantile(each[:, known], (0, 0.5, 1), axis=0)
            ax.fill_between(times[known], low, high, color=colours[method], alpha=0.18, lw=0)
            ax.plot(
                times[known], middle, color=colours[method], lw=2 if method in (MINE, ANY) else 1.2
            )
        plain(
            ax,
            f"{panel[0]}, {panel[1]} sensors",
            "processor seconds",
            "ζ, percent" if k % _IN_A_ROW == 0 else "",
        )
        ax.set_xscale("log")
        ax.set_xlim(_START, last)
        ax.xaxis.set_major_formatter("{x:g}")
        ax.axvline(seconds, color=GREY, lw=0.8, ls=":")
        if mine:
            ends = [r.end for r in mine]
            margin = 0.1 * (max(ends) - min(ends)) + 0.2
            ax.set_ylim(min(ends) - max(5 * margin, 2.0), max(ends) + margin)
        else:
            ax.text(0.5, 0.5, "not measured", transform=ax.transAxes, ha="center", color=GREY)
    handles = [axes[0][0].plot([], [], color=colours[m], lw=2, label=m)[0] for m in methods]
    figure.legend(
        handles=handles, loc="outside upper center", ncols=len(methods), frameon=False, fontsize=9
    )
    save(figure, file)


def pages(runs: Sequence[Run], folder: Path, seconds: float) -> list[str]:
    """Write curves and figure into a folder and describe them."""
    records = [
        {
            "scene": r.scene,
            "sensors": r.sensors,
            "seed": r.seed,
            "method": r.method,
            "evaluations": r.evaluations or "",  # ours counts none
            "others": r.others,
        }
        | dict(zip(("wall_s", "processor_s", "zeta_percent", "own_percent"), point, strict=True))
        for r in runs
        for point in r.curve
    ]
    if not records:
        return ["There are no measurements yet."]
    (folder / "curves.csv").write_text(csv_text(records))
    picture(runs, seconds, folder / "searches.png")
    found = matches(runs, seconds)
    shown = [
        (
            "![Exact value against processor seconds, method by method: median and range over the"
            f" seeds]({folder.name}/searches.png)"
        ),
        "",
        (
            "Lines are medians over the seeds, bands their range. A line ends where the search"
            " ends; the dotted line is the peers' end."
        ),
        "",
    ]
    busy, wrong = sum(r.others > BUSY for r in runs), sum(r.rejected for r in runs)
    notes = [
        f"During {busy} of {len(runs)} runs other processes used more than {BUSY:g} of the run's"
        f" core. {wrong} counted answers broke a rule and do not count."
    ]
    if not found:
        return [*shown, "No scene has runs of ours and of a peer yet.", "", *notes]
    return [*shown, *tables(found, seconds), *notes]
