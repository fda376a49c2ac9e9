"""Figure of the minimum distance that rings measure."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..simulation.distance import MODES, Table, summary
from .plots import COLOURS, INK, plain, save, sheet

# by setup, mode and target: one table for each seed
Results = Mapping[tuple[str, str, str], Sequence[Table]]
MODE_NAMES = {"ignore": "without self-occlusion", "shadow": "with self-occlusion"}
_MODE_COLOURS = dict(zip(MODES, (COLOURS[0], COLOURS[1]), strict=True))
_FONT = 10.0


def _setups(results: Results) -> list[str]:
    return list(dict.fromkeys(setup for setup, _, _ in results))


def _column(results: Results, key: str, mode: str, thing: str) -> tuple[Any, Any]:
    """Return means and half widths (S,) of ``key`` for all setups."""
    found = [summary(results[setup, mode, thing])[key] for setup in _setups(results)]
    mean, half = np.array(found, float).T
    return mean, np.nan_to_num(half)


def _rows(ax: Axes, names: Sequence[str], labelled: bool) -> None:
    """Set one row for each setup, the first at the top."""
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.grid(False, axis="y")
    ax.tick_params(labelsize=_FONT - 1, labelleft=labelled)


def _bars(
    ax: Axes, results: Results, key: str, thing: str, x: str, title: str, labelled: bool
) -> None:
    """Draw bars of both modes with their intervals, setup by setup."""
    names = _setups(results)
    for k, mode in enumerate(MODES):
        mean, half = _column(results, key, mode, thing)
        at = np.arange(len(names)) + 0.38 * (k - 0.5)
        ax.barh(at, mean, 0.36, color=_MODE_COLOURS[mode])
        low = np.minimum(half, mean)
        ax.errorbar(mean, at, xerr=[low, half], fmt="none", ecolor=INK, elinewidth=1.0, capsize=2)
    plain(ax, title, x=x)
    _rows(ax, names, labelled)
    ax.set_xlim(left=0)


def errors(results: Results, file: Path, thing: str = "human") -> None:
    """Draw the paper's last figure: RMSE and maximum error of the minimum distance by setup."""
    figure = sheet(11, 1.7 + 0.42 * len(_setups(results)))
    left, right = figure.subplots(1, 2)
    _bars(
        left,
        results,
        "rmse_m",
        thing,
        "RMSE of the minimum distance, m",
        f"{thing}: root mean square error",
        True,
    )
    _bars(
        right,
        results,
        "max_error_m",
        thing,
        "largest error of a path, m",
        f"{thing}: maximum error",
        False,
    )
    handles = [
        *(Patch(color=_MODE_COLOURS[mode], label=MODE_NAMES[mode]) for mode in MODES),
        Line2D([], [], color=INK, lw=1, marker="|", ms=6, label="95 % interval over seeded paths"),
    ]
    figure.legend(
        handles=handles, loc="outside upper center", ncols=3, frameon=False, fontsize=_FONT
    )
    save(figure, file)
