"""Whether the sensors of a setup see a person who is made of balls."""

import numpy as np
from jaxtyping import Bool, Float, Int

from ..coverage.occlusion.first_return import Beam
from ..coverage.occlusion.occlusion_mode import REPORTING, Occlusion
from ..coverage.occlusion.polyhedron_return import polyhedron_in_beam
from ..coverage.occlusion.ranging import readings
from ..coverage.occlusion.unreported import capsule_end, polyhedron_end, unreported
from ..coverage.rings.ring import Setup, sensor_optics
from ..coverage.rings.ring_kinematics import sensor_axes
from ..coverage.robots.robot import Robot
from ..coverage.solids.capsules import Capsules
from ..coverage.solids.polyhedra import Polyhedron
from ..coverage.solids.sensor_beams import separations_of
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
    if occlusion in REPORTING:
        dark = dark_distances(setup, apex, axis, bodies, obstacles, occlusion)
        hidden = (distance[..., None] >= dark[..., 0]) & (distance[..., None] < dark[..., 1])
        distance = np.where(hidden.any(axis=-1), np.inf, distance)
    return distance < np.inf


def dark_distances(
    setup: Setup,
    apex: Float[np.ndarray, "T K 3"],
    axis: Float[np.ndarray, "T K 3"],
    bodies: Capsules,
    obstacles: tuple[Polyhedron, ...],
    occlusion: Occlusion,
) -> Float[np.ndarray, "T K M 2"]:
    """Return the intervals of the distance, m, in which the sensors report nothing (see
    ``unreported``), under ``returns`` or ``blind``; they begin at infinity for multi-zone sensors.

    Balls that contain the robot's bodies, at most 1 mm larger, replace them.
    """
    start, end, radius = (np.asarray(a) for a in bodies.arrays())
    radius = radius + BALL_ERROR
    count = [group.count for group in setup.groups]
    sensors = [group.sensor for group in setup.groups for _ in range(group.count)]
    half = np.array([sensor.circumscribed_half_angle for sensor in sensors])
    range_m, zoned = sensor_optics(setup)[1], np.array([sensor.zoned for sensor in sensors])
    separation = np.full((len(sensors), 1), np.inf)
    if occlusion == "returns":
        separation = np.repeat(separations_of([g.sensor for g in setup.groups]), count, axis=0)
    # with one target only the first return of all bodies matters
    every = np.arange(len(radius))
    parts = [every] if separation.shape[1] == 1 else np.split(every, len(every))
    near, far = list[np.ndarray](), list[np.ndarray]()
    for n in parts:
        length = np.linalg.norm((end - start)[0, n], axis=1)
        balls = balls_along(start[:, n], end[:, n], radius[n], ball_counts(length, radius[n]))
        near.append(readings(apex, axis, half, range_m, *balls).distance)
        ends = capsule_end(apex[:, :, None], start[:, None, n], end[:, None, n], radius[n])
        far.append(ends.max(axis=-1))
    looks = Beam(
        apex.reshape(-1, 3), axis.reshape(-1, 3), *(np.tile(a, len(apex)) for a in (half, range_m))
    )
    for body in obstacles:
        near.append(polyhedron_in_beam(looks, body).reshape(apex.shape[:2]))
        far.append(polyhedron_end(apex, body))
    dark = np.asarray(unreported(np.stack(near, -1), np.stack(far, -1), separation))
    dark[:, zoned, :, 0] = np.inf
    return dark
