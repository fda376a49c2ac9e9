"""What the calibration of an arm changes: where its sensors are, and ζ."""

from dataclasses import dataclass, replace

import numpy as np

from ..coverage.rings.ring import Setup
from ..coverage.rings.ring_kinematics import sensor_axes
from ..coverage.robots.kinematics import forward
from .scene import CoreScene
from .verified import Verified
from .verify import Verifier


@dataclass(frozen=True)
class CalibrationEffect:
    """A setup with an arm's own kinematics, beside the same with those of its model."""

    source: str
    """What stated the calibration."""
    largest_move: float
    """Largest distance between the two places of a sensor at a pose of the scene, m."""
    nominal: tuple[Verified, ...]
    """Coverage of each goal with the model's kinematics."""


def largest_move(scene: CoreScene, setup: Setup) -> float:
    """Return how far the calibration moves a sensor of a setup at a pose of the scene, m, at
    most."""
    q = np.array([pose.q for pose in scene.poses], float)
    own, model = (
        sensor_axes(robot, setup, forward(robot.chain, q))[0]  # (P, K, 3)
        for robot in (scene.robot, scene.robot.nominal)
    )
    return float(np.linalg.norm(own - model, axis=-1).max(initial=0.0))


def calibration_effect(verifier: Verifier, setup: Setup) -> CalibrationEffect | None:
    """Return what the calibration of a scene's arm changes; None if it has none.

    Args:
        verifier: counter of the scene, whose rule and voxels serve both counts.
        setup: the setup.
    """
    scene = verifier.scene
    if (calibration := scene.robot.calibration) is None:
        return None
    model = replace(scene, robot=scene.robot.nominal)
    nominal = Verifier(model, verifier.voxel, verifier.rule, verifier.width, memory=verifier.memory)
    zetas = tuple(nominal.verify(setup, goal.target) for goal in scene.targets)
    return CalibrationEffect(calibration.source, largest_move(scene, setup), zetas)
