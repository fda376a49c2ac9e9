"""Table, picture and page of the benchmark's entries."""

from collections.abc import Sequence
from pathlib import Path

from ...reporting.pages import csv_text, escaped, table
from ...reporting.plots import COLOURS, MARKERS, lying, save, sheet
from ..engine.pages import page
from .entries import SECONDS
from .questions import QUESTIONS, VERSION
from .score import CELL, VOXEL, WIDTH
from .study import ScoredEntry


def write(rows: Sequence[ScoredEntry], folder: Path) -> dict[str, str]:
    """Draw the picture into ``folder`` and return the texts of the other files by name."""
    entries_plot(rows, folder / "benchmark.png")
    equal = [row for row in rows if row.equal]
    names = list(dict.fromkeys(row.entry for row in equal))
    outside = [row for row in rows if row.score.broken]
    text = page(
        "benchmark",
        version=VERSION,
        questions=len(QUESTIONS),
        seconds=SECONDS,
        voxel_cm=100 * VOXEL,
        width_points=100 * WIDTH,
        cell_cm=100 * CELL,
        equal=table(
            ("question", "sensors", *names, "ahead"),
            [
                *(_compared(name, equal, names) for name in QUESTIONS),
                _means(equal, names),
                _longest(equal, names),
            ],
        ),
        others=table(
            ("question", "entry", "sensors", "value", "proven interval", "processor s"),
            [_other(row) for row in rows if not row.equal and not row.score.broken],
        ),
        outside=table(
            ("question", "layout", "sensors", "value", "rules that it breaks"),
            [_outside(row) for row in outside],
        ),
        different=sum(row.stated is not None and row.stated != row.score.percent for row in rows),
        answers=sum(row.stated is not None for row in rows),
        widest=f"{max((r.score.high_percent - r.score.low_percent for r in rows), default=0):.1f}",
    )
    return {"README.md": text, "data.csv": csv_text([_record(row) for row in rows])}


def _record(row: ScoredEntry) -> dict[str, object]:
    score = vars(row.score) | {"broken": "; ".join(row.score.broken)}
    first = {"question": row.score.question, "entry": row.entry, "equal_budget": row.equal}
    return first | {"processor_s": row.seconds} | score


def _values(name: str, rows: Sequence[ScoredEntry]) -> dict[str, float]:
    """Return the points of the entries for a question, by their names."""
    return {row.entry: row.score.points for row in rows if row.score.question == name}


def _compared(name: str, rows: Sequence[ScoredEntry], names: Sequence[str]) -> list[str]:
    values = _values(name, rows)
    each = [values.get(entry, 0.0) for entry in names]
    return [f"`{name}`", f"{QUESTIONS[name].sensors}", *_best_in_bold(each), _ahead(each)]


def _means(rows: Sequence[ScoredEntry], names: Sequence[str]) -> list[str]:
    each = [
        sum(_values(name, rows).get(entry, 0.0) for name in QUESTIONS) / len(QUESTIONS)
        for entry in names
    ]
    return ["mean", "", *_best_in_bold(each), _ahead(each)]


def _longest(rows: Sequence[ScoredEntry], names: Sequence[str]) -> list[str]:
    """Return the longest processor time of each entry."""
    each = {name: max(r.seconds or 0.0 for r in rows if r.entry == name) for name in names}
    return ["longest, processor s", "", *(f"{each[name]:.1f}" for name in names), ""]


def _best_in_bold(values: Sequence[float]) -> list[str]:
    best = max(values, default=0.0)
    return [f"**{value:.2f}**" if value == best else f"{value:.2f}" for value in values]


def _ahead(values: Sequence[float]) -> str:
    """Return how far the first is ahead of the best other, in points."""
    return f"{values[0] - max(values[1:]):+.2f}" if len(values) > 1 else "-"


def _other(row: ScoredEntry) -> list[str]:
    s, seconds = row.score, "-" if row.seconds is None else f"{row.seconds:.0f}"
    interval = f"{s.low_percent:.2f} to {s.high_percent:.2f}"
    return [f"`{s.question}`", row.entry, f"{s.sensors}", f"{s.percent:.2f}", interval, seconds]


def _outside(row: ScoredEntry) -> list[str]:
    s = row.score
    more = f", and {len(s.broken) - 1} more" if len(s.broken) > 1 else ""
    broken = escaped(s.broken[0]) + more
    return [f"`{s.question}`", row.entry, f"{s.sensors}", f"{s.percent:.2f}", broken]


def entries_plot(rows: Sequence[ScoredEntry], file: Path) -> None:
    """Plot for each question how far the answers with the equal budget are behind the best known
    one."""
    figure = sheet(8.4, 0.27 * len(QUESTIONS) + 1.5)
    ax = figure.subplots()
    places = [-float(i) for i in range(len(QUESTIONS))]
    valid = [row for row in rows if not row.score.broken]
    best = {name: max(_values(name, valid).values(), default=0.0) for name in QUESTIONS}
    titles = list(dict.fromkeys(row.entry for row in valid if row.equal))
    for title, colour, marker in zip(titles, COLOURS, MARKERS, strict=False):
        mine = {row.score.question: row.score.points for row in valid if row.entry == title}
        at = [(best[q] - mine[q], y) for q, y in zip(QUESTIONS, places, strict=True) if q in mine]
        ax.plot(*zip(*at, strict=True), marker, color=colour, ms=6, label=title, alpha=0.9)
    names = [f"{name}  {best[name]:.1f} %" for name in QUESTIONS]
    lying(ax, places, names, "points behind the best known answer, whose value stands on the left")
    ax.set_xlim(left=-0.6)
    figure.legend(loc="outside upper center", ncols=len(titles), frameon=False, fontsize=9)
    save(figure, file)
