"""Robot and rings on a canvas."""

from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.collections import LineCollection

from ...coverage.rings.ring import Setup
from ...coverage.robots.link_bodies import attached_at, carried_at, robot_capsules
from ...coverage.robots.robot import Robot
from ...formats.export.palette import OBSTACLE, ROBOT
from ...objectives.scene import Scene
from ..plots import GREY, GRID, INK
from .canvas import Canvas
from .colours import rgb
from .meshes import (
    ball,
    band,
    body,
    capsule_surfaces,
    circle,
    faces_of,
    faces_within,
    loops,
    rod,
    sharp_edges,
    tube,
)

_LINK, _JOINT = ROBOT, "#7d8791"
_LINK_RADIUS, _JOINT_RADIUS = 0.048, 0.062  # m
_RIM = 0.7  # points, width of a ring's edges
_FOOT, _FOOT_HEIGHT = 0.095, 0.03  # m
_UP = np.eye(3)[2]


def canvas_about(ax: Any, robot: Robot, frames: Any, eye: tuple[float, float]) -> Canvas:
    """Return a canvas about the robot's bodies at ``frames``, for an eye at infinity at this
    azimuth and elevation, degrees."""
    bodies = robot_capsules(robot, frames)
    ends = np.concatenate(
        [p + s * bodies.radius[:, None] for p in (bodies.start, bodies.end) for s in (-1, 1)]
    )
    return Canvas(ax, np.stack([ends.min(axis=0), ends.max(axis=0)]), *eye)


def add_robot(
    canvas: Canvas,
    scene: Scene,
    frames: Any,
    setup: Setup,
    colour: dict[str, str],
    real: bool = False,
) -> None:
    """Add the robot's links, joints and foot, and its rings in the colours of their links.

    Args:
        canvas: canvas to draw on.
        scene: scene of the robot to draw.
        frames: T_base_frame (F, 4, 4) from ``forward``.
        setup: rings to draw.
        colour: colour by link.
        real: True to draw the robot's bodies, if it has any, instead of a stick figure along joints
            and mounts.
    """
    robot = scene.robot
    if real and robot.bodies:
        _add_bodies(canvas, robot, frames)
    else:
        _add_stick(canvas, robot, frames)
    _add_attached(canvas, robot, frames, bool(real and robot.bodies))
    for ring in setup.rings:
        rims = band(scene, frames, ring)
        canvas.mesh(tube(rims), colour[ring.link])
        # a ring seen edge-on has no other visible area
        canvas.lines(loops(rims), 0.8 * rgb(colour[ring.link]), _RIM)


def _add_bodies(canvas: Canvas, robot: Robot, frames: Any) -> None:
    for surface in capsule_surfaces(robot_capsules(robot, frames)):
        canvas.mesh(surface, _LINK, closed=True)


def _add_attached(canvas: Canvas, robot: Robot, frames: Any, with_bodies: bool) -> None:
    """Add what is attached to the robot; its capsules only if they are not drawn as bodies."""
    for solid in carried_at(robot, frames):
        canvas.faces(faces_of(solid), _LINK)
    capsules = None if with_bodies else attached_at(robot, frames)
    for surface in () if capsules is None else capsule_surfaces(capsules):
        canvas.mesh(surface, _LINK, closed=True)


def _add_stick(canvas: Canvas, robot: Robot, frames: Any) -> None:
    line = body(robot, frames)
    for a, b in pairwise(line):
        canvas.mesh(tube(rod(a, b, _LINK_RADIUS)), _LINK, closed=True)
    low, high = (circle(line[0] + h * _UP, _UP, _FOOT) for h in (0.0, _FOOT_HEIGHT))
    canvas.mesh(tube(np.stack([low, high])), _JOINT, closed=True)
    canvas.faces(high[None], _JOINT)
    for p in line[1:-1]:
        canvas.mesh(tube(ball(p, _JOINT_RADIUS, 13)), _JOINT, closed=True)


def draw_room(canvas: Canvas) -> None:
    """Draw the floor and the far walls of the box with a grid in metres of the base frame; from
    above, the floor only.
    """
    (low, high), walls = canvas.box, canvas.rotation[2, 2] < 0.99
    far = np.where(canvas.rotation[2] > 0, low, high)
    near, unit, step = (
        low + high - far,
        0.035 * canvas.size,
        0.5 if (high - low).max() < 2.8 else 1.0,
    )
    ticks = [
        step * np.arange(np.ceil(low[i] / step), np.floor(high[i] / step) + 1) + 0.0
        for i in range(3)
    ]

    # the line across the box at t on axis i
    def rule(i: int, along: int, t: float, start: Any) -> Any:
        ends = np.array([start, start])
        ends[:, i], ends[:, along] = t, canvas.box[:, along]
        return canvas.project(ends)[0]

    faces = [(0, 1), (1, 0), *([(0, 2), (2, 0), (1, 2), (2, 1)] if walls else [])]
    rules = [rule(i, j, t, far) for i, j in faces for t in (low[i], *ticks[i], high[i])]
    canvas.ax.add_collection(LineCollection(rules, colors=GRID, linewidths=0.8, zorder=0))
    front, left = np.array([near[0], near[1], low[2]]), np.array([far[0], near[1], low[2]])
    for i, start in enumerate((front, front, left) if walls else (front, front)):
        a, b = rule(i, i, 0, start)
        x, y = (b - a) / np.linalg.norm(b - a)
        out = np.array([y, -x]) * np.sign(a @ [y, -x])  # away from the centre, which is at 0
        for t in ticks[i]:
            # x and y meet at the near corner
            if i == 2 or not walls or abs(t - near[i]) > 0.12 * step:
                u, v = canvas.project(np.array([*start[:i], t, *start[i + 1 :]]))[0] + unit * out
                canvas.ax.text(u, v, f"{t:g}", color=GREY, fontsize=10.5, ha="center", va="center")
        name, angle = (a + b) / 2 + 2.2 * unit * out, (np.degrees(np.arctan2(y, x)) + 80) % 180 - 80
        canvas.ax.text(
            name[0],
            name[1],
            f"{'xyz'[i]} (m)",
            color=INK,
            fontsize=11.5,
            rotation=angle,
            ha="center",
            va="center",
        )
        canvas.ax.update_datalim([name + 0.6 * unit * out])


_ALPHA = 0.1  # opacity of the faces
_WIDTH = 1.3  # points, width of the edges
_NEAR = 0.3  # m; obstacles as near to what a picture shows are part of it


def with_obstacles(box: Float[np.ndarray, "2 3"], scene: Scene) -> Float[np.ndarray, "2 3"]:
    """Return a box (2, 3) m extended to the parts of obstacles that lie near it; a floor, which has
    no end, is drawn in the box as it is."""
    room = box + np.array([[-_NEAR], [_NEAR]])
    solid = [one.body for one in scene.obstacles if len(one.body.edges)]
    corners = np.vstack([box, *(faces_within(body, room).reshape(-1, 3) for body in solid)])
    return np.stack([corners.min(axis=0), corners.max(axis=0)])


def add_obstacles(canvas: Canvas, scene: Scene) -> None:
    """Add the obstacles within the canvas's box: their edges, and faces that let most through."""
    for one in scene.obstacles:
        faces = faces_within(one.body, canvas.box)
        canvas.faces(faces, OBSTACLE, _ALPHA)
        canvas.lines(sharp_edges(faces), 0.72 * rgb(OBSTACLE), _WIDTH)
