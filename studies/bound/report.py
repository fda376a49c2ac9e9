"""Figure and page of the bound study."""

from pathlib import Path

from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...reporting.pages import csv_text, table
from ...reporting.plots import COLOURS, GREY, INK, plain, save, sheet
from ..engine.scenes import PAPERS_WORLD
from .study import BUDGETS, COUNTS, GRID, POINTS, SECONDS, BoundRow

_WAYS = (
    ("search_percent", "search", "o", COLOURS[0]),
    ("chosen_percent", "best known setup of the grid", "s", COLOURS[1]),
    ("greedy_percent", "greedy on the grid", "^", COLOURS[2]),
)


def write(rows: list[BoundRow], folder: Path) -> dict[str, str]:
    """Draw the picture into ``folder`` and return the texts of the other files by name."""
    picture(rows, folder / "bound.png")
    return {"README.md": page(rows), "data.csv": csv_text([vars(row) for row in rows])}


def picture(rows: list[BoundRow], file: Path) -> None:
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


def page(rows: list[BoundRow]) -> str:
    """Return the study as Markdown."""
    lines = [
        "# How far is the search from the best layout?",
        "",
        f"The measurements are in `data.csv`. {PAPERS_WORLD}",
        "",
        "![Coverage of the search and bounds of the grid](bound.png)",
        "",
        *_what_is_bounded(rows),
    ]
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
    return "\n".join([*lines, table(heads, body), *_verdict(rows)]) + "\n"


def _what_is_bounded(rows: list[BoundRow]) -> list[str]:
    counts = ", ".join(map(str, COUNTS))
    return [
        (
            f"- **Grid**: {rows[0].rings} rings at {GRID['positions']} positions on each link (one"
            f" on the tool), {GRID['tilts']} tilts, {counts} sensors and {GRID['phases']} phases."
            " The rules allow one ring at each position."
        ),
        (
            f"- **Points**: {POINTS} random points in the target. Points that are covered by the"
            " same rings share one row of the programme."
        ),
        (
            "- **Search**: any positions, tilts, phases and counts that the rules allow, with the"
            " same budget."
        ),
        "",
        (
            "All columns are in percent of the same points; the number in brackets is the search's"
            " exact count of voxels. *Gap* is the lower bound minus the search, in points."
        ),
        "",
        (
            "**What a bound proves.** No setup of rings from the grid, within the budget and the"
            " spacing, covers a larger share of these points. The linear programme's bound is"
            " recomputed from its multipliers and does not depend on the solver's tolerance. The"
            f" integer programme's bound is HiGHS's dual bound after at most {SECONDS:g} s; where"
            " it is solved, the best setup of the grid is known."
        ),
        "",
        (
            "**What it does not prove.** It does not bound setups between the grid's positions,"
            " which may cover more; where the gap is negative, the search's setup does. It does not"
            " bound the share of the volume either: the points are a sample, and their share has"
            " the standard error beside it (for independent points; these are quasi-random and more"
            " accurate). The best choice for a sample looks better on the sample than on the"
            " volume. Greedy would reach 1 - 1/e (63 %) of the best if all rings had the same cost"
            " and no limits; with costs and limits it is only a lower bound."
        ),
        "",
    ]


def _verdict(rows: list[BoundRow]) -> list[str]:
    """Summarise the rows."""
    beaten = sum(row.gap < 0 for row in rows)
    below = sum(row.search_percent < row.chosen_percent for row in rows)
    close = sum(0 <= row.gap <= 3 for row in rows)
    vague = sum(row.bound_percent > 99.9 for row in rows)
    return [
        (
            f"In {beaten} of {len(rows)} rows the search covers more than any setup of the grid"
            f" can. In {close} it is within 3 points of the bound. In {vague} the bound is about"
            f" 100 % and gives no information. In {below} the grid holds a setup that covers more"
            " of these points than the search's."
        ),
    ]
