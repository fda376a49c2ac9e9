"""Page and pictures of the study of detection."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from scipy import stats

from ...objectives.detection_share import LAW_ERROR
from ...objectives.object_bounds import MOST
from ...reporting.pages import csv_text, table
from ...reporting.plots import COLOURS, GREY, INK, MARKERS, plain, save, sheet
from ..engine.pages import page
from .spheres import ABOVE
from .study import ASKED, CALIBRATED, SPHERES, WALKER, Prediction

_RESAMPLED, _LEVEL = 2000, 0.01
_PIECES = (*ASKED, WALKER)


def write(rows: Sequence[Prediction], folder: Path) -> dict[str, str]:
    """Draw the pictures into ``folder`` and return the texts of the other files by name."""
    calibration_figure(rows, folder / "calibration.png")
    ranking_figure(rows, folder / "ranking.png")
    return {"README.md": _page(rows), "data.csv": csv_text([_record(row) for row in rows])}


def _record(row: Prediction) -> dict[str, object]:
    return (
        {"layout": row.layout, "kind": row.kind, "asked": row.asked}
        | dict(row.question)
        | {"zeta_percent": round(row.zeta_percent, 3)}
        | {"predicted_percent": round(row.predicted_percent, 3), "law_error_points": row.law_error}
        | {"trials": row.trials, "noticed": row.noticed}
        | {
            f"{how}_percent": round(row.means[how], 3) if row.means else ""
            for how in ("best", "any")
        }
        | {f"sphere_{key}": round(value, 3) for key, value in asdict(row.spheres).items()}
    )


def calibrated(rows: Sequence[Prediction], stated: bool = True) -> tuple[int, int, float]:
    """Return how many of the drawn predictions an interval of the twin's frequency holds, how many
    were drawn, and the chance of no more at a true rate of 95 %.

    Args:
        rows: the predictions.
        stated: whether the interval includes the law's stated error.
    """
    trials = [row for row in rows if row.means]
    rng = np.random.default_rng(0)
    drawn = rng.choice(len(trials), min(CALIBRATED, len(trials)), replace=False)
    held = sum(trials[i].holds(trials[i].law_error if stated else 0.0) for i in drawn)
    return held, len(drawn), float(stats.binomtest(held, len(drawn), 0.95, "less").pvalue)


def _asked(rows: Sequence[Prediction], piece: str) -> list[Prediction]:
    """Return what all layouts answer about a piece or a walking person."""
    wanted = "walk" if piece == WALKER else "all"
    return [row for row in rows if row.asked == wanted and row.question["piece"] == piece]


Columns = tuple[np.ndarray, np.ndarray, np.ndarray]


def _columns(rows: Sequence[Prediction]) -> Columns:
    """Return ζ, ζ of detection and the measured frequency, in percent."""
    three = [(row.zeta_percent, row.predicted_percent, row.frequency) for row in rows]
    zeta, predicted, frequency = np.array(three, float).T
    return zeta, predicted, frequency


def _title(piece: str) -> str:
    return f"{piece}, walking" if piece == WALKER else f"{piece}, {100 * ASKED[piece]:.3g} %"


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
    for piece in _PIECES:
        columns = _columns(_asked(rows, piece))
        ranks, errors = compared(columns, rank), compared(columns, _error)
        lines.append(
            [
                _title(piece),
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
        calibration=table(("interval", "held", "of", "chance", "verdict"), _verdicts(rows)),
        differences=table(*_differences(trials)),
        useful=table(heads, lines),
        walking=_walking(rows),
        **_spheres(rows),
        level=f"{100 * _LEVEL:.0f}",
        one=f"{100 * LAW_ERROR[0]:g}",
        several=f"{100 * LAW_ERROR[1]:g}",
    )


def _kinds(rows: Sequence[Prediction]) -> str:
    kinds = {row.layout: row.kind for row in rows}
    counts = {kind: list(kinds.values()).count(kind) for kind in dict.fromkeys(kinds.values())}
    return ", ".join(f"{n} {kind}" for kind, n in counts.items())


def _verdicts(rows: Sequence[Prediction]) -> list[list[str]]:
    lines = []
    for name, stated in (("of the twin's count", False), ("with the law's stated error", True)):
        held, drawn, chance = calibrated(rows, stated)
        verdict = "below 95 %" if chance < _LEVEL else "not below 95 %"
        lines.append([name, f"{held}", f"{drawn}", f"{chance:.2g}", verdict])
    return lines


def _differences(rows: Sequence[Prediction]) -> tuple[list[str], list[list[str]]]:
    """Return what the twin sees beyond the predictions, in points: means, and root mean squares."""
    heads = ["piece", "questions", "predicted", "best zone", "any zone", "spread"]
    lines = []
    for piece in dict.fromkeys(row.question["piece"] for row in rows):
        some = [row for row in rows if row.question["piece"] == piece]
        steps = [
            np.array([row.means[how] - row.predicted_percent for row in some])
            for how in ("best", "any")
        ]
        mean, spread = np.mean([row.predicted_percent for row in some]), np.std(steps[1])
        means = [f"{step.mean():+.1f}" for step in steps]
        lines.append([piece, f"{len(some)}", f"{mean:.1f}", *means, f"{spread:.1f}"])
    return heads, lines


def _walking(rows: Sequence[Prediction]) -> str:
    _, predicted, frequency = _columns(_asked(rows, WALKER))
    return f"{predicted.mean():.1f} % predicted, {frequency.mean():.1f} % seen"


def _spheres(rows: Sequence[Prediction]) -> dict[str, object]:
    """Return what the twin reports of spheres beside the bounds of the largest unseen one."""
    each = {row.layout: row.spheres for row in rows}.values()
    bounded = [one for one in each if one.high_mm < 1000 * MOST]
    tried = [one for one in bounded if one.places]
    worst = min((one.met / one.places for one in tried), default=1.0)
    return {
        "unseen": sum(one.low_mm > 0 for one in each),
        "reports": sum(one.reports for one in each),
        "bounded": len(bounded),
        "spheres": SPHERES,
        "above": f"{100 * (ABOVE - 1):.0f}",
        "around": len(tried),
        "stood": sum(one.places for one in tried),
        "met": sum(one.met for one in tried),
        "least": f", and {100 * worst:.0f} % in the worst layout" if worst < 1 else "",
    }


def calibration_figure(rows: Sequence[Prediction], file: Path) -> None:
    """Plot measured frequencies against predictions, of questions and of places by the law's
    probability there."""
    figure = sheet(9.6, 4.8)
    left, right = figure.subplots(1, 2)
    trials = [row for row in rows if row.means]
    held, drawn, _ = calibrated(rows)
    for row in trials:
        low, high = row.interval(row.law_error)
        colour = COLOURS[0] if row.holds(row.law_error) else COLOURS[1]
        left.plot([row.predicted_percent] * 2, [low, high], color=colour, lw=0.7, alpha=0.45)
        left.plot(row.predicted_percent, row.frequency, "o", color=colour, ms=2.8)
    noticed = "noticed by the twin, percent"
    title = f"questions: {held} of {drawn} intervals hold"
    plain(left, title, "predicted ζ of detection, percent", noticed)
    bins = np.sum([row.bins for row in trials], axis=0)
    filled = bins[0] > 0
    share = 100 * bins[:, filled] / bins[0, filled]
    right.plot(share[1], share[2], "-", marker=MARKERS[0], color=COLOURS[2], ms=5, lw=1.2)
    plain(right, "single places", "probability by the law, percent", noticed)
    _diagonal(left)
    _diagonal(right)
    save(figure, file)


def _diagonal(ax: Axes) -> None:
    ax.plot([0, 100], [0, 100], color=GREY, lw=0.9, ls=(0, (4, 3)), zorder=0.5)
    ax.set(xlim=(-2, 102), ylim=(-2, 102))
    ax.set_aspect("equal")


def ranking_figure(rows: Sequence[Prediction], file: Path) -> None:
    """Plot what the twin noticed of each layout against ζ and against ζ of detection."""
    figure = sheet(2.6 * len(_PIECES), 5.6)
    axes = figure.subplots(2, len(_PIECES), sharex=True, sharey=True)
    for i, piece in enumerate(_PIECES):
        zeta, predicted, frequency = _columns(_asked(rows, piece))
        for ax, x, colour in zip(axes[:, i], (zeta, predicted), COLOURS[1::-1], strict=True):
            _diagonal(ax)
            ax.plot(x, frequency, "o", color=colour, ms=4, alpha=0.75, mew=0)
            ax.annotate(
                f"rank {rank(x, frequency):.2f}", (98, 4), ha="right", fontsize=9, color=INK
            )
        plain(axes[0, i], _title(piece), "", "noticed, percent" if i == 0 else "")
        plain(axes[1, i], "", "", "noticed, percent" if i == 0 else "")
    middle = len(_PIECES) // 2
    axes[0, middle].set_xlabel("ζ of V_S(0.5), percent")
    axes[1, middle].set_xlabel("predicted ζ of detection, percent")
    save(figure, file)
