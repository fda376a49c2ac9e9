"""Plot and page of the study of optimality gaps."""

from pathlib import Path

from ...reporting.pages import csv_text, table
from ...reporting.plots import COLOURS, GREY, INK, plain, save, sheet
from ..engine.pages import page
from .study import GapRow

_CLOSE, _SAYS = 3.0, 99.9  # points and percent


def write(rows: list[GapRow], folder: Path) -> dict[str, str]:
    """Draw the plot into ``folder`` and return the texts of the other files by name."""
    gaps_plot(rows, folder / "gap.png")
    heads = (
        "target", "sensors", "best known", "upper bound", "by volume",
        "by prices", "gap, points", "share of what 100 % leaves open", "seconds",
    )  # fmt: skip
    body = [
        (
            row.target,
            str(row.sensors),
            f"{row.known_percent:.2f}",
            f"{row.bound_percent:.2f}",
            f"{min(row.volume_percent, 100):.2f}",
            f"{row.prices_percent:.2f}",
            f"{row.gap:.2f}",
            f"{100 * row.open_share:.0f} %",
            f"{row.seconds:.0f}",
        )
        for row in rows
    ]
    silent = [row for row in rows if row.bound_percent > _SAYS]
    loose = [row for row in rows if row.gap > _CLOSE and row not in silent]
    text = page(
        "gap",
        table=table(heads, body),
        least=_CLOSE,
        tight=_listed([row for row in rows if row.gap <= _CLOSE]),
        loose=_listed(loose),
        silent=_listed(silent),
    )
    return {"README.md": text, "data.csv": csv_text([vars(row) for row in rows])}


def _listed(rows: list[GapRow]) -> str:
    return ", ".join(f"{row.target} with {row.sensors}" for row in rows) or "none"


def gaps_plot(rows: list[GapRow], file: Path) -> None:
    """Plot for each target the best known coverage and the bounds against the number of sensors."""
    names = list(dict.fromkeys(row.target for row in rows))
    figure = sheet(4.2 * len(names), 4.2)
    axes = figure.subplots(1, len(names), squeeze=False)[0]
    for ax, name in zip(axes, names, strict=True):
        mine = [row for row in rows if row.target == name]
        n = [row.sensors for row in mine]
        bound, known = [row.bound_percent for row in mine], [row.known_percent for row in mine]
        ax.fill_between(n, bound, 101, color=GREY, alpha=0.25, lw=0, label="above every layout")
        ax.fill_between(n, known, bound, color=COLOURS[0], alpha=0.15, lw=0, label="gap")
        volume = [min(row.volume_percent, 100) for row in mine]
        ax.plot(n, volume, ":", color=INK, lw=1.2, label="by the volume of the beams")
        ax.plot(n, bound, "-_", color=INK, lw=1.6, ms=9, label="upper bound")
        ax.plot(n, known, "o", color=COLOURS[0], ms=6, label="best known layout")
        plain(ax, name, "sensors", "ζ, percent" if ax is axes[0] else "")
        ax.set_xticks(n)
        ax.set_ylim(0, 101)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, frameon=False, fontsize=9)
    save(figure, file)
