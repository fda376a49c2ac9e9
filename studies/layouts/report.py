"""Page of the study of layouts: tables, a figure, the sources, and how to add a layout."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.kinematics import forward
from ...reporting.pages import csv_text, escaped, table
from ...reporting.plots import COLOURS, GREY, INK, lying, save, sheet
from ...reporting.rendering.robot import add_robot, canvas_about
from ..engine.pages import FILE, page, setups_toml
from .study import TARGETS, VOXEL, WIDTH, ScoredLayout

_NAMES = [str(target) for target in TARGETS]
_INCOMPLETE = "† A part of the robot's body is missing; the source below names it.\n\n"
_CUT = (
    "Cut short by the limit: {}. A longer search usually finds better setups, so these are lower"
    " ends of what it can reach."
)
FILES = ("README.md", "data.csv", "layouts.png", FILE)


def write(rows: Sequence[ScoredLayout], folder: Path) -> dict[str, str]:
    """Draw the figure into ``folder`` and return the texts of the other files by name."""
    layouts_figure(rows, folder / "layouts.png")
    found = {
        row.layout.name: (row.proposal["rings"], row.scene)
        for row in rows
        if isinstance(row.scene.get("robot", ""), str)  # a built-in robot, by its name
    }
    return {
        "data.csv": csv_text([one for row in rows for one in _records(row)]),
        "README.md": _page(rows),
        FILE: setups_toml(found),
    }


def _records(row: ScoredLayout) -> Iterator[dict[str, object]]:
    for who, score in (("layout", row.score), ("search", row.proposed)):
        for name in _NAMES:
            yield {
                "layout": row.layout.name,
                "robot": row.layout.scene.robot.name,
                "sensors": row.sensors,
                "setup": who,
                "target": name,
                "ignore_percent": score.ignore[name],
                "shadow_percent": score.shadow[name],
                "low_percent": score.low[name],
                "high_percent": score.high[name],
            }


def _page(rows: Sequence[ScoredLayout]) -> str:
    more = [sum(row.proposed.low[n] > row.score.high[n] for row in rows) for n in _NAMES]
    less = [sum(row.proposed.high[n] < row.score.low[n] for row in rows) for n in _NAMES]
    each = zip(_NAMES, more, less, strict=True)
    ignoring = ([_name(row), *_pairs(row.score.ignore, row.proposed.ignore)] for row in rows)
    processor = sum(row.processor_seconds for row in rows)
    wall = sum(row.wall_seconds for row in rows)
    cut = ", ".join(f"`{row.layout.name}`" for row in rows if not row.finished)
    return page(
        "layouts",
        voxel_cm=100 * VOXEL,
        width_points=100 * WIDTH,
        compared=table(
            ("layout", "robot", "sensors", "beam", *_NAMES), map(_compared, rows), right=(2,)
        ),
        incomplete=_INCOMPLETE if any(row.layout.incomplete for row in rows) else "",
        all=len(rows),
        verdict=", ".join(f"of {name} on {a} and less on {b}" for name, a, b in each),
        ignoring=table(("layout", *_NAMES), ignoring),
        sources="\n".join(_sources(rows)),
        file=FILE,
        limit=rows[0].limit_seconds,
        processor=processor,
        wall=wall,
        share=processor / wall,
        end=_CUT.format(cut) if cut else "All of them completed.",
    )


def _name(row: ScoredLayout) -> str:
    return f"`{row.layout.name}`" + " †" * row.layout.incomplete


def _compared(row: ScoredLayout) -> list[str]:
    scene = row.layout.scene
    head = [_name(row), scene.robot.name, f"{row.sensors}", scene.sensor.text]
    return [*head, *_pairs(row.score.shadow, row.proposed.shadow)]


def _pairs(mine: Mapping[str, float], theirs: Mapping[str, float]) -> list[str]:
    return [
        f"{mine[name]:.1f} → {theirs[name]:.1f} ({round(theirs[name] - mine[name], 1) + 0.0:+.1f})"
        for name in _NAMES
    ]


def _sources(rows: Sequence[ScoredLayout]) -> Iterator[str]:
    for row in rows:
        about = row.layout.about
        yield f"### `{row.layout.name}`: {escaped(about.title)}\n"
        yield f"- source: {escaped(about.source)}; read {about.date}"
        yield f"- licence: {escaped(about.licence)}"
        yield f"- poses: {escaped(about.how)}"
        yield f"- beam: {row.layout.scene.sensor.text}; {escaped(about.beam_source)}"
        yield f"- {_lifted(row)}"
        for note in filter(None, (about.note, *row.layout.notes)):
            yield f"- {escaped(note)}"
        yield ""


def _lifted(row: ScoredLayout) -> str:
    """Return a sentence about the sensors that lay in a body, and those that see nothing."""
    moved = [lift for lift in row.layout.lifts if lift.lifted]
    stays = len(row.layout.lifts) - len(moved)
    text = "no sensor lies in the body of its own link"
    if moved:
        most = 1000 * max(lift.distance for lift in moved)
        text = f"{len(moved)} of {row.sensors} sensors lifted to the surface, by {most:.1f} mm at"
        text += " most"
    if stays:
        text += f"; {stays} lie deeper than {row.layout.about.lift_mm:g} mm and stay"
    return text + f"; {row.unseeing} of {row.sensors} see less than 1 % of their beams in this pose"


_EYE = (-60.0, 16.0)
_COLUMNS = 2
_LOOK = 0.09  # m, length of the line along a sensor's axis
_DOT = 0.013  # m
_LAYOUT, _SEARCH = COLOURS[1], COLOURS[0]


def layouts_figure(rows: Sequence[ScoredLayout], file: Path) -> None:
    """Draw each layout on its robot, with its coverage and that of the search beside it."""
    lines = -(-len(rows) // _COLUMNS)
    figure = sheet(7.6 * _COLUMNS, 2.7 * lines + 0.6)
    figure.set_layout_engine("constrained", h_pad=0.1)
    grid = figure.add_gridspec(lines, 2 * _COLUMNS, width_ratios=(0.8, 1.0) * _COLUMNS)
    for i, row in enumerate(rows):
        at = i // _COLUMNS, 2 * (i % _COLUMNS)
        _paint(figure.add_subplot(grid[at]), row)
        _bars(figure.add_subplot(grid[at[0], at[1] + 1]), row)
    keys = [
        Line2D([], [], color=_LAYOUT, lw=6, label="the layout"),
        Line2D([], [], color=_SEARCH, lw=6, label="the search, with as many sensors"),
        Line2D([], [], color=INK, lw=1.2, label="guaranteed interval"),
    ]
    figure.legend(handles=keys, loc="outside lower center", ncols=3, frameon=False, fontsize=10)
    save(figure, file)


def _paint(ax: Axes, row: ScoredLayout) -> None:
    """Draw a robot with the sensors of a layout, each as a dot with its axis."""
    scene, setup = row.layout.scene, row.layout.setup
    robot, q = scene.robot, scene.poses[0].q
    frames = np.asarray(forward(robot.chain, q))
    view = canvas_about(ax, robot, frames, _EYE)
    colours: dict[str, Any] = dict.fromkeys(robot.links, _LAYOUT)
    add_robot(view, scene, frames, type(setup)(), colours, real=True)
    cones = sensor_cones(robot, setup, q)
    apex, axis = np.asarray(cones.apex), np.asarray(cones.axis)
    view.lines(np.stack([apex, apex + _LOOK * axis], axis=1), _LAYOUT, 1.4)
    view.points(apex, _LAYOUT, _DOT)
    corners = view.extent()
    view.draw(fit=False)
    ax.set_aspect("equal")
    ax.axis("off")
    if corners is not None:
        middle, half = corners.mean(axis=0), 0.52 * float(np.ptp(corners, axis=0).max())
        ax.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half))
    ax.set_title(
        f"{row.layout.name}\n{robot.name}, {row.sensors} sensors",
        fontsize=9.5,
        color=INK,
        loc="left",
    )


def _bars(ax: Axes, row: ScoredLayout) -> None:
    """Plot ζ under ``shadow`` of a layout and of the search, target by target."""
    names = [str(target) for target in TARGETS]
    places = [-i for i in range(len(names))]
    for shift, score, colour in ((0.19, row.score, _LAYOUT), (-0.19, row.proposed, _SEARCH)):
        y = [place + shift for place in places]
        ax.barh(y, [score.shadow[name] for name in names], 0.34, color=colour)
        for at, name in zip(y, names, strict=True):
            ax.plot([score.low[name], score.high[name]], [at, at], color=INK, lw=1.2)
            ax.annotate(
                f"{score.shadow[name]:.1f}",
                (score.high[name], at),
                xytext=(4, 0),
                textcoords="offset points",
                va="center",
                fontsize=8,
                color=GREY,
            )
    ax.set_xlim(0, 108)
    ax.set_xticks([0, 25, 50, 75, 100])
    lying(ax, places, names, "coverage under shadow, percent")
