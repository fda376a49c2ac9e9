"""What the calibration of an arm changes: where its sensors are, and ζ."""

from dataclasses import replace

import numpy as np

from ..coverage.rings.ring import Setup
from ..coverage.rings.ring_kinematics import sensor_axes
from ..coverage.robots.kinematics import forward
from .scene import Scene
from .verified import CalibrationEffect
from .verify import Verifier


def largest_move(scene: Scene, setup: Setup) -> float:
    """Return how far the calibration moves a sensor of a setup at a pose of the scene, m, at
    most."""
    q = np.array([pose.q for pose in scene.poses], float)
    own, model = (
        sensor_axes(robot, setup, forward(robot.chain, q))[0]  # (P, K, 3)
        for robot in (scene.robot, scene.robot.nominal)
    )
    return float(np.linalg.norm(own - model, axis=-1).max(initial=0.0))


def calibration_effect(verifier: Verifier, setup: Setup) -> list[CalibrationEffect]:
    """Return what the calibration of a scene's arm changes, for each goal; nothing without one.

    Args:
        verifier: counter of the scene, whose rule and voxels serve both counts.
        setup: the setup.
    """
    scene = verifier.scene
    if (calibration := scene.robot.calibration) is None:
        return []
    model = replace(scene, robot=scene.robot.nominal)
    nominal = Verifier(model, verifier.voxel, verifier.rule, verifier.width, memory=verifier.memory)
    move = largest_move(scene, setup)
    return [
        CalibrationEffect(calibration.source, move, verified.zeta)
        for verified in nominal.verify_goals(setup)
    ]
