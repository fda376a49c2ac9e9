"""Figure of the paper's coverage measurements, with the searched setups."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from ...reporting.plots import COLOURS, GREY, INK, MARKERS, plain, save, sheet
from .coverage_cells import (
    BUDGETS,
    COUNTS,
    GOALS,
    NEAR,
    PUBLISHED,
    SETUPS,
    TARGETS,
    THETAS,
    CoverageRow,
)

COUNT_NAMES = {"centre": "unbiased (centre, 1 cm)", "touch": "touched voxels of 10 cm"}
_CHAIN = "ur10"
_SEARCHED = tuple(f"{goal} {n}" for n in BUDGETS for goal in GOALS)
_NAMES = [str(target) for target in TARGETS]


def value(rows: Iterable[CoverageRow], **keys: object) -> float:
    """Return ζ of the one row that has all these values; KeyError if there is none."""
    for row in rows:
        if all(getattr(row, key) == wanted for key, wanted in keys.items()):
            return row.zeta_percent
    raise KeyError(f"no row with {keys}")


def coverage(
    configurations: Sequence[CoverageRow], tilts: Sequence[CoverageRow], file: Path
) -> None:
    """Draw ζ of every setup, and of n2_16_theta against theta, under both rules on `ur10`.

    Args:
        configurations: rows of the bar chart.
        tilts: rows of the sweep.
        file: PNG to write.
    """
    figure = sheet(14, 12)
    grid = figure.add_gridspec(3, 2)
    for k, (rule, _) in enumerate(COUNTS):
        _bars(figure.add_subplot(grid[k, :]), configurations, rule)
        _sweep(figure.add_subplot(grid[2, k]), tilts, rule)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=6, frameon=False)
    save(figure, file)


def _bars(ax: Axes, rows: Sequence[CoverageRow], rule: str) -> None:
    """Draw bars of the paper's layouts and of the searched setups for all targets."""
    names = [*SETUPS, *_SEARCHED]
    at = np.arange(len(names)) + 0.25 * (np.arange(len(names)) >= len(SETUPS))
    for k, target in enumerate(_NAMES):
        height = [value(rows, chain=_CHAIN, setup=n, target=target, rule=rule) for n in names]
        ax.bar(at + 0.16 * (k - 2), height, 0.15, color=COLOURS[k], label=target)
    for target, said in PUBLISHED.items():
        place = names.index("n3_16_55") + 0.16 * (_NAMES.index(target) - 2)
        label = "published" if target == str(NEAR) else ""
        ax.plot([place - 0.09, place + 0.09], [said, said], color=INK, lw=2, label=label)
    ax.axvline(len(SETUPS) - 0.375, color=GREY, lw=0.8, ls=(0, (4, 3)))
    plain(ax, f"setups, {COUNT_NAMES[rule]}", y="coverage ζ, percent")
    ax.set_ylim(0, 105)
    ax.grid(False, axis="x")
    ax.set_xticks(at, [*SETUPS, *(f"search for\n{name}" for name in _SEARCHED)])


def _sweep(ax: Axes, rows: Sequence[CoverageRow], rule: str) -> None:
    """Plot ζ of n2_16_theta against theta for all targets."""
    for k, target in enumerate(_NAMES):
        zeta = [value(rows, chain=_CHAIN, rule=rule, target=target, at=theta) for theta in THETAS]
        ax.plot(THETAS, zeta, color=COLOURS[k], marker=MARKERS[k], ms=4, lw=1.6)
    plain(ax, f"n2_16_θ, {COUNT_NAMES[rule]}", "tilt θ, degrees", "coverage ζ, percent")
    ax.set_ylim(25, 101)
    ax.set_xticks(THETAS)
