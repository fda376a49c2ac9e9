"""Page of a study of Pareto fronts: a plot, tables, and the setups at their ends and knees."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from ...coverage.definitions.escaping import printable_lines
from ...reporting.pages import csv_text, table
from ...reporting.plots import COLOURS, INK, MARKERS, plain, save, sheet
from ..engine.pages import FILE, HOW, PAPERS_WORLD, page, setups_toml
from ..engine.scenes import scene_from
from .study import Point, dominated, front, hypervolume, is_papers

_PAPERS = (
    "The paper's layouts, and for each the point of a front with no more sensors that has the"
    " largest minimum gain over both targets. ζ is in percent:"
)
_NEAR = 5.0  # points, a front this near to a layout may run through its name


def fronts_plot(points: Sequence[Point], names: tuple[str, str], file: Path) -> None:
    """Plot the fronts by number of sensors, and the paper's layouts."""
    figure = sheet(10, 7.5)
    ax = figure.subplots()
    searched = front([p for p in points if not is_papers(p)])
    for k, n in enumerate(sorted({p.sensors for p in searched})):
        mine = sorted((p.second, p.first) for p in searched if p.sensors == n)
        x, y = zip(*mine, strict=True)
        ax.plot(
            x,
            y,
            color=COLOURS[k],
            marker=MARKERS[k],
            ms=5,
            lw=1.3,
            drawstyle="steps-pre",
            label=f"searched, {n} sensors",
        )
    papers = sorted((p for p in points if is_papers(p)), key=lambda p: p.second)
    for k, p in enumerate(papers):
        near = [q.second - p.second for q in searched if abs(q.first - p.first) < _NEAR]
        side = -1 if min(near, key=abs, default=-1.0) > 0 else 1  # away from the nearest front
        ax.plot(p.second, p.first, "*", color=INK, ms=11)
        ax.annotate(
            f"{p.name} ({p.sensors})",
            (p.second, p.first),
            xytext=(9 * side, 9 - 18 * (k % 2)),  # above and below in turn, as neighbours are close
            textcoords="offset points",
            ha="left" if side > 0 else "right",
            va="center",
            fontsize=9,
            color=INK,
        )
    ax.plot([], [], "*", color=INK, ms=11, ls="none", label="the paper's layouts (sensors)")
    plain(ax, "", f"coverage of {names[1]}, percent", f"coverage of {names[0]}, percent")
    ax.legend(loc="lower right", frameon=True, framealpha=0.9, edgecolor="none")
    save(figure, file)


def write(
    points: Sequence[Point], names: tuple[str, str], where: dict[str, object], folder: Path
) -> dict[str, str]:
    """Draw the plot into ``folder`` and return the texts of the other files by name."""
    fronts_plot(points, names, folder / "pareto.png")
    kept = front([p for p in points if not is_papers(p)])
    taken = ends_and_knees(kept)
    lines = [
        {
            "sensors": p.sensors,
            "found": p.name,
            names[0]: round(p.first, 4),
            names[1]: round(p.second, 4),
            "rings": len(p.rings),
            "on_front": p in kept,
            "setup": next((name for name, q in taken.items() if q is p), ""),
        }
        for p in points
    ]
    return {
        "data.csv": csv_text(lines),
        "README.md": printable_lines(_page(points, kept, taken, names, _world(where))),
        FILE: setups_toml({name: (p.rings, where) for name, p in taken.items()}),
    }


def ends_and_knees(kept: Sequence[Point]) -> dict[str, Point]:
    """Return both ends and the knee of each front by name.

    The knee is the point that lies farthest above the line between the ends.

    Args:
        kept: points of all fronts, ordered as ``front`` returns them.
    """
    found = dict[str, Point]()
    for n in dict.fromkeys(p.sensors for p in kept):
        mine = [p for p in kept if p.sensors == n]
        a, b = mine[0], mine[-1]
        width, height = a.first - b.first, b.second - a.second
        knee = max(mine, key=lambda p: height * p.first + width * p.second)
        found |= {f"{n}_first": a, f"{n}_knee": knee, f"{n}_second": b}
    return found


def _world(where: dict[str, object]) -> str:
    """Return a sentence on occlusion and mounts in the scene of a front."""
    scene = scene_from(where)
    if scene.occlusion == "ignore" and not scene.real:
        return PAPERS_WORLD
    mounts = "rings have real mounts" if scene.real else "rings need no room on the robot"
    return f"Occlusion is `{scene.occlusion}`; {mounts}."


def _page(
    points: Sequence[Point],
    kept: Sequence[Point],
    taken: Mapping[str, Point],
    names: tuple[str, str],
    world: str,
) -> str:
    rows = []
    for p in filter(is_papers, points):
        fewer = [o for o in kept if o.sensors <= p.sensors]
        better = max(fewer, key=lambda o: min(o.first - p.first, o.second - p.second))
        sign = "yes" if dominated(p, kept) else "no"
        both = (f"{q.first:.1f}, {q.second:.1f}" for q in (p, better))
        rows.append([p.name, f"{p.sensors}", next(both), sign, f"{better.sensors}", next(both)])
    both_names = ", ".join(names)
    heads = ("setup", "sensors", both_names, "dominated", "by, sensors", both_names)
    fronts = {n: [p for p in kept if p.sensors == n] for n in sorted({p.sensors for p in kept})}
    areas = (
        [f"{n}", f"{len(mine)}", f"{hypervolume([(p.first, p.second) for p in mine]):.4f}"]
        for n, mine in fronts.items()
    )
    ends = (
        [f"`{name}`", p.name, f"{p.first:.2f}", f"{p.second:.2f}", f"{len(p.rings)}"]
        for name, p in taken.items()
    )
    return page(
        "pareto",
        first=names[0],
        second=names[1],
        world=world,
        papers=f"{_PAPERS}\n\n{table(heads, rows)}\n" if rows else "",
        areas=table(("sensors", "points", "hypervolume"), areas),
        ends=table(("setup", "search", *names, "rings"), ends),
        how=HOW.rstrip(),
    )
