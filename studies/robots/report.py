"""Page of the study of robots: tables, a figure, and the setup found under ``shadow`` on each."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ...coverage.occlusion.occlusion_mode import ONE_TARGET
from ...coverage.robots.kinematics import forward
from ...formats.export.palette import link_colours
from ...reporting.pages import csv_text, table
from ...reporting.plots import COLOURS, GREY, INK, lying, save, sheet
from ...reporting.rendering.robot import add_robot, canvas_about
from ..engine.pages import FILE, HOW, page, setups_toml
from ..engine.scenes import scene_from, setup_from
from .study import PROCESSORS, SEARCHES, SECONDS, SENSORS, TARGET, VOXEL, RobotRow, pose_deg, where

_SAID = {
    "ignore": "searched under `ignore`",
    "ignore_mounted": "searched under `ignore`, on a real mount",
    "shadow": "searched under `shadow`",
    "blind": "searched under `blind`",
}


def write(rows: Sequence[RobotRow], folder: Path) -> dict[str, str]:
    """Draw the figure into ``folder`` and return the texts of the other files by name."""
    robots_figure(rows, folder / "robots.png")
    taken = {
        row.robot: (row.rings, where(row.robot, SEARCHES[SHOWN]))
        for row in rows
        if row.name == SHOWN
    }
    return {
        "data.csv": csv_text([_record(row) for row in rows]),
        "README.md": _page(rows),
        FILE: setups_toml(taken),
    }


def _record(row: RobotRow) -> dict[str, object]:
    head = {"robot": row.robot, "setup": row.name, "sensors": row.sensors, "rings": len(row.rings)}
    percents = {f"{model}_percent": getattr(row, model) for model in ONE_TARGET}
    spent = (row.processor_seconds, row.wall_seconds, row.finished)
    cells = [
        "" if value is None else value if isinstance(value, bool) else round(value, 1)
        for value in spent
    ]
    names = ("processor_seconds", "wall_seconds", "finished")
    return head | percents | {"unseeing": row.unseeing} | dict(zip(names, cells, strict=True))


def _page(rows: Sequence[RobotRow]) -> str:
    heads = ("setup", "sensors", "rings", *ONE_TARGET, "blocked", "time, s")
    setups = []
    for robot in dict.fromkeys(row.robot for row in rows):
        angles = ", ".join(f"{a:g}" for a in pose_deg(robot))
        setups += [
            f"### {robot}\n",
            f"Pose {angles}°, reach {scene_from(where(robot, {})).robot.reach:g} m.\n",
            table(heads, map(_line, (r for r in rows if r.robot == robot))),
        ]
    each, hands = list(_by_robot(rows).values()), [row for row in rows if not row.searched]
    searched = [of["ignore"] for of in each]

    def spans(lost: Callable[[str], list[float]]) -> dict[str, str]:
        losses = {model: lost(model) for model in ONE_TARGET}
        return {m: f"{min(values):.1f} to {max(values):.1f}" for m, values in losses.items()}

    def gained(model: str) -> list[float]:
        return [getattr(of[model], model) - getattr(of["ignore_mounted"], model) for of in each]

    return page(
        "robots",
        sensors=SENSORS,
        target=TARGET,
        processors=PROCESSORS,
        seconds=SECONDS,
        limit=PROCESSORS * SECONDS,
        voxel_cm=100 * VOXEL,
        prices=table(*_prices(rows)),
        lost=spans(lambda model: [row.ignore - getattr(row, model) for row in searched]),
        by_hand=spans(lambda model: [row.ignore - getattr(row, model) for row in hands]),
        price=spans(gained),
        setups="\n".join(setups),
        file=FILE,
        shown=SHOWN,
        how=HOW.rstrip(),
    )


def _line(row: RobotRow) -> list[str]:
    cut = "" if row.finished else " *"
    seconds = f"{row.processor_seconds:.0f}{cut} ({row.wall_seconds:.0f})" if row.searched else ""
    percents = [f"{getattr(row, model):.2f}" for model in ONE_TARGET]
    return [
        _SAID.get(row.name, row.name),
        f"{row.sensors}",
        f"{len(row.rings)}",
        *percents,
        f"{row.unseeing}",
        seconds,
    ]


def _prices(rows: Sequence[RobotRow]) -> tuple[list[str], list[list[str]]]:
    """Return for each robot ζ of a search under ``ignore`` and of searches that account for the
    body.

    Returns:
        Headings and rows of a table.
    """
    models = [model for model in ONE_TARGET if model != "ignore"]
    heads = ["robot", "ignore"] + [
        f"{model}: {what}"
        for model in models
        for what in ("same setup", "mountable", "searched", "gain")
    ]
    lines = []
    for robot, of in _by_robot(rows).items():
        cells = [robot, f"{of['ignore'].ignore:.2f}"]
        for model in models:
            kept, mounted, found = (
                getattr(of[name], model) for name in ("ignore", "ignore_mounted", model)
            )
            cells += [f"{kept:.2f}", f"{mounted:.2f}", f"{found:.2f}", f"{found - mounted:+.2f}"]
        lines.append(cells)
    return heads, lines


def _by_robot(rows: Sequence[RobotRow]) -> dict[str, dict[str, RobotRow]]:
    return {
        robot: {row.name: row for row in rows if row.robot == robot}
        for robot in dict.fromkeys(r.robot for r in rows)
    }


SHOWN = "shadow"  # search whose rings are drawn
LABELS = {
    "ignore": "searched under ignore",
    "ignore_mounted": "… on a real mount",
    "shadow": "searched under shadow",
    "blind": "searched under blind",
}
_HANDS = ("n1_16_0", "n2_16_25", "n3_16_55")  # the paper's layouts that are drawn
_LOOKS = {
    "ignore": ("o", "white", GREY),
    "shadow": ("s", COLOURS[0], COLOURS[0]),
    "blind": ("D", COLOURS[1], COLOURS[1]),
}
_EYE = (-68.0, 14.0)
_UNDER = 0.09  # m, distance of the ruler below a robot
_COLUMNS = 2


def robots_figure(rows: Sequence[RobotRow], file: Path) -> None:
    """Draw the robots at one scale, and the coverage of their setups beside them."""
    names = list(dict.fromkeys(row.robot for row in rows))
    lines = -(-len(names) // _COLUMNS)
    figure = sheet(7.9 * _COLUMNS, 3.1 * lines + 0.9)
    figure.set_layout_engine("constrained", h_pad=0.12)
    grid = figure.add_gridspec(lines, 2 * _COLUMNS, width_ratios=(1.0, 1.3) * _COLUMNS)
    painted = []
    for i, name in enumerate(names):
        some = [row for row in rows if row.robot == name]
        ax = figure.add_subplot(grid[i // _COLUMNS, 2 * (i % _COLUMNS)])
        painted.append((ax, _paint(ax, name, next(row for row in some if row.name == SHOWN))))
        _dumbbells(figure.add_subplot(grid[i // _COLUMNS, 2 * (i % _COLUMNS) + 1]), some)
    wide, high = (max(float(np.ptp(box[:, k])) for _, box in painted) for k in (0, 1))
    for ax, box in painted:
        middle, low = box.mean(axis=0)[0], box[0, 1] - _UNDER
        ax.set(
            xlim=(middle - 0.55 * wide, middle + 0.55 * wide),
            ylim=(low - 0.01, low + 1.02 * high + _UNDER),
        )
        ax.plot([middle - 0.1, middle + 0.1], [low, low], color=GREY, lw=2, solid_capstyle="butt")
        ax.annotate("20 cm", (middle + 0.12, low), va="center", fontsize=8, color=GREY)
    figure.legend(handles=_keys(), loc="outside lower center", ncols=4, frameon=False, fontsize=10)
    save(figure, file)


def _keys() -> list[Line2D]:
    """Return models and links alternately, which the legend's columns stack in pairs."""
    models = [
        Line2D(
            [], [], ls="", marker=marker, mfc=face, mec=edge, ms=8, label=f"counted under {model}"
        )
        for model, (marker, face, edge) in _LOOKS.items()
    ]
    links = [
        Line2D([], [], color=colour, lw=5, label=f"ring on the {link}, searched under {SHOWN}")
        for link, colour in link_colours(("upper arm", "forearm", "tool")).items()
    ]
    best = Line2D(
        [], [], color=COLOURS[0], lw=0.8, ls=(0, (4, 3)), label=f"best found under {SHOWN}"
    )
    return [*(key for pair in zip(models, links, strict=True) for key in pair), best]


def _paint(ax: Axes, name: str, row: RobotRow) -> Any:
    """Draw a robot with the rings of ``row``; return its corners (2, 2) m in the axes."""
    scene = scene_from(where(name, {}))
    robot, frames = scene.robot, forward(scene.robot.chain, scene.poses[0].q)
    view = canvas_about(ax, robot, frames, _EYE)
    add_robot(
        view, scene, frames, setup_from(row.rings, scene), link_colours(robot.links), real=True
    )
    corners = view.extent()
    view.draw(fit=False)
    ax.set_aspect("equal")
    ax.axis("off")
    ax.set_title(f"{name}   ·   reach {robot.reach:g} m", fontsize=12, color=INK, loc="left")
    return corners


def _dumbbells(ax: Axes, rows: Sequence[RobotRow]) -> None:
    """Plot ζ of each setup under the three models."""
    shown = [
        (row, LABELS.get(row.name, f"{row.name}, {row.sensors} sensors"))
        for row in rows
        if row.name in (*LABELS, *_HANDS)
    ]
    for at, (row, _) in enumerate(shown):
        values = [getattr(row, model) for model in ONE_TARGET]
        y = -at - 0.5 * (not row.searched)
        ax.plot(
            [min(values), max(values)],
            [y, y],
            color="#c3c9cf",
            lw=3.5,
            zorder=1,
            solid_capstyle="round",
        )
        for model, value in zip(ONE_TARGET, values, strict=True):
            marker, face, edge = _LOOKS[model]
            ax.plot(
                value,
                y,
                marker,
                mfc=face,
                mec=edge,
                mew=1.4,
                ms=7.5,
                zorder=2 + (model == "ignore"),
            )
    found = next(row.shadow for row, _ in shown if row.name == SHOWN)
    ax.axvline(found, color=COLOURS[0], lw=0.8, ls=(0, (4, 3)), zorder=0.5)
    ax.set_xlim(0, 101)
    places = [-at - 0.5 * (not row.searched) for at, (row, _) in enumerate(shown)]
    lying(ax, places, [label for _, label in shown], "coverage of V_S(0.5), percent")
