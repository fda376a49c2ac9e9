"""Figure and page of the study of optimality gaps."""

from pathlib import Path

from ...reporting.pages import csv_text, table
from ...reporting.plots import COLOURS, GREY, INK, plain, save, sheet
from ..engine.scenes import PAPERS_WORLD
from .study import GapRow

_CLOSE, _SAYS = 3.0, 99.9  # points and percent


def write(rows: list[GapRow], folder: Path) -> dict[str, str]:
    """Draw the picture into ``folder`` and return the texts of the other files by name."""
    picture(rows, folder / "gap.png")
    return {"README.md": page(rows), "data.csv": csv_text([vars(row) for row in rows])}


def picture(rows: list[GapRow], file: Path) -> None:
    """Plot for each target the best known coverage and the bounds against the number of sensors."""
    names = list(dict.fromkeys(row.target for row in rows))
    figure = sheet(4.2 * len(names), 4.2)
    axes = figure.subplots(1, len(names), squeeze=False)[0]
    for ax, name in zip(axes, names, strict=True):
        some = [row for row in rows if row.target == name]
        n = [row.sensors for row in some]
        bound, known = [row.bound_percent for row in some], [row.known_percent for row in some]
        ax.fill_between(n, bound, 101, color=GREY, alpha=0.25, lw=0, label="above every layout")
        ax.fill_between(n, known, bound, color=COLOURS[0], alpha=0.15, lw=0, label="gap")
        volume = [min(row.volume_percent, 100) for row in some]
        ax.plot(n, volume, ":", color=INK, lw=1.2, label="by the volume of the beams")
        ax.plot(n, bound, "-_", color=INK, lw=1.6, ms=9, label="upper bound")
        ax.plot(n, known, "o", color=COLOURS[0], ms=6, label="best known layout")
        plain(ax, name, "sensors", "ζ, percent" if ax is axes[0] else "")
        ax.set_xticks(n)
        ax.set_ylim(0, 101)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, frameon=False, fontsize=9)
    save(figure, file)


def page(rows: list[GapRow]) -> str:
    """Return the study as Markdown."""
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
    lines = [
        "# How good could any layout be?",
        "",
        f"The measurements are in `data.csv`. {PAPERS_WORLD}",
        "",
        "![Best known coverage and upper bounds](gap.png)",
        "",
        (
            "An upper bound holds for every layout with this number of sensors: any rings that the"
            " rules allow, at any positions, tilts and phases. All figures are percent of the"
            " target's volume. [How good could it be?](../../docs/questions/gap.md) explains the"
            " bound."
        ),
        "",
        (
            "- **Best known**: ζ of the best layout of this project's searches (listed in"
            " `studies/gap/study.py`), or of a search by this study."
        ),
        "- **By volume**: the number of sensors times the volume of a beam.",
        (
            "- **By prices**: Lagrangian relaxation with a price for each place in the target; 100"
            " where no prices beat the volume. The upper bound is the lower of the two."
        ),
        "- **Seconds**: processor time of the bound.",
        "",
        table(heads, body),
        "",
        *_verdict(rows),
    ]
    return "\n".join(lines) + "\n"


def _listed(rows: list[GapRow]) -> str:
    return ", ".join(f"{row.target} with {row.sensors}" for row in rows) or "none"


def _verdict(rows: list[GapRow]) -> list[str]:
    """Say where the bound is tight and where it is not."""
    silent = [row for row in rows if row.bound_percent > _SAYS]
    tight = [row for row in rows if row.gap <= _CLOSE]
    loose = [row for row in rows if row.gap > _CLOSE and row not in silent]
    return [
        f"**Tight** (a gap of at most {_CLOSE:g} points): {_listed(tight)}.",
        "",
        f"**Loose**: {_listed(loose)}.",
        "",
        f"**Says nothing** (100 %): {_listed(silent)}.",
        "",
        (
            "The bound counts fractions of rings: a hundred different rings, each to a hundredth,"
            " may share the space without covering any place twice. Real beams must overlap once"
            " there are many of them, or once all of them start close to the target, as in a near"
            " shell. There the bound exceeds what any layout reaches: it is a property of the"
            " relaxation."
        ),
    ]
