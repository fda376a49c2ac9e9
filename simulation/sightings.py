"""Whether the sensors of a setup see a person who is made of balls."""

import numpy as np
from jaxtyping import Bool, Float, Int

from ..coverage.occlusion.first_return import Beam
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.occlusion.polyhedron_return import polyhedron_in_beam
from ..coverage.occlusion.ranging import readings
from ..coverage.rings.ring import Setup, sensor_optics
from ..coverage.rings.ring_kinematics import sensor_axes
from ..coverage.robots.robot import Robot
from ..coverage.solids.capsules import Capsules
from ..coverage.solids.polyhedra import Polyhedron
from .human import BALL_ERROR, ball_counts, balls_along
from .motion_samples import Moments


def seen_by(
    robot: Robot,
    setup: Setup,
    m: Moments,
    at: Int[np.ndarray, " T"],
    balls: tuple[Float[np.ndarray, "T B 3"], Float[np.ndarray, " B"]],
    occlusion: Occlusion,
    obstacles: tuple[Polyhedron, ...],
) -> Bool[np.ndarray, "T K"]:
    """Return whether each sensor sees the person at each moment, (T, K)."""
    apex, axis = (np.asarray(a) for a in sensor_axes(robot, setup, m.frames[at]))
    bodies = m.bodies.at(at)
    hiding = None if occlusion == "ignore" else bodies
    (half, range_m), (centre, radius) = sensor_optics(setup), balls
    distance = readings(apex, axis, half, range_m, centre, radius, hiding, obstacles).distance
    return distance < (
        stops(setup, apex, axis, bodies, obstacles) if occlusion == "blind" else np.inf
    )


def stops(
    setup: Setup,
    apex: Float[np.ndarray, "T K 3"],
    axis: Float[np.ndarray, "T K 3"],
    bodies: Capsules,
    obstacles: tuple[Polyhedron, ...],
) -> Float[np.ndarray, "T K"]:
    """Return the distance of the first return of robot or obstacles in each beam, m; infinite for
    multi-zone sensors.

    Balls that contain the robot's bodies, at most 1 mm larger, replace them.
    """
    start, end, radius = (np.asarray(a) for a in bodies.arrays())
    radius = radius + BALL_ERROR
    balls = balls_along(
        start,
        end,
        radius,
        ball_counts(np.linalg.norm((end - start)[0], axis=1), radius, BALL_ERROR),
    )
    half, range_m = (
        np.concatenate([np.full(r.count, r.sensor.circumscribed_half_angle) for r in setup.groups]),
        sensor_optics(setup)[1],
    )
    stop = readings(apex, axis, half, range_m, *balls).distance
    for body in obstacles:
        looks = Beam(
            apex.reshape(-1, 3),
            axis.reshape(-1, 3),
            *(np.tile(a, len(apex)) for a in (half, range_m)),
        )
        stop = np.minimum(stop, polyhedron_in_beam(looks, body).reshape(stop.shape))
    return np.where(
        np.repeat([r.sensor.zoned for r in setup.groups], [r.count for r in setup.groups]),
        np.inf,
        stop,
    )
