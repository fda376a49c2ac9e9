"""Section of a report on the smallest object that is seen: bounds, a picture, and a table of
places."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch, Rectangle

from ...coverage.robots.base_frame import frame_text
from ...coverage.robots.kinematics import forward
from ...coverage.voxels.object_room import BALL, ObjectShape
from ...objectives.gap_map import KEYS, GapMap
from ...objectives.object_bounds import ObjectBounds, SmallestObject
from ...objectives.scene import Scene
from ...objectives.smallest_object import SIDE
from ..lines.results import object_lines
from ..pages import csv_text, escaped
from ..plots import GREY, INK
from ..rendering.figures import write_png
from ..tables import target_label
from .definition_picture import COVERED, direction_label, main_direction
from .facts import Facts

_STEPS = 200  # points on the longer side of a section
_MARGIN = 0.05  # m, around the target
_BODY, _OBJECT = "#7d8791", "#d1245b"


def object_name(number: int) -> str:
    """Return the file name of the picture of a target's largest unseen objects."""
    return f"smallest_object_{number}.png"


def smallest_object_section(f: Facts) -> Iterator[str]:
    """Yield the bounds of each target's largest unseen objects, with a picture, as Markdown."""
    records = [r for r in f.with_objects if r.smallest_object is not None]
    if not records:
        return
    yield "## Smallest object\n"
    yield (
        "The largest sphere and the largest upright rod that no sensor sees, with their centre in"
        " the target; they may stick out of it, but not reach into the robot or an obstacle. A"
        " larger object is in some beam wherever its centre is; that it is detected there is"
        " another question. Both ends of each interval are proved, and the worst pose counts.\n"
    )
    yield "\n".join(f"- {escaped(line)}" for line in object_lines(records)) + "\n"
    for n, r in enumerate(f.with_objects):
        if r.smallest_object is not None:
            yield (
                f"![Diameters of the largest unseen sphere and rod about each place of"
                f" {escaped(target_label(r))}, in a vertical and a horizontal"
                f" section]({object_name(n)})\n"
            )
    yield "`smallest_object.csv` beside this page has both diameters at places of each target.\n"


def gap_maps(f: Facts) -> list[GapMap | None]:
    """Return the map of each target at the pose of its largest unseen sphere, if that is known."""
    side = max(f.voxel, SIDE)
    return [
        None
        if (o := r.smallest_object) is None
        else GapMap.of(f.scene, f.setup, goal.target, o.sphere.pose, side, o.rod_length)
        for r, goal in zip(f.with_objects, f.scene.targets, strict=True)
    ]


def object_table(maps: list[GapMap | None]) -> str:
    """Return the diameters about the places of all maps as CSV."""
    return csv_text([row for one in maps if one is not None for row in one.rows()], KEYS)


def object_picture(path: Path, scene: Scene, gaps: GapMap, objects: SmallestObject) -> None:
    """Draw diameters of unseen spheres in the vertical section through the largest one, and of
    unseen rods in the horizontal section through the largest one.

    Args:
        path: file to write.
        scene: the scene.
        gaps: the map of a target.
        objects: its largest unseen objects.

    Raises:
        UserError: if the file cannot be written.
    """
    frames = np.asarray(forward(scene.robot.chain, scene.poses[gaps.pose].q))
    origins = np.vstack([np.zeros(3), frames[:, :3, 3]])
    along, (x, y, z) = main_direction(origins), np.eye(3)
    base, rods = f"x of {frame_text(scene.robot)}, m", objects.rods[gaps.pose]
    spheres = objects.spheres[gaps.pose]
    height = float(_centre(rods, origins)[2])
    views = (
        (BALL, spheres, np.stack([along, z]), direction_label(along, scene), "z, m", "spheres"),
        (gaps.rod, rods, np.stack([x, y]), base, "y, m", f"rods, z = {height:.2f} m"),
    )
    figure = Figure(figsize=(10.0, 4.0), dpi=150, facecolor="white", layout="constrained")
    both = figure.subplots(1, 2)
    for ax, (shape, bounds, axes, across, up, title) in zip(both, views, strict=True):
        through = _centre(bounds, origins)
        margin = max(_MARGIN, bounds.low / 2)
        image = _section(ax, gaps, shape, axes, through - axes.T @ (axes @ through), margin)
        _largest(ax, bounds, shape, axes)
        ax.set_title(f"Largest unseen {title}", color=INK, fontsize=10)
        ax.set_xlabel(across, color=GREY, fontsize=8)
        ax.set_ylabel(up, color=GREY, fontsize=8)
        ax.tick_params(labelsize=8, colors=GREY)
        ax.spines[["top", "right"]].set_visible(False)
        bar = figure.colorbar(image, ax=ax, fraction=0.035)
        bar.set_label("diameter, mm (middle of its bounds)", color=GREY, fontsize=8)
        bar.ax.tick_params(labelsize=8, colors=GREY)
    key = [
        Patch(fc=COVERED, label="covered"),
        Patch(fc=_BODY, label="robot and obstacles"),
        Patch(fc="none", ec=_OBJECT, label="the largest"),
    ]
    figure.legend(handles=key, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    write_png(path, figure)


def _centre(bounds: ObjectBounds, origins: Any) -> Any:
    """Return the centre of an object, or of the arm where there is none."""
    return origins.mean(axis=0) if bounds.centre is None else np.array(bounds.centre)


def _section(
    ax: Any, gaps: GapMap, shape: ObjectShape, axes: Any, through: Any, margin: float
) -> Any:
    """Draw diameters in mm on a plane through a point with two axes (2, 3)."""
    box = gaps.solid.bounds()
    corners = np.stack(np.meshgrid(*box.T), -1).reshape(-1, 3) @ axes.T
    low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    step = float((high - low).max()) / _STEPS
    u, v = (np.arange(a, b, step) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(u, v), -1)
    points = through + grid.reshape(-1, 2) @ axes
    inside = np.flatnonzero(np.asarray(gaps.solid(points)) <= 0)
    seen = inside[gaps.covered(points[inside])]
    unseen = np.setdiff1d(inside, seen)
    values = np.full(len(points), np.nan)
    values[unseen] = 1000 * gaps.diameters(points[unseen], shape).mean(axis=0)
    shown = grid.shape[:2]
    image = ax.pcolormesh(u, v, values.reshape(shown), vmin=0, cmap="viridis")
    covered = np.full(len(points), 1.0)
    covered[seen] = -1.0
    for field, colour in ((covered, COVERED), (np.asarray(gaps.bodies(points)), _BODY)):
        if field.min() < 0:
            ax.contourf(u, v, field.reshape(shown), [-10.0, 0.0], colors=[colour])
    ax.set(aspect="equal", xlim=(u[0], u[-1]), ylim=(v[0], v[-1]))
    return image


def _largest(ax: Any, bounds: ObjectBounds, shape: ObjectShape, axes: Any) -> None:
    """Draw the outline of the object that was found, seen across the section."""
    if bounds.centre is None:
        return
    u, v = axes @ np.array(bounds.centre)
    style: dict[str, Any] = {"fill": False, "ec": _OBJECT, "lw": 1.8}
    if shape.length is not None and axes[1][2]:
        corner = (u - bounds.low / 2, v - shape.length / 2)
        ax.add_patch(Rectangle(corner, bounds.low, shape.length, **style))
    else:
        ax.add_patch(Circle((u, v), bounds.low / 2, **style))
