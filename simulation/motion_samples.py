"""Moments of a motion: pose, speed of the robot's parts, and the separation distance of
each part."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from jaxtyping import Float, Int

from ..coverage.definitions.equality import equal_fields
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.robots.protective_volume import distances, moving
from ..coverage.robots.robot import Robot
from ..coverage.robots.separation_distance import Safety
from ..coverage.solids.capsules import Capsules
from ..objectives.scene import Scene
from ..objectives.trajectory import MotionRecord

STEP = 0.02  # s, from one moment to the next
Steps = TypeVar("Steps", int, np.ndarray)


@dataclass(frozen=True)
class Moments:
    """M moments of a motion.

    The robot's bodies are divided into N pieces, from which distances are measured.
    """

    q: Float[np.ndarray, "M J"]
    """Joint angles, rad."""
    frames: Float[np.ndarray, "M F 4 4"]
    """Link frames."""
    bodies: Capsules
    """Bodies that occlude."""
    start: Float[np.ndarray, "M N 3"]
    """Starts of the pieces, m."""
    end: Float[np.ndarray, "M N 3"]
    """Ends of the pieces, m."""
    radius: Float[np.ndarray, " N"]
    """Radii of the pieces, m."""
    speed: Float[np.ndarray, "M N"]
    """Speeds of the pieces, m/s."""
    required: Float[np.ndarray, "M N"]
    """Required separation distances of the pieces, m."""
    weight: Float[np.ndarray, " M"]
    """Weights of the moments, with sum 1."""
    together: bool
    """Whether the moments follow each other by ``STEP``; otherwise each stands alone."""

    __eq__ = equal_fields

    def drawn(self, rng: np.random.Generator, steps: int) -> Int[np.ndarray, " steps"]:
        """Return the moments of ``steps`` steps that end at a random one: consecutive moments, or
        one pose repeated."""
        if not self.together:
            return np.full(steps, rng.choice(len(self.weight), p=self.weight))
        return self.before(int(rng.integers(len(self.weight))), np.arange(steps)[::-1])

    def before(self, moment: int, steps: Steps) -> Steps:
        """Return the moment ``steps`` steps before another.

        A motion repeats, so that every moment is equally likely at each step of a walk, however
        short the motion; a pose is held.
        """
        return (moment - steps) % len(self.weight) if self.together else moment + 0 * steps


def _moments(
    robot: Robot,
    q: np.ndarray,
    rates: list[np.ndarray | None],
    weight: np.ndarray,
    safety: Safety,
    together: bool,
) -> Moments:
    frames, robot = np.asarray(forward(robot.chain, q)), robot.enclosed()
    parts = [moving(robot, *at, safety.speed) for at in zip(q, rates, strict=True)]
    return Moments(
        q,
        frames,
        robot_capsules(robot, frames),
        np.stack([np.asarray(p.rods.start) for p in parts]),
        np.stack([np.asarray(p.rods.end) for p in parts]),
        np.asarray(parts[0].rods.radius),
        np.stack([p.speed for p in parts]),
        np.stack([distances(robot, p, safety).total for p in parts]),
        weight,
        together,
    )


def moments_of_record(robot: Robot, record: MotionRecord, safety: Safety) -> Moments:
    """Return the whole record at steps of ``STEP``; joint speeds are central differences over one
    step either way.

    Raises:
        ValueError: if the robot has no bodies or its stopping time is unknown.
    """
    time = np.arange(record.time_s[0], record.time_s[-1], STEP)
    early, q, late = (
        np.stack([np.interp(time + shift, record.time_s, joint) for joint in record.q.T], axis=1)
        for shift in (-STEP, 0.0, STEP)
    )
    span = np.minimum(time + STEP, record.time_s[-1]) - np.maximum(time - STEP, record.time_s[0])
    rates = list((late - early) / span[:, None])
    return _moments(robot, q, rates, np.full(len(time), 1 / len(time)), safety, True)


def moments_of_scene(scene: Scene, safety: Safety) -> Moments:
    """Return the scene's poses, each on its own.

    Raises:
        ValueError: as in ``moments_of_record``.
    """
    q, rates = np.stack([p.q for p in scene.poses]), [p.rate for p in scene.poses]
    return _moments(scene.robot, q, rates, scene.pose_weights, safety, False)
