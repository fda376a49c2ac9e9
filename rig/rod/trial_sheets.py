"""Printable sheets of the trials: for each pose, the positions of the rod in two views, and a list
to tick.

The sheets omit the predictions, so that the person who places the rod does not know them.
"""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from ...coverage.robots.base_frame import frame_text
from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import robot_capsules
from ...formats.writing import write_bytes
from ...objectives.scene import Scene
from ...reporting.outlines import capsule_outlines, outline
from .trial_plan import RodPlan

_A4 = (8.27, 11.69)  # inches
_ROWS, _COLUMNS = 36, 2  # of the list on a page
_VIEWS = ((0, 1, "from above"), (0, 2, "from the side"))
_ROBOT, _CELL, _INK = "#b8bec5", "#e9e2d3", "#23272b"


def rod_pages(scene: Scene, plan: RodPlan, first: int = 0) -> list[Figure]:
    """Return one or more A4 pages for each pose of the plan; trials are numbered from
    ``first`` on.
    """
    pages, most = [], _ROWS * _COLUMNS
    for pose in range(len(plan.joints)):
        trials = np.flatnonzero(plan.pose == pose)
        pages += [
            _page(scene, plan, pose, trials[i : i + most], first)
            for i in range(0, len(trials), most)
        ]
    return pages


def write_rod_pages(path: Path, scene: Scene, plans: Sequence[RodPlan]) -> None:
    """Write the pages of all plans, with consecutive trial numbers, as one PDF; raise UserError if
    that fails.
    """
    made, first = io.BytesIO(), 0
    with PdfPages(made, metadata={"Title": "Trials with a test rod", "CreationDate": None}) as file:
        for plan in plans:
            for page in rod_pages(scene, plan, first):
                file.savefig(page)
            first += len(plan.trials)
    write_bytes(path, made.getvalue())


def _page(scene: Scene, plan: RodPlan, pose: int, trials: Any, first: int) -> Figure:
    figure, rod, rows = Figure(figsize=_A4), plan.rod, -(-len(trials) // _COLUMNS)
    q = ", ".join(f"{a:.1f}" for a in np.degrees(plan.joints[pose]))
    size = (
        f"{2000 * rod.radius:.0f} mm thick, {1000 * (rod.length + 2 * rod.radius):.0f} mm long"
        " overall"
    )
    title = f"Test rod in {plan.named}, pose {pose}"
    figure.text(0.07, 0.962, title, fontsize=15, weight="bold", color=_INK)
    text = (
        f"Joints {q}°. Rod upright, {size}.\nx, y, z: its centre, mm, in {frame_text(scene.robot)};"
        " foot: its lower end, mm above the floor, or z where there is none.\nPut it up on a"
        " stand, step out of the sensors' reach, start the trial, tick it."
    )
    figure.text(0.07, 0.928, text, fontsize=8.5, color=_INK, va="center")
    for (i, j, words), left in zip(_VIEWS, (0.07, 0.54), strict=True):
        ax = figure.add_axes((left, 0.605, 0.40, 0.285))
        _view(ax, scene, plan, pose, trials, (i, j), first)
        ax.set_title(words, fontsize=9, loc="left", color=_INK)
    floor = _floor(scene)
    for column in range(_COLUMNS):
        some = trials[column * rows : (column + 1) * rows]
        left = 0.07 + 0.47 * column
        if len(some):
            _line(figure, left, 0.560, ("trial", "x", "y", "z", "foot", ""), weight="bold")
        for row, k in enumerate(some):
            x, y, z = 1000 * plan.point[k]
            foot = z - 1000 * (rod.length / 2 + rod.radius + floor)
            cells = (str(first + k), *(f"{v:.0f}" for v in (x, y, z, foot)), "☐")
            _line(figure, left, 0.545 - 0.0145 * row, cells)
    return figure


def _line(
    figure: Figure, left: float, height: float, cells: tuple[str, ...], weight: str = "normal"
) -> None:
    style: dict[str, Any] = {"fontsize": 8.5, "color": _INK, "family": "DejaVu Sans"}
    for cell, at in zip(cells, (0.04, 0.11, 0.18, 0.25, 0.32, 0.37), strict=True):
        figure.text(left + at, height, cell, ha="right", weight=weight, **style)


def _floor(scene: Scene) -> float:
    """Return the height of the floor, m; 0 if the scene has none."""
    planes = [o.body for o in scene.obstacles if not len(o.body.edges)]
    level = [float(b.offset[0]) for b in planes if np.allclose(np.asarray(b.normal)[0], [0, 0, 1])]
    return max(level, default=0.0)


def _view(
    ax: Axes,
    scene: Scene,
    plan: RodPlan,
    pose: int,
    trials: Any,
    axes: tuple[int, int],
    first: int,
) -> None:
    """Draw robot, cell and numbered points along two axes of the base frame."""
    which = list(axes)
    points = plan.point[trials][:, which]
    low, high = points.min(axis=0) - 0.15, points.max(axis=0) + 0.15
    for o in scene.obstacles:
        if len(o.body.edges):
            corners = np.asarray(o.body.edges).reshape(-1, 3)[:, which]
            ax.add_patch(Polygon(outline(corners), color=_CELL, zorder=1))
        elif axes[1] == 2:
            ax.axhspan(low[1] - 1, _floor(scene), color=_CELL, zorder=1)
    frames = forward(scene.robot.chain, plan.joints[pose])
    bodies = robot_capsules(scene.robot, frames).arrays() if scene.robot.bodies else None
    for corners in capsule_outlines(*bodies, which) if bodies else ():
        ax.add_patch(Polygon(corners, color=_ROBOT, zorder=2))
    ax.plot(*points.T, "o", ms=2.5, color=_INK, zorder=3)
    style: dict[str, Any] = {"textcoords": "offset points", "xytext": (2, 2), "fontsize": 5.5}
    for k, place in zip(trials, points, strict=True):
        ax.annotate(str(first + k), tuple(place), color=_INK, zorder=4, **style)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    ax.set_xlabel("xyz"[axes[0]] + ", m", fontsize=8)
    ax.set_ylabel("xyz"[axes[1]] + ", m", fontsize=8)
    ax.tick_params(labelsize=7)
    ax.grid(True, lw=0.4, color="#d9dde1")
    ax.set_axisbelow(True)
