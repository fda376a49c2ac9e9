"""A scene: what is asked. Robot, poses with weights, targets with weights, sensor, mount limits."""

import math
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from ..coverage.rings import RING_RADIUS
from ..coverage.robots import UR10, Robot
from ..coverage.sensors import PAPER_SENSOR, Sensor
from ..coverage.targets import Shape, Target

REFERENCE_POSE_DEG = (0.0, -45.0, 60.0, -105.0, -90.0, 0.0)


@dataclass(frozen=True)
class Pose:
    """Joint angles q (J,) rad and the weight of the pose in the mean."""

    q: Float[np.ndarray, " J"]
    weight: float = 1.0


@dataclass(frozen=True)
class Goal:
    """A target volume and its weight in the objective."""

    target: Target
    weight: float = 1.0


@dataclass(frozen=True)
class Limits:
    """Where rings may sit and how they may tilt: position (low, high) on each link's mount axis, tilt (low, high) rad."""

    position: tuple[float, float] = (0.0, 1.0)
    tilt: tuple[float, float] = (math.radians(-70), math.radians(70))


@dataclass(frozen=True)
class Scene:
    """The empty scene is the reference scene: a UR10 in one pose, V_S(0.5), the paper's sensor and ring radius.

    limits: of each link by name; a link that is not named has the default limits.
    """

    robot: Robot = UR10
    poses: tuple[Pose, ...] = (Pose(np.radians(REFERENCE_POSE_DEG)),)
    goals: tuple[Goal, ...] = (Goal(Target("V_S", 0.5)),)
    sensor: Sensor = PAPER_SENSOR
    ring_radius: float = RING_RADIUS
    shape: Shape = field(default_factory=Shape)
    limits: dict[str, Limits] = field(default_factory=dict)

    def limits_of(self, link: str) -> Limits:
        """The limits of ``link``."""
        return self.limits.get(link, Limits())

    @property
    def pose_weights(self) -> Float[np.ndarray, " P"]:
        """Weights of the poses, summing to 1."""
        w = np.array([p.weight for p in self.poses], float)
        return w / w.sum()

    @property
    def goal_weights(self) -> Float[np.ndarray, " G"]:
        """Weights of the goals, summing to 1."""
        w = np.array([g.weight for g in self.goals], float)
        return w / w.sum()
