"""Figures of the study of minimum distances."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..simulation.distance import FAR, MODES, NEAR, THINGS, Series, Table, summary
from .plots import COLOURS, GREY, INK, MARKERS, plain, save, sheet

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


def _mode_legend(figure: Figure, extra: Sequence[Artist] = ()) -> None:
    handles = [Patch(color=_MODE_COLOURS[mode], label=MODE_NAMES[mode]) for mode in MODES]
    interval = Line2D(
        [], [], color=INK, lw=1, marker="|", ms=6, label="95 % interval over seeded paths"
    )
    figure.legend(
        handles=[*handles, interval, *extra],
        loc="outside upper center",
        ncols=4,
        frameon=False,
        fontsize=_FONT,
    )


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
    _mode_legend(figure)
    save(figure, file)


def zones(results: Results, file: Path, mode: str = "shadow") -> None:
    """Draw RMSE and maximum error of every target in the near and the far zone, for each setup."""
    names = _setups(results)
    figure = sheet(11, 1.9 + 0.85 * len(names))
    axes = figure.subplots(2, 2, sharex="row")
    titles = {"near": f"near zone: below {NEAR:g} m", "far": f"far zone: {NEAR:g} to {FAR:g} m"}
    for line, (key, what) in zip(
        axes,
        {"rmse_m": "RMSE, m", "max_error_m": "largest error of a path, m"}.items(),
        strict=True,
    ):
        for ax, (zone, title) in zip(line, titles.items(), strict=True):
            for k, thing in enumerate(THINGS):
                mean, half = _column(results, f"{zone}_{key}", mode, thing)
                at = np.arange(len(names)) + 0.18 * (k - (len(THINGS) - 1) / 2)
                low = np.minimum(half, mean)
                style = {
                    "color": COLOURS[k],
                    "marker": MARKERS[k],
                    "ms": 5.5,
                    "elinewidth": 1.0,
                    "capsize": 1.5,
                }
                ax.errorbar(mean, at, xerr=[low, half], ls="none", label=thing, **style)
            plain(ax, title, x=what)
            _rows(ax, names, ax in axes[:, 0])
            for y in np.arange(len(names) - 1) + 0.5:
                ax.axhline(y, color="#eceff1", lw=0.8, zorder=0)
            ax.set_xlim(left=0)
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="outside upper center",
        ncols=len(THINGS),
        frameon=False,
        fontsize=_FONT,
    )
    figure.supxlabel(
        f"{MODE_NAMES[mode]}; means over seeded paths with 95 % intervals",
        fontsize=_FONT,
        color=GREY,
    )
    save(figure, file)


def monitoring(results: Results, file: Path) -> None:
    """Draw the figures that matter for speed and separation monitoring.

    They are the error of the closing speed, and how long and how near the human stays undetected.
    """
    figure = sheet(12, 2.2 + 0.84 * len(_setups(results)))
    axes = figure.subplots(2, 2)
    panels = (
        ("rmse_speed_base", "RMSE of the closing speed, m/s", "closing speed towards the base"),
        ("rmse_speed_tcp", "RMSE of the closing speed, m/s", "closing speed towards the TCP"),
        (
            "unseen_longest_s",
            "longest time undetected in a path, s",
            "undetected within 1.5 m: duration",
        ),
        (
            "unseen_nearest_m",
            "least distance while undetected, m",
            "undetected within 1.5 m: distance",
        ),
    )
    for k, (ax, (key, x, title)) in enumerate(zip(axes.flat, panels, strict=True)):
        _bars(ax, results, key, "human", x, f"human: {title}", k % 2 == 0)
    _mode_legend(figure)
    save(figure, file)


def timeline(
    runs: Mapping[str, Series], range_m: float, file: Path, start: float = 0.0, end: float = np.inf
) -> None:
    """Plot true and estimated distance over time, one panel for each run; mark the moments without
    any detection.

    Args:
        runs: time series by the title of the panel.
        range_m: range of the sensors, m.
        file: PNG to write.
        start: first moment, s.
        end: last moment, s.
    """
    figure = sheet(12, 0.9 + 2.5 * len(runs))
    axes = np.atleast_1d(figure.subplots(len(runs), 1, sharex=True, sharey=True))
    for ax, (name, run) in zip(axes, runs.items(), strict=True):
        time = run.time
        unseen = (run.true < range_m) & ~run.seen
        ax.fill_between(
            time, 0, 1.05 * range_m, where=unseen, color=COLOURS[4], alpha=0.3, lw=0, step="mid"
        )
        for level in (NEAR, FAR):
            ax.axhline(level, color=GREY, lw=0.8, ls=(0, (4, 3)))
        ax.plot(time, np.minimum(run.true, range_m), color=INK, lw=1.8)
        ax.plot(time, run.believed, color=COLOURS[0], lw=1.2)
        ax.plot(time, run.careful, color=COLOURS[2], lw=1.0, ls=(0, (1, 1)))
        plain(ax, name, y="distance, m")
        ax.set_ylim(0, 1.05 * range_m)
        ax.set_xlim(max(start, time[0]), min(end, time[-1]))
        ax.tick_params(labelsize=_FONT - 1)
    axes[-1].set_xlabel("time, s")
    handles = [
        Line2D([], [], color=INK, lw=1.8, label="true"),
        Line2D([], [], color=COLOURS[0], lw=1.2, label="estimated (points on the beams' axes)"),
        Line2D(
            [],
            [],
            color=COLOURS[2],
            lw=1.0,
            ls=(0, (1, 1)),
            label="lower bound (anywhere in the beams)",
        ),
        Patch(color=COLOURS[4], alpha=0.3, label="within 1.5 m, undetected by all sensors"),
        Line2D([], [], color=GREY, lw=0.8, ls=(0, (4, 3)), label=f"{NEAR:g} and {FAR:g} m"),
    ]
    figure.legend(
        handles=handles, loc="outside upper center", ncols=5, frameon=False, fontsize=_FONT - 0.5
    )
    save(figure, file)
