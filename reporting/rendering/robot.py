"""Robot and rings on a canvas."""

from itertools import pairwise
from typing import Any

import numpy as np

from ...coverage.rings.ring import Setup
from ...coverage.robots.link_bodies import attached_at, carried_at, robot_capsules
from ...coverage.robots.robot import Robot
from ...formats.export.palette import ROBOT
from ...objectives.scene import Scene
from .canvas import Canvas
from .colours import rgb
from .meshes import ball, band, body, capsule_surfaces, circle, faces_of, loops, rod, tube

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
