"""Plot and page of the bound study."""

from pathlib import Path

from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...reporting.pages import csv_text, table
from ...reporting.plots import COLOURS, GREY, INK, plain, save, sheet
from ..engine.pages import page
from .study import BUDGETS, GRID, POINTS, SECONDS, BoundRow

_WAYS = (
    ("search_percent", "search", "o", COLOURS[0]),
    ("chosen_percent", "best known setup of the grid", "s", COLOURS[1]),
    ("greedy_percent", "greedy on the grid", "^", COLOURS[2]),
)


def write(rows: list[BoundRow], folder: Path) -> dict[str, str]:
    """Draw the plot into ``folder`` and return the texts of the other files by name."""
    bounds_plot(rows, folder / "bound.png")
    found = ("search", "± on the points", "greedy", "best known of the grid")
    heads = ("target", "sensors", *found, "bound, integer", "solved", "bound, linear", "gap")
    body = [
        (
            row.target,
            str(row.sensors),
            f"{row.search_percent:.2f} (voxels: {row.search_exact_percent:.2f})",
            f"{row.error:.2f}",
            f"{row.greedy_percent:.2f}",
            f"{row.chosen_percent:.2f}",
            f"{row.integer_bound_percent:.2f}",
            "yes" if row.optimal else "no",
            f"{row.linear_bound_percent:.2f}",
            f"{row.gap:+.2f}",
        )
        for row in rows
    ]
    text = page(
        "bound",
        **GRID | {"counts": ", ".join(map(str, GRID["counts"]))},
        rings=rows[0].rings,
        points=POINTS,
        seconds=SECONDS,
        table=table(heads, body),
        all=len(rows),
        beaten=sum(row.gap < 0 for row in rows),
        below=sum(row.search_percent < row.chosen_percent for row in rows),
        close=sum(0 <= row.gap <= 3 for row in rows),
        vague=sum(row.bound_percent > 99.9 for row in rows),
    )
    return {"README.md": text, "data.csv": csv_text([vars(row) for row in rows])}


def bounds_plot(rows: list[BoundRow], file: Path) -> None:
    """Plot for each target the covered share and the bounds of the grid against the number of
    sensors.
    """
    names = list(dict.fromkeys(row.target for row in rows))
    figure = sheet(4.2 * len(names), 4.2)
    axes = figure.subplots(1, len(names), squeeze=False)[0]
    for ax, name in zip(axes, names, strict=True):
        for row in (r for r in rows if r.target == name):
            at = row.sensors
            ax.fill_between([at - 9, at + 9], row.bound_percent, 100, color=GREY, alpha=0.25, lw=0)
            ax.hlines(row.bound_percent, at - 9, at + 9, color=INK, lw=1.6)
            ax.hlines(row.linear_bound_percent, at - 9, at + 9, color=INK, lw=1, ls=":")
            for shift, (key, _, marker, colour) in zip((0, 4, -4), _WAYS, strict=True):
                ax.plot(at + shift, getattr(row, key), marker, color=colour, ms=6)
        plain(ax, name, "sensors", "covered points, percent" if ax is axes[0] else "")
        ax.set_xticks(BUDGETS)
        low = min(r.greedy_percent for r in rows if r.target == name)
        ax.set_ylim(max(low - 8, 0), 101)
    handles: list[Line2D | Patch] = [
        Line2D([], [], marker=marker, ls="", color=colour, label=label)
        for _, label, marker, colour in _WAYS
    ]
    handles += [
        Line2D([], [], color=INK, lw=1.6, label="upper bound of the grid"),
        Line2D([], [], color=INK, lw=1, ls=":", label="by the linear programme only"),
        Patch(color=GREY, alpha=0.25, lw=0, label="above any setup of the grid"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    save(figure, file)
