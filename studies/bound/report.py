"""What the bound study shows: a picture and a page."""

from pathlib import Path

from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...reporting.pages import table
from ...reporting.plots import COLOURS, GREY, INK, plain, save, sheet
from .study import BUDGETS, COUNTS, GRID, POINTS, SECONDS, BoundRow

_WAYS = (
    ("search_percent", "the search", "o", COLOURS[0]),
    ("chosen_percent", "best setup of the grid met", "s", COLOURS[1]),
    ("greedy_percent", "greedy on the grid", "^", COLOURS[2]),
)


def picture(rows: list[BoundRow], file: Path) -> None:
    """Draw for each target what was found and what no setup of the grid exceeds, by the number of
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
        Line2D([], [], color=INK, lw=1, ls=":", label="by the linear programme alone"),
        Patch(color=GREY, alpha=0.25, lw=0, label="no setup of the grid"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    save(figure, file)


def page(rows: list[BoundRow], command: str) -> str:
    """The study in words and tables (Markdown)."""
    lines = [
        "# How good is it, really",
        "",
        f"`{command}`; the measurements are in `data.csv`.",
        "",
    ]
    lines += [
        "![Found and bounded coverage by the number of sensors](bound.png)",
        "",
        *_what_is_bounded(rows),
    ]
    found = ("search", "± on the points", "greedy", "best met on the grid")
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
            f"The grid: {rows[0].rings} rings, at {GRID['positions']} positions of each link (one"
            f" on the tool), {GRID['tilts']} tilts, {counts} sensors and {GRID['phases']} phases;"
            " at one place one ring, as the rules ask."
        ),
        (
            f"The points: {POINTS}, drawn in the target; those that the same rings cover are one"
            " row of the programme."
        ),
        (
            "The search chooses freely: any positions, tilts, phases and counts that the rules"
            " allow, on the same budget."
        ),
        "Percents are of the same points for all columns; in brackets the search's exact count.",
        "",
        (
            "**What a bound proves.** No setup made of the grid's rings, within the budget and the"
            " spacing, covers a larger"
        ),
        (
            "share of these points. The linear programme's bound is recomputed from its"
            " multipliers, so that no solver's"
        ),
        (
            "tolerance enters; the integer programme's is HiGHS's dual bound after at most"
            f" {SECONDS:g} s, and where it is"
        ),
        "solved, the best setup of the grid is known.",
        "",
        (
            "**What it does not prove.** It is no bound of setups between the grid's places: these"
            " may cover more, and where"
        ),
        (
            "the gap is negative the search's did. Nor is it one of the target's volume: points are"
            " a sample, so a share of"
        ),
        (
            "them is off by the standard error beside it (as if they were independent; these are"
            " quasi-random and do better),"
        ),
        (
            "and the best choice for a sample looks better on it than it is. Greedy would reach 1 -"
            " 1/e (63 %) of the best were"
        ),
        (
            "all rings of one cost and free to combine; with costs and limits it is no more than a"
            " lower bound."
        ),
        "",
    ]


def _verdict(rows: list[BoundRow]) -> list[str]:
    """What the rows say together."""
    beaten = sum(row.gap < 0 for row in rows)
    below = sum(row.search_percent < row.chosen_percent for row in rows)
    close = sum(0 <= row.gap <= 3 for row in rows)
    vague = sum(row.bound_percent > 99.9 for row in rows)
    return [
        (
            f"Of {len(rows)} rows, in {beaten} the search covers more than any setup of the grid"
            f" can, in {close} it lies"
        ),
        (
            f"within 3 points of the bound, and in {vague} the bound is about 100 % and says"
            f" nothing. In {below} the grid holds"
        ),
        "a setup that is better on these points than what the search found.",
    ]
