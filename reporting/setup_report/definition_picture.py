"""Picture of what coverage means: the target of a scene in a vertical section through the arm, with
its covered and its uncovered part and what does not count.
"""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...coverage.rings.ring import Setup
from ...coverage.rings.ring_kinematics import sensor_cones
from ...coverage.robots.base_frame import frame_text
from ...coverage.robots.kinematics import forward
from ...coverage.robots.link_bodies import robot_capsules
from ...formats.export.palette import OBSTACLE
from ...objectives.occlusion import setup_sight
from ...objectives.scene import Scene
from ..outlines import capsule_outlines
from ..plots import GREY, INK
from ..rendering.colours import UNSEEN_COLOUR
from ..rendering.figures import write_png

COVERED, _EXCLUDED, _ROBOT = "#7fb3d9", "#e3e5e8", "#7d8791"
_POINTS = 90_000  # points of the section
_AT_ONCE = 8_000  # points whose coverage is computed at once
_MARGIN = 0.08  # m, around the target
_BELOW, _ABOVE = 1.25, 0.05  # inches of the figure: axis and key below the section, and above it
_PARALLEL = 0.9995  # least cosine with an axis of a section that is said to lie along it


def main_direction(points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " 3"]:
    """Return the horizontal direction in which points spread most; +x if they lie above one
    another."""
    flat = points[:, :2] - points[:, :2].mean(axis=0)
    _, spread, ways = np.linalg.svd(flat)
    way = ways[0] if spread[0] > 1e-6 else np.array([1.0, 0.0])
    lead = float(way[int(np.argmax(np.abs(way)))])
    return np.array([*(way * np.sign(lead)), 0.0])


def _fields(scene: Scene, setup: Setup, points: Float[np.ndarray, "N 3"]) -> dict[str, Any]:
    """Return implicit functions (N,), m, negative inside: the outer target, what it excludes, what
    is covered, and the obstacles."""
    q, target = scene.poses[0].q, scene.targets[0].target
    solid, sees = scene.solid(target, 0), setup_sight(scene, setup, q)
    obstacles = np.full(len(points), np.inf)
    for one in scene.obstacles:
        obstacles = np.minimum(obstacles, one.body(points))
    parts = [points[i : i + _AT_ONCE] for i in range(0, len(points), _AT_ONCE)]
    covered = np.concatenate([np.asarray(sees(part)) for part in parts])
    return {
        "outer": np.asarray(solid.a(points)),
        "inner": np.asarray(solid.b(points)),
        "covered": covered,
        "obstacles": obstacles,
    }


def definition_picture(path: Path, scene: Scene, setup: Setup) -> None:
    """Draw the first target of a scene in a section through the arm in its first pose.

    The section is the vertical plane through the middle of the joints, along the direction in which
    they spread most. Parts are drawn by their implicit functions.

    Args:
        path: file to write.
        scene: the scene.
        setup: the setup.

    Raises:
        UserError: if the file cannot be written.
    """
    frames = np.asarray(forward(scene.robot.chain, scene.poses[0].q))
    origins = np.vstack([np.zeros(3), frames[:, :3, 3]])
    along, through = main_direction(origins), origins.mean(axis=0) * [1, 1, 0]
    through -= (through @ along) * along  # so that the axis counts from the base
    low, high = scene.solid(scene.targets[0].target, 0).a.bounds()
    corners = np.array([(x, y, 0.0) for x in (low[0], high[0]) for y in (low[1], high[1])])
    reach = (corners - through) @ along
    ends = (reach.min() - _MARGIN, reach.max() + _MARGIN), (low[2] - _MARGIN, high[2] + _MARGIN)
    width, height = ends[0][1] - ends[0][0], ends[1][1] - ends[1][0]
    step = np.sqrt(width * height / _POINTS)
    u, z = (np.linspace(*end, max(2, int((end[1] - end[0]) / step))) for end in ends)
    grid_u, grid_z = np.meshgrid(u, z)
    points = through + grid_u[..., None] * along + grid_z[..., None] * np.eye(3)[2]
    fields = {
        name: np.clip(value, -1.0, 1.0).reshape(grid_u.shape)
        for name, value in _fields(scene, setup, points.reshape(-1, 3)).items()
    }
    wide = 9.0
    tall = min(5.2, max(2.6, wide * height / width))
    whole = tall + _BELOW + _ABOVE
    figure = Figure(figsize=(wide, whole), dpi=150, facecolor="white")
    ax = figure.add_axes((0.07, _BELOW / whole, 0.91, tall / whole))
    _paint(ax, u, z, fields)
    draw_robot(ax, scene, frames, np.stack([along, np.eye(3)[2]]), through)
    apexes = sensor_cones(scene.robot, scene.with_cell(setup), scene.poses[0].q).apex - through
    ax.plot(apexes @ along, apexes[:, 2], "o", ms=2.6, mfc="white", mec=INK, mew=0.7, zorder=6)
    ax.set(aspect="equal", xlim=ends[0], ylim=ends[1])
    ax.set_xlabel(direction_label(along, scene), color=GREY, fontsize=9)
    ax.set_ylabel("z, m", color=GREY, fontsize=9)
    ax.tick_params(labelsize=8, colors=GREY)
    ax.spines[["top", "right"]].set_visible(False)
    _legend(figure, scene)
    write_png(path, figure)


def direction_label(along: Float[np.ndarray, " 3"], scene: Scene) -> str:
    """Return the label of the horizontal axis: x or y of the base, or the direction between."""
    frame = frame_text(scene.robot)
    for axis in range(2):
        if abs(along[axis]) > _PARALLEL:
            return f"{'xy'[axis]} of {frame}, m"
    x, y = along[:2]
    return f"along the arm, m: towards ({x:.2f}, {y:.2f}, 0) in x, y, z of {frame}"


def draw_robot(ax: Any, scene: Scene, frames: Any, axes: Any, through: Any) -> None:
    """Draw the robot's bodies on a plane through a point with two axes (2, 3), or the line of its
    joints if it has none."""
    if not scene.robot.bodies:
        origins = (np.vstack([np.zeros(3), frames[:, :3, 3]]) - through) @ axes.T
        ax.plot(*origins.T, "-o", color=_ROBOT, lw=4, ms=8, zorder=4)
        return
    bodies = robot_capsules(scene.robot.enclosed(), frames)
    start, end = (
        (p - through) @ axes.T for p in (np.asarray(bodies.start), np.asarray(bodies.end))
    )
    hulls = capsule_outlines(start, end, bodies.radius, [0, 1])
    ax.add_collection(
        PolyCollection(hulls, facecolors=_ROBOT, edgecolors="white", linewidths=0.5, zorder=4)
    )


def _paint(ax: Any, u: Any, z: Any, fields: dict[str, Any]) -> None:
    """Fill the parts of the section, each over those before it."""

    def fill(values: Any, colour: str, edge: str | None = None) -> None:
        if values.min() < 0:
            ax.contourf(u, z, values, levels=[-10.0, 0.0], colors=[colour])
            if edge is not None:
                ax.contour(u, z, values, levels=[0.0], colors=[edge], linewidths=1.2)

    target = np.maximum(fields["outer"], -fields["inner"])
    fill(target, UNSEEN_COLOUR)
    fill(np.maximum(target, fields["covered"]), COVERED)
    fill(np.maximum(fields["outer"], fields["inner"]), _EXCLUDED)
    fill(fields["obstacles"], OBSTACLE)
    if fields["outer"].min() < 0 < fields["outer"].max():
        ax.contour(u, z, fields["outer"], levels=[0.0], colors=[INK], linewidths=1.4)


def _legend(figure: Any, scene: Scene) -> None:
    """Add the key of colours below the section."""
    target = scene.targets[0].target
    dot: dict[str, Any] = {"ls": "", "marker": "o", "ms": 4, "mfc": "white", "mec": INK}
    keys = [
        Patch(fc=COVERED, label="covered: seen by at least one sensor"),
        Patch(fc=UNSEEN_COLOUR, label="uncovered"),
        Line2D([], [], color=INK, lw=1.4, label=f"boundary of the target {target}"),
        Patch(fc=_EXCLUDED, label="does not count: near the robot itself"),
        Patch(fc=_ROBOT, label="robot, seen from the side"),
        *([Patch(fc=OBSTACLE, label="obstacles")] if scene.obstacles else []),
        Line2D([], [], label="sensors", **dot),
    ]
    figure.legend(handles=keys, loc="lower center", ncols=3, frameon=False, fontsize=8.5)
