"""Page and pictures of the study of detection."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from scipy import stats

from ...reporting.pages import csv_text, table
from ...reporting.plots import COLOURS, GREY, INK, MARKERS, plain, save, sheet
from ..engine.pages import page
from .study import ASKED, CALIBRATED, Prediction

BODIES = ("plate", "upright")
_TITLES = {
    "plate": "plates that face the sensor",
    "upright": "upright bodies",
    "walker": "walking people",
}
_RESAMPLED, _LEVEL = 2000, 0.01
_PAIRS = (*((piece, "upright") for piece in ASKED), ("person", "walker"))


def write(rows: Sequence[Prediction], folder: Path) -> dict[str, str]:
    """Draw the pictures into ``folder`` and return the texts of the other files by name."""
    calibration_figure(rows, folder / "calibration.png")
    ranking_figure(rows, folder / "ranking.png")
    return {"README.md": _page(rows), "data.csv": csv_text([_record(row) for row in rows])}


def _record(row: Prediction) -> dict[str, object]:
    bodies = ("plate", "upright", "walker")
    return (
        {"layout": row.layout, "kind": row.kind, "asked": row.asked}
        | dict(row.question)
        | {"zeta_percent": round(row.zeta_percent, 3)}
        | {"predicted_percent": round(row.predicted_percent, 3), "trials": row.trials}
        | {f"{body}_noticed": row.noticed.get(body, "") for body in bodies}
        | {
            f"{body}_{how}_percent": round(row.means[f"{body}_{how}"], 3) if row.means else ""
            for body in BODIES
            for how in ("best", "any")
        }
    )


def calibrated(rows: Sequence[Prediction], body: str) -> tuple[int, int, float]:
    """Return how many of the drawn predictions an interval of the twin's frequency holds, how many
    were drawn, and the chance of no more at a true rate of 95 %."""
    trials = [row for row in rows if body in row.noticed]
    rng = np.random.default_rng(0)
    drawn = rng.choice(len(trials), min(CALIBRATED, len(trials)), replace=False)
    held = sum(trials[i].holds(body) for i in drawn)
    return held, len(drawn), float(stats.binomtest(held, len(drawn), 0.95, "less").pvalue)


def _asked(rows: Sequence[Prediction], piece: str, body: str) -> list[Prediction]:
    """Return what all layouts answer about a piece or a walking person."""
    wanted = "walk" if body == "walker" else "all"
    return [row for row in rows if row.asked == wanted and row.question["piece"] == piece]


Columns = tuple[np.ndarray, np.ndarray, np.ndarray]


def _columns(rows: Sequence[Prediction], body: str) -> Columns:
    """Return ζ, ζ of detection and the measured frequency, in percent."""
    three = [(row.zeta_percent, row.predicted_percent, row.frequency(body)) for row in rows]
    zeta, predicted, frequency = np.array(three, float).T
    return zeta, predicted, frequency


def rank(x: np.ndarray, y: np.ndarray) -> float:
    """Return Spearman's rank correlation; 0 where a side does not vary."""
    if np.ptp(x) == 0 or np.ptp(y) == 0:
        return 0.0
    return float(stats.spearmanr(x, y).statistic)


def _error(x: np.ndarray, y: np.ndarray) -> float:
    return float(np.abs(x - y).mean())


def compared(
    columns: Columns, score: Callable[[np.ndarray, np.ndarray], float]
) -> tuple[float, float, float, float, float]:
    """Return the score of ζ, that of ζ of detection, their difference, and the 95 % interval of the
    difference over resampled layouts."""

    def both(index: Any) -> tuple[float, float]:
        zeta, predicted, frequency = (column[index] for column in columns)
        return score(zeta, frequency), score(predicted, frequency)

    n, rng = len(columns[0]), np.random.default_rng(0)
    drawn = [both(rng.integers(n, size=n)) for _ in range(_RESAMPLED)]
    ends = np.quantile([b - a for a, b in drawn], (0.025, 0.975))
    a, b = both(slice(None))
    return a, b, b - a, float(ends[0]), float(ends[1])


def _page(rows: Sequence[Prediction]) -> str:
    trials = [row for row in rows if row.means]
    lines = []
    for piece, body in _PAIRS:
        columns = _columns(_asked(rows, piece, body), body)
        ranks, errors = compared(columns, rank), compared(columns, _error)
        lines.append(
            [
                f"{piece}, walking" if body == "walker" else f"{piece}, {100 * ASKED[piece]:.3g} %",
                f"{columns[2].mean():.1f}",
                f"{ranks[0]:.2f}",
                f"{ranks[1]:.2f}",
                f"{ranks[2]:+.2f} ({ranks[3]:+.2f} to {ranks[4]:+.2f})",
                f"{errors[0]:.1f}",
                f"{errors[1]:.1f}",
                f"{errors[2]:+.1f} ({errors[3]:+.1f} to {errors[4]:+.1f})",
            ]
        )
    heads = ("piece", "noticed", "rank: ζ", "rank: ζ of detection", "gain",
             "error: ζ", "error: ζ of detection", "change")  # fmt: skip
    return page(
        "detection",
        layouts=len({row.layout for row in rows}),
        kinds=_kinds(rows),
        questions=len(trials),
        places=trials[0].trials,
        calibration=table(("twin", "held", "of", "chance", "verdict"), _verdicts(rows)),
        differences=table(*_differences(trials)),
        useful=table(heads, lines),
        walking=_walking(rows),
        level=f"{100 * _LEVEL:.0f}",
    )


def _kinds(rows: Sequence[Prediction]) -> str:
    kinds = {row.layout: row.kind for row in rows}
    counts = {kind: list(kinds.values()).count(kind) for kind in dict.fromkeys(kinds.values())}
    return ", ".join(f"{n} {kind}" for kind, n in counts.items())


def _verdicts(rows: Sequence[Prediction]) -> list[list[str]]:
    lines = []
    for body in BODIES:
        held, drawn, chance = calibrated(rows, body)
        verdict = "below 95 %" if chance < _LEVEL else "not below 95 %"
        lines.append([_TITLES[body], f"{held}", f"{drawn}", f"{chance:.2g}", verdict])
    return lines


def _differences(rows: Sequence[Prediction]) -> tuple[list[str], list[list[str]]]:
    """Return the mean of what the twin sees beyond the prediction, step by step, in points."""
    heads = ["piece", "questions", "predicted", "the law's plate, best zone", "any zone",
             "upright body, best zone", "any zone"]  # fmt: skip
    lines = []
    for piece in dict.fromkeys(row.question["piece"] for row in rows):
        some = [row for row in rows if row.question["piece"] == piece]
        steps = [
            np.mean([row.means[f"{body}_{how}"] - row.predicted_percent for row in some])
            for body in BODIES
            for how in ("best", "any")
        ]
        mean = np.mean([row.predicted_percent for row in some])
        lines.append([piece, f"{len(some)}", f"{mean:.1f}", *(f"{step:+.1f}" for step in steps)])
    return heads, lines


def _walking(rows: Sequence[Prediction]) -> str:
    _, predicted, frequency = _columns(_asked(rows, "person", "walker"), "walker")
    return f"{predicted.mean():.1f} % predicted, {frequency.mean():.1f} % seen"


def calibration_figure(rows: Sequence[Prediction], file: Path) -> None:
    """Plot measured frequencies against predictions: of questions by the twin's body, and of places
    by the law's probability there."""
    figure = sheet(13.5, 4.6)
    axes = figure.subplots(1, 3)
    trials = [row for row in rows if row.means]
    for ax, body in zip(axes, BODIES, strict=False):
        held, drawn, _ = calibrated(rows, body)
        _diagonal(ax)
        for row in trials:
            low, high = row.interval(body)
            colour = COLOURS[0] if row.holds(body) else COLOURS[1]
            ax.plot([row.predicted_percent] * 2, [low, high], color=colour, lw=0.7, alpha=0.45)
            ax.plot(row.predicted_percent, row.frequency(body), "o", color=colour, ms=2.8)
        title = f"{_TITLES[body]}: {held} of {drawn} intervals hold"
        plain(ax, title, "predicted ζ of detection, percent", "noticed by the twin, percent")
    ax = axes[2]
    _diagonal(ax)
    bins = np.sum([row.bins for row in trials], axis=0)
    filled = bins[0] > 0
    for i, body in enumerate(BODIES):
        share = 100 * bins[:, filled] / bins[0, filled]
        ax.plot(
            share[1],
            share[2 + i],
            "-",
            marker=MARKERS[i],
            color=COLOURS[2 + i],
            ms=5,
            lw=1.2,
            label=_TITLES[body],
        )
    ax.legend(frameon=False, fontsize=9)
    plain(ax, "single places", "probability by the law, percent", "noticed by the twin, percent")
    save(figure, file)


def _diagonal(ax: Axes) -> None:
    ax.plot([0, 100], [0, 100], color=GREY, lw=0.9, ls=(0, (4, 3)), zorder=0.5)
    ax.set(xlim=(-2, 102), ylim=(-2, 102))
    ax.set_aspect("equal")


def ranking_figure(rows: Sequence[Prediction], file: Path) -> None:
    """Plot what the twin noticed of each layout against ζ and against ζ of detection."""
    figure = sheet(2.6 * len(_PAIRS), 5.6)
    axes = figure.subplots(2, len(_PAIRS), sharex=True, sharey=True)
    for i, (piece, body) in enumerate(_PAIRS):
        some = _asked(rows, piece, body)
        zeta, predicted, frequency = _columns(some, body)
        for ax, x, colour in zip(axes[:, i], (zeta, predicted), COLOURS[1::-1], strict=True):
            _diagonal(ax)
            ax.plot(x, frequency, "o", color=colour, ms=4, alpha=0.75, mew=0)
            ax.annotate(
                f"rank {rank(x, frequency):.2f}", (98, 4), ha="right", fontsize=9, color=INK
            )
        title = "person, walking" if body == "walker" else f"{piece}, {100 * ASKED[piece]:.3g} %"
        plain(axes[0, i], title, "", "noticed, percent" if i == 0 else "")
        plain(axes[1, i], "", "", "noticed, percent" if i == 0 else "")
    middle = len(_PAIRS) // 2
    axes[0, middle].set_xlabel("ζ of V_S(0.5), percent")
    axes[1, middle].set_xlabel("predicted ζ of detection, percent")
    save(figure, file)
