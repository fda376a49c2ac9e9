"""Dry run of a check: every pose and way that it would drive, in time, without a robot."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ...coverage.rings.ring_kinematics import sensor_axes
from ...coverage.robots.kinematics import forward
from ...objectives.scene import Scene
from ..poses.itinerary import Itinerary
from ..poses.routes import STEP, straight
from .plans import Plans


@dataclass(frozen=True)
class Stop:
    """A pose at which the robot stands."""

    name: str
    """Part of the check and number of the pose in it, such as ``mount 3``."""
    time: float
    """When the robot arrives, s."""


@dataclass(frozen=True)
class DryRun:
    """The motion of a check, without its pauses."""

    time: Float[np.ndarray, " T"]
    """Times from 0, s, at which the pose is stated; between them joints turn evenly."""
    joints: Float[np.ndarray, "T J"]
    """Joint angles, rad."""
    stops: tuple[Stop, ...]
    """Poses at which the robot stands, in order; the first is where it starts."""
    unreachable: tuple[str, ...]
    """Planned poses to which no clear way leads, and which the check leaves out."""

    @property
    def ranges(self) -> Float[np.ndarray, "J 2"]:
        """Lowest and highest angle of each joint, rad."""
        return np.stack([self.joints.min(axis=0), self.joints.max(axis=0)], axis=1)


def dry_run(scene: Scene, setup: Setup, plans: Plans, seed: int) -> DryRun:
    """Return the motion of a check that starts at the scene's first pose.

    A robot that stands elsewhere at the start takes another first way.

    Args:
        scene: robot, cell and limits.
        setup: the rings as proposed.
        plans: of the parts.
        seed: of the check.
    """
    start = np.asarray(scene.poses[0].q, float)
    return motion_of(scene, plans, Itinerary(scene, setup, start, plans.poses, seed))


def motion_of(scene: Scene, plans: Plans, route: Itinerary) -> DryRun:
    """Return the motion along an itinerary, from its start.

    The leading joint has the speed of the scene's ``[motion]``; starting and braking are not
    modelled.

    Args:
        scene: robot, cell and limits.
        plans: of the parts, whose poses the itinerary visits.
        route: the itinerary that ``check --move`` follows.
    """
    names = [n for n, p in (("mount", plans.mount), ("coverage", plans.rods)) if p]
    joints, time = [route.map.nodes[:1]], [np.zeros(1)]
    stops, left, legs, now, at = [Stop("start", 0.0)], list[str](), iter(route.legs), 0.0, 0
    for name, poses, reached in zip(names, plans.poses, route.reached, strict=True):
        for i in reached:
            goal = route.node(poses[i])
            while at != goal:
                _, to = next(legs)
                way = straight(route.map.nodes[at], route.map.nodes[to], STEP)
                until = now + float(np.abs(way[-1] - way[0]).max()) / scene.motion.speed
                joints.append(way[1:])
                time.append(np.linspace(now, until, len(way))[1:])
                now, at = until, to
            stops.append(Stop(f"{name} {i}", now))
        left += [f"{name} {i}" for i in sorted(set(range(len(poses))) - set(reached))]
    return DryRun(np.concatenate(time), np.concatenate(joints), tuple(stops), tuple(left))


def fastest(scene: Scene, setup: Setup, run: DryRun) -> float:
    """Return the largest speed of a joint's origin, of the TCP or of a sensor in a dry run, m/s."""
    moving = np.diff(run.time) > 0
    if not moving.any():
        return 0.0
    frames = np.asarray(forward(scene.robot.chain, run.joints))
    points = [frames[..., :3, 3]]
    if setup.groups:
        points.append(np.asarray(sensor_axes(scene.robot, setup, frames)[0]))
    path = np.concatenate(points, axis=1)  # (T, N, 3)
    far = np.linalg.norm(np.diff(path, axis=0), axis=-1).max(axis=1)
    return float((far[moving] / np.diff(run.time)[moving]).max())
