"""Page of a study of Pareto fronts: a plot, tables, and each point as a proposal."""

import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib import path as curves
from matplotlib.axes import Axes
from matplotlib.cbook import pts_to_prestep
from matplotlib.transforms import Bbox

from ...formats.escaping import printable_lines
from ...formats.schema.proposal_models import ProposalFile
from ...formats.writing import to_toml
from ...reporting.pages import csv_text, html, table
from ...reporting.plots import COLOURS, INK, MARKERS, plain, save, sheet
from ..engine.scenes import PAPERS_WORLD, scene_from
from .study import Point, dominated, front, hypervolume, is_papers, setup_of_point

_POINTS = "points.csv"
# where the name of a layout may stand: offset in points, and alignment
_SIDES = (
    ((9, 5), "left"),
    ((9, -8), "left"),
    ((-9, 5), "right"),
    ((-9, -8), "right"),
    ((0, -14), "center"),
    ((0, 14), "center"),
)
_STAR = 9.0  # px, about half the width of a star
_POINT = re.compile(r"(?m)(?<=,)point_\d+_\d+\.toml$")


TITLE = "Pareto fronts of two targets"


def picture(points: Sequence[Point], names: tuple[str, str], file: Path) -> None:
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
    papers = [p for p in points if is_papers(p)]
    for p in papers:
        ax.plot(p.second, p.first, "*", color=INK, ms=11)
    ax.plot([], [], "*", color=INK, ms=11, ls="none", label="the paper's layouts (sensors)")
    plain(ax, "", f"coverage of {names[1]}, percent", f"coverage of {names[0]}, percent")
    ax.legend(loc="lower right", frameon=True, framealpha=0.9, edgecolor="none")
    figure.draw_without_rendering()  # so that pixels are final
    _label(ax, papers)
    save(figure, file)


def _label(ax: Axes, papers: Sequence[Point]) -> None:
    """Write the names of the paper's layouts, each on the side where it covers least.

    The figure is drawn already, so that its pixels are final.
    """
    lines = [
        ax.transData.transform_path(curves.Path(pts_to_prestep(*line.get_data()).T))
        for line in ax.lines
    ]
    stars = ax.transData.transform([(p.second, p.first) for p in papers])  # (P, 2) px
    placed = list[Bbox]()
    for k, p in enumerate(papers):
        others = np.delete(stars, k, axis=0)
        sides = [
            ax.annotate(
                f"{p.name} ({p.sensors})",
                (p.second, p.first),
                xytext=offset,
                ha=side,
                va="center",
                textcoords="offset points",
                fontsize=9,
                color=INK,
            )
            for offset, side in _SIDES
        ]
        boxes = [text.get_window_extent().padded(2) for text in sides]
        hidden = [
            sum(line.intersects_bbox(box, filled=False) for line in lines)
            + box.padded(_STAR).count_contains(others)
            + box.count_overlaps(placed)
            for box in boxes
        ]
        best = int(np.argmin(hidden))
        placed.append(boxes[best])
        for text in sides[:best] + sides[best + 1 :]:
            text.remove()


def write(
    points: Sequence[Point],
    names: tuple[str, str],
    where: dict[str, object],
    folder: Path,
    command: str,
) -> dict[str, str]:
    """Draw the plot into ``folder`` and return the texts of the other files by name."""
    picture(points, names, folder / "front.png")
    kept = front([p for p in points if not is_papers(p)])
    text = printable_lines("\n".join(_page(points, kept, names, _world(where), command)))
    lines = [
        {
            "sensors": p.sensors,
            "found": p.name,
            names[0]: round(p.first, 4),
            names[1]: round(p.second, 4),
        }
        | {"rings": len(p.rings), "on_front": p in kept, "file": _file(p, kept)}
        for p in points
    ]
    files = {
        _POINTS: csv_text(lines),
        "README.md": text,
        "report.html": html(text, folder, TITLE),
    }
    return files | {_file(p, kept): _proposal(p, names, where) for p in kept}


def leftovers(folder: Path, files: Collection[str]) -> list[Path]:
    """Return proposals of an earlier front in ``folder`` that are not among the new ``files``.

    They are read from the table of the earlier front.
    """
    older = folder / _POINTS
    named = set(_POINT.findall(older.read_text(errors="replace"))) if older.is_file() else set()
    return [folder / name for name in sorted(named - set(files))]


def _file(p: Point, kept: Sequence[Point]) -> str:
    return f"point_{p.sensors}_{kept.index(p):02d}.toml" if p in kept else ""


def _proposal(p: Point, names: tuple[str, str], where: dict[str, object]) -> str:
    scene = scene_from(where)
    heading = (
        f"Found as: {p.name}. {names[0]} {p.first:.2f} %, {names[1]} {p.second:.2f} % (rule centre,"
        " voxels of 1 cm)."
    )
    return to_toml(ProposalFile.of(setup_of_point(p, where), scene), heading)


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
    names: tuple[str, str],
    world: str,
    command: str,
) -> Iterator[str]:
    yield f"# {names[0]} against {names[1]}\n"
    yield (
        f"`{command}` searches the Pareto fronts of two targets, one front for each number of"
        " sensors. Every point is counted exactly (rule `centre`, voxels of 1 cm), and no point of"
        " a front is dominated by another with the same number of sensors. The numbers are in"
        " `points.csv`; each point of a front is a proposal in this folder."
        f" {world}\n"
    )
    yield f"![Pareto fronts of {names[0]} against {names[1]}](front.png)\n"
    papers = [p for p in points if is_papers(p)]
    rows = []
    for p in papers:
        fewer = [o for o in kept if o.sensors <= p.sensors]
        better = max(fewer, key=lambda o: min(o.first - p.first, o.second - p.second))
        sign = "yes" if dominated(p, kept) else "no"
        both = (f"{q.first:.1f}, {q.second:.1f}" for q in (p, better))
        rows.append([p.name, f"{p.sensors}", next(both), sign, f"{better.sensors}", next(both)])
    if rows:
        yield (
            "The paper's layouts, and for each the point of a front with no more sensors that has"
            " the largest minimum gain over both targets. ζ is in percent:\n"
        )
        yield table(
            ("setup", "sensors", ", ".join(names), "dominated", "by, sensors", ", ".join(names)),
            rows,
        )
    yield "Hypervolume of each front: the dominated area as a share of the unit square.\n"
    budgets = sorted({p.sensors for p in kept})
    areas = [hypervolume([(p.first, p.second) for p in kept if p.sensors == n]) for n in budgets]
    count = [sum(p.sensors == n for p in kept) for n in budgets]
    yield table(
        ("sensors", "points", "hypervolume"),
        ([f"{n}", f"{c}", f"{a:.4f}"] for n, c, a in zip(budgets, count, areas, strict=True)),
    )
    yield "All points of the fronts, with ζ in percent:\n"
    heads = ("sensors", "search", *names, "rings", "file")
    yield table(
        heads,
        (
            [
                f"{p.sensors}",
                p.name,
                f"{p.first:.2f}",
                f"{p.second:.2f}",
                f"{len(p.rings)}",
                _file(p, kept),
            ]
            for p in kept
        ),
    )
