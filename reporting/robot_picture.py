"""Picture to check a robot: its surface, capsules, mount axes with usable parts, and the pose
curve.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from ..coverage.robots.base_frame import frame_text
from ..coverage.robots.joint_values import joint_text
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.robots.robot import BASE, Robot
from ..coverage.targets.posed_robot import Shape, robot_curve
from ..formats.robots.robot_fit import FittedLink
from .plots import GREY, INK
from .rendering.canvas import Canvas
from .rendering.figures import add_base_axes, write_png
from .rendering.meshes import FINE_DISC, circle

_AXIS = 0.12  # length of a drawn axis, as a share of the picture's
_VIEWS = (("from the side", -90.0, 0.0), ("oblique view", -58.0, 22.0))
_SKIN, _CAPSULE, _MOUNT, _CURVE = "#dbe0e5", "#0072B2", "#D55E00", "#009E73"


def _surface(links: Sequence[FittedLink], frames: Any) -> Any:
    """Return triangles (T, 3, 3) m of all surfaces in the base frame."""
    triangles = [np.zeros((0, 3, 3))]
    for link in links:
        T = np.eye(4) if link.frame == BASE else frames[link.frame]
        triangles.append(link.triangles @ T[:3, :3].T + T[:3, 3])
    return np.concatenate(triangles)


def _view(ax: Any, robot: Robot, skin: Any, box: Any, eye: tuple[float, float]) -> None:

    frames = forward(robot.chain, robot.rest)
    canvas = Canvas(ax, box, *eye)
    canvas.faces(skin, _SKIN)
    canvas.draw(zorder=1)
    if robot.bodies:
        bodies = robot_capsules(robot, frames)
        for a, b, r in zip(bodies.start, bodies.end, bodies.radius, strict=True):
            rims = [circle(p, canvas.rotation[2], float(r), FINE_DISC) for p in (a, b)]
            outline = canvas.hull(np.concatenate(rims))
            ax.add_patch(
                Polygon(
                    outline, facecolor=(_CAPSULE, 0.09), edgecolor=(_CAPSULE, 0.7), lw=1.1, zorder=2
                )
            )
    curve = robot_curve(robot, robot.rest, Shape())
    line = np.concatenate([piece.point(np.linspace(0, 1, 24)) for piece in curve.pieces])
    xy = canvas.project(line)[0]
    ax.plot(*xy.T, color="white", lw=4.2, zorder=3, solid_capstyle="round")
    ax.plot(*xy.T, color=_CURVE, lw=2.0, zorder=3.1, solid_capstyle="round")
    origins = canvas.project(np.vstack([np.zeros(3), frames[:, :3, 3]]))[0]
    ax.plot(*origins.T, "o", ms=4.5, color="white", mec=_CURVE, mew=1.2, zorder=3.2)
    add_base_axes(canvas, _AXIS * float(np.ptp(box, axis=0).max()))
    for m in robot.mounts:
        _mount(canvas, frames[m.frame], m)


def _mount(canvas: Canvas, T: Any, m: Any) -> None:
    """Draw the mount axis, thick where it is usable, with its name and the circles that a ring
    surrounds.
    """
    ax, R = canvas.ax, T[:3, :3]

    def place(t: float) -> np.ndarray:
        point: np.ndarray = T[:3, 3] + R @ (m.start + t * m.length * m.axis)
        return point

    radius = max(m.section, 0.02)
    shares = [0.0] if m.length == 0 else np.linspace(m.usable[0], m.usable[1], 3)
    for t in shares:
        xy = canvas.project(circle(place(t), R @ m.axis, radius))[0]
        xy = np.vstack([xy, xy[:1]])
        ax.plot(*xy.T, color="white", lw=3.0, zorder=4)
        ax.plot(*xy.T, color=_MOUNT, lw=1.6, zorder=4.1)
    if m.length > 0:
        whole, usable = (
            canvas.project(np.array([place(t) for t in ends]))[0] for ends in ((0.0, 1.0), m.usable)
        )
        ax.plot(*whole.T, color=_MOUNT, lw=1.2, ls=(0, (2, 2)), zorder=4.2)
        ax.plot(*usable.T, color=_MOUNT, lw=4.0, zorder=4.3, solid_capstyle="butt")
    middle, _ = canvas.project(place(sum(m.usable) / 2 if m.length > 0 else 0.0))
    side = np.array([1.0, 0.35]) if m.length > 0 else np.array([1.0, -0.35])
    ax.annotate(
        m.link.replace("_", " "),
        middle,
        xytext=middle + (radius + 0.03 * canvas.size) * side / np.linalg.norm(side),
        fontsize=10,
        color=INK,
        va="center",
        zorder=6,
        arrowprops={"arrowstyle": "-", "color": GREY, "lw": 0.8, "shrinkA": 1, "shrinkB": 4},
        bbox={
            "boxstyle": "round,pad=0.2",
            "facecolor": "white",
            "edgecolor": "none",
            "alpha": 0.85,
        },
    )


def robot_picture(path: Path, robot: Robot, links: Sequence[FittedLink] = ()) -> None:
    """Draw a robot in its default pose from two sides: a PNG of 1800 x 900.

    Args:
        path: file to write; its folder exists.
        robot: robot to draw.
        links: surfaces that the bodies were fitted to, if any.

    Raises:
        UserError: if the file cannot be written; an existing file stays unchanged.
    """
    frames = forward(robot.chain, robot.rest)
    skin = _surface(links, frames)
    reach = [np.zeros((1, 3)), frames[:, :3, 3], skin.reshape(-1, 3)]
    if robot.bodies:
        c = robot_capsules(robot, frames)
        reach += [p + s * c.radius[:, None] for p in (c.start, c.end) for s in (-1, 1)]
    everything = np.concatenate(reach)
    box = np.stack([everything.min(axis=0), everything.max(axis=0)])
    figure = Figure(figsize=(18, 9), dpi=100, facecolor="white")
    for i, (caption, *eye) in enumerate(_VIEWS):
        ax = figure.add_axes((0.02 + 0.49 * i, 0.08, 0.47, 0.8))
        _view(ax, robot, skin, box, (eye[0], eye[1]))
        ax.set_aspect("equal")
        ax.margins(0.13, 0.04)
        ax.axis("off")
        caption += f" · axes of {frame_text(robot)}"
        ax.set_title(caption, fontsize=11, color=GREY)
    angles = joint_text(robot.chain, robot.rest)
    figure.text(0.03, 0.955, robot.name, fontsize=17, color=INK, weight="bold")
    figure.text(
        0.03,
        0.925,
        f"{len(robot.chain)} joints   ·   reach {robot.reach:g} m   ·   {len(robot.bodies)}"
        f" capsules   ·   pose {angles}",
        fontsize=11,
        color=GREY,
    )
    keys = [
        Patch(facecolor=(_CAPSULE, 0.15), edgecolor=_CAPSULE, label="bodies (capsules)"),
        Line2D([], [], color=_MOUNT, lw=4, label="mount axis, usable"),
        Line2D(
            [], [], color=_MOUNT, lw=1.2, ls=(0, (2, 2)), label="mount axis, inside joint housings"
        ),
        Line2D(
            [],
            [],
            color=_MOUNT,
            lw=1.6,
            marker="o",
            mfc="none",
            ls="none",
            ms=9,
            label="cross-section that a ring surrounds",
        ),
        Line2D([], [], color=_CURVE, lw=2, marker="o", mfc="white", label="pose curve, joints"),
    ]
    if len(skin):
        keys.insert(0, Patch(facecolor=_SKIN, label="surface"))
    figure.legend(handles=keys, loc="lower center", ncols=len(keys), frameon=False, fontsize=10.5)
    write_png(path, figure)
