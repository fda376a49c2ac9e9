"""Figure of the study of layouts: each robot with its sensors, and coverage beside the search's."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.kinematics import forward
from ...reporting.plots import COLOURS, GREY, INK, lying, save, sheet
from ...reporting.rendering.robot import add_robot, canvas_about
from .study import TARGETS, ScoredLayout

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
