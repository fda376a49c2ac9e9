"""Section of a report on detection: the expected share of each target in which test pieces are
detected, and where."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure

from ...coverage.detection.noticed import Noticed
from ...coverage.rings.ring import Setup
from ...coverage.robots.base_frame import frame_text
from ...coverage.robots.kinematics import forward
from ...objectives.detection_share import noticed_in
from ...objectives.scene import Scene
from ..lines.detection import MEANING, detected_text, detection_lines, open_text, question_text
from ..pages import escaped, table
from ..plots import GREY, INK
from ..rendering.figures import write_png
from ..tables import target_label
from .definition_picture import direction_label, draw_robot, main_direction
from .facts import DETECTION_VOXEL, QUESTIONS, Facts

PICTURE = "detection.png"
_STEPS, _AT_ONCE = 180, 2000  # points on the longer side of a section, and points computed at once
_MARGIN = 0.05  # m, around the target


def detection_section(f: Facts) -> Iterator[str]:
    """Yield zeta of detection of test pieces for each target, and a picture of the first."""
    yield "## Detection\n"
    labels = [target_label(r) for r in f.own]
    rows = []
    for n, question in enumerate(QUESTIONS):
        each = [r.detection for r in f.detected[n * len(f.own) : (n + 1) * len(f.own)]]
        cells = [f"{detected_text(d)} ({open_text(d)})" for d in each if d is not None]
        rows.append((escaped(question_text(question)), *cells))
    side = max(f.voxel, DETECTION_VOXEL)
    yield (
        f"In percent, by at least one sensor, counted with voxels of {side:g} m; in brackets what"
        f" the law's assumptions leave open. {MEANING}\n"
    )
    yield table(("test piece", *labels), rows, right=range(1, len(labels) + 1))
    lines = [escaped(line) for line in detection_lines(f.detected[:1], f.scene, f.setup)]
    if lines:
        yield "\n".join(lines) + "\n"
    yield (
        f"![Probability that a {QUESTIONS[0].piece.name} is detected, in a vertical and a"
        f" horizontal section through the target]({PICTURE})\n"
    )


def detection_picture(path: Path, scene: Scene, setup: Setup) -> None:
    """Draw the probability of the first question's answer in the first target and pose: in the
    vertical section through the arm, and in the horizontal one at the sensors' mean height.

    Args:
        path: file to write.
        scene: the scene.
        setup: the setup.

    Raises:
        UserError: if the file cannot be written.
    """
    law = noticed_in(scene, setup, 0, QUESTIONS[0])
    frames = np.asarray(forward(scene.robot.chain, scene.poses[0].q))
    origins = np.vstack([np.zeros(3), frames[:, :3, 3]])
    along, (x, y, z) = main_direction(origins), np.eye(3)
    through = origins.mean(axis=0) * [1, 1, 0]
    through -= (through @ along) * along  # so that the axis counts from the base
    height = float(np.mean(law.cones.apex[:, 2])) if len(law) else float(origins[:, 2].mean())
    views = (
        ("from the side", np.stack([along, z]), through, direction_label(along, scene), "z, m"),
        (
            f"from above, z = {height:.2f} m",
            np.stack([x, y]),
            height * z,
            f"x of {frame_text(scene.robot)}, m",
            "y, m",
        ),
    )
    figure = Figure(figsize=(9.0, 4.1), dpi=150, facecolor="white")
    image: Any = None
    for n, (title, axes, origin, across, up) in enumerate(views):
        ax = figure.add_axes((0.07 + 0.46 * n, 0.12, 0.38, 0.78))
        image = _section(ax, scene, law, axes, origin)
        draw_robot(ax, scene, frames, axes, origin)
        ax.set_title(title, color=INK, fontsize=10)
        ax.set_xlabel(across, color=GREY, fontsize=9)
        ax.set_ylabel(up, color=GREY, fontsize=9)
        ax.tick_params(labelsize=8, colors=GREY)
        ax.spines[["top", "right"]].set_visible(False)
    bar = figure.colorbar(image, cax=figure.add_axes((0.935, 0.12, 0.013, 0.78)))
    bar.set_label("probability of detection", color=GREY, fontsize=9)
    bar.ax.tick_params(labelsize=8, colors=GREY)
    write_png(path, figure)


def _section(ax: Any, scene: Scene, law: Noticed, axes: Any, origin: Any) -> Any:
    """Draw the probability in the target on a plane through a point with two axes (2, 3)."""
    solid = scene.solid(scene.targets[0].target, 0)
    box = solid.bounds()
    corners = np.stack(np.meshgrid(*box.T), -1).reshape(-1, 3)
    low, high = np.stack([f((corners - origin) @ axes.T, axis=0) for f in (np.min, np.max)])
    low, high = low - _MARGIN, high + _MARGIN
    step = float((high - low).max()) / _STEPS
    u, v = (np.arange(a, b, step) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(u, v), -1)
    points = origin + grid.reshape(-1, 2) @ axes
    inside = np.asarray(solid(points)) <= 0
    value = np.full(len(points), np.nan)
    value[inside] = _values(law, points[inside])
    image = ax.pcolormesh(u, v, value.reshape(grid.shape[:2]), vmin=0, vmax=1, cmap="viridis")
    ax.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    return image


def _values(law: Noticed, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
    """Return the probability at points, m."""
    parts = [law.at(points[i : i + _AT_ONCE]) for i in range(0, len(points), _AT_ONCE)]
    return np.concatenate([np.zeros(0), *parts])
