"""Plan view of the floor around the robot: where a person is seen, and where close and unseen."""

from pathlib import Path

import numpy as np
from jaxtyping import Int
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...coverage.robots.base_frame import frame_text
from ...coverage.robots.robot import Robot
from ...simulation.dossier.floor import Floor
from ...simulation.motion_samples import Moments
from ..outlines import capsule_outlines
from ..plots import COLOURS, INK, plain, save, sheet

_ROBOT = "#9aa4ae"
_KINDS = (
    ("no room for a person", "#c9ced4"),
    ("seen at every moment", "#a9dcc6"),
    ("unseen at some moments", "#f3e3a8"),
    ("never seen", "#f4f4f4"),
    ("within the separation distance, unseen at some moments", "#E69F00"),
    ("within the separation distance, never seen", "#D55E00"),
)


def kinds(floor: Floor) -> Int[np.ndarray, "X Y"]:
    """Return the number of each square's kind, in the order of the legend."""
    kind = np.zeros(floor.room.shape, int)
    for number, where in enumerate(
        (
            floor.room,
            floor.at_times_unseen,
            floor.never_seen,
            floor.near_unseen,
            floor.near & floor.never_seen,
        ),
        1,
    ):
        kind[where] = number
    return kind


def floor_picture(robot: Robot, m: Moments, floor: Floor, file: Path) -> None:
    """Draw the squares of the floor, the edge of the separation distance, paths unseen, and the
    robot.

    Args:
        robot: the robot.
        m: moments of its motion.
        floor: what sensors see on the floor.
        file: PNG to write.
    """
    figure = sheet(8.4, 8.8)
    ax = figure.add_subplot()
    edges = [np.append(a - floor.side / 2, a[-1] + floor.side / 2) for a in (floor.x, floor.y)]
    shades = ListedColormap([colour for _, colour in _KINDS])
    ax.pcolormesh(*edges, kinds(floor).T, cmap=shades, vmin=-0.5, vmax=len(_KINDS) - 0.5)
    near = floor.within.any(axis=0)
    if near.any() and not near.all():
        level = near.T.astype(float)
        ax.contour(floor.x, floor.y, level, [0.5], colors=[COLOURS[0]], linewidths=1.6)
    _reached(ax, floor)
    for number, moment in enumerate(floor.moments):
        _robot(ax, m, int(moment), 1.0 if number == 0 else 0.35)
    ax.set_aspect("equal")
    plain(ax, "", f"x of {frame_text(robot)}, m", "y, m")
    ax.grid(False)
    figure.legend(handles=_legend(floor), loc="outside lower center", ncols=2, frameon=False)
    save(figure, file)


def _reached(ax: Axes, floor: Floor) -> None:
    """Mark the squares near the robot that a person reaches unseen."""
    for where, mark in ((floor.access, "x"), (floor.possible_access & ~floor.access, ".")):
        i, j = np.nonzero(where)
        ax.plot(floor.x[i], floor.y[j], mark, color=INK, ms=3.2, mew=0.8, zorder=3)


def _robot(ax: Axes, m: Moments, moment: int, shade: float) -> None:
    start, end = (np.asarray(ends)[moment] for ends in (m.bodies.start, m.bodies.end))
    links = capsule_outlines(start, end, m.bodies.radius, [0, 1])
    drawn = PolyCollection(
        links, facecolor=_ROBOT, edgecolor=INK, lw=0.7, alpha=shade, zorder=4 + shade
    )
    ax.add_collection(drawn)


def _legend(floor: Floor) -> list[Patch | Line2D]:
    """Return the entries of the legend for what the picture has."""
    there = np.unique(kinds(floor))
    handles: list[Patch | Line2D] = [
        Patch(facecolor=colour, edgecolor="#8a9199", lw=0.5, label=name)
        for number, (name, colour) in enumerate(_KINDS)
        if number in there
    ]
    handles.append(Line2D([], [], color=COLOURS[0], lw=1.6, label="edge of separation distances"))
    handles.append(Patch(facecolor=_ROBOT, edgecolor=INK, lw=0.7, label="robot"))
    for where, mark, name in (
        (floor.access, "x", "reached through places never seen"),
        (floor.possible_access & ~floor.access, ".", "reached through places unseen at times"),
    ):
        if where.any():
            handles.append(Line2D([], [], ls="", marker=mark, color=INK, ms=5, label=name))
    return handles
