"""Where a robot is, how fast its parts are and how far a person must be from them, at moments of
its motion.
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from jaxtyping import Float, Int

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

    q (M, J) rad: joint angles; frames (M, F, 4, 4); bodies, that hide what is behind them. Of the
    pieces of the bodies that distances are measured from: start and end (M, N, 3) m, radius (N,) m,
    speed (M, N) m/s, and the separation distance asked (M, N) m. weight (M,) sums to 1. together:
    do the moments follow each other by ``STEP``, or does each stand alone?
    """

    q: Float[np.ndarray, "M J"]
    frames: Float[np.ndarray, "M F 4 4"]
    bodies: Capsules
    start: Float[np.ndarray, "M N 3"]
    end: Float[np.ndarray, "M N 3"]
    radius: Float[np.ndarray, " N"]
    speed: Float[np.ndarray, "M N"]
    asked: Float[np.ndarray, "M N"]
    weight: Float[np.ndarray, " M"]
    together: bool

    def drawn(self, rng: np.random.Generator, steps: int) -> Int[np.ndarray, " steps"]:
        """Numbers of the moments of so many steps that end at a drawn one: an approach's, or one
        pose again and again.
        """
        if not self.together:
            return np.full(steps, rng.choice(len(self.weight), p=self.weight))
        return self.before(int(rng.integers(len(self.weight))), np.arange(steps)[::-1])

    def before(self, moment: int, steps: Steps) -> Steps:
        """Number of the moment so many steps before another. A motion comes round again, so that at
        each step of a walk every moment is as likely, however short the motion; a pose is held."""
        return (moment - steps) % len(self.weight) if self.together else moment + 0 * steps


def _moments(
    robot: Robot,
    q: np.ndarray,
    rates: list[np.ndarray | None],
    weight: np.ndarray,
    safety: Safety,
    together: bool,
) -> Moments:
    frames = np.asarray(forward(robot.chain, q))
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
    """The whole record at steps of ``STEP``; the joints' speeds are differences over a step either
    way.

    Raises:
        ValueError: if the robot has no bodies or its stopping time is not known.
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
    """The scene's poses, each standing alone. For errors see ``moments_of_record``."""
    q, rates = np.stack([p.q for p in scene.poses]), [p.rate for p in scene.poses]
    return _moments(scene.robot, q, rates, scene.pose_weights, safety, False)
