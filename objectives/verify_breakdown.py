"""Counted zeta of a setup broken down by occlusion model, by kind of sensor, by where people can
be, and without the arm's calibration."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..coverage.occlusion.occlusion_mode import OCCLUSIONS, ONE_TARGET, Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.rings.ring_kinematics import sensor_axes
from ..coverage.robots.kinematics import forward
from .scene import Scene
from .verified import CalibrationEffect, PeopleShare, PoseZeta, Verified, weighted_mean
from .verify import EmptyTargetError, Verifier


def by_occlusion(
    verifier: Verifier,
    setup: Setup,
    known: Verified,
    models: Sequence[Occlusion] = OCCLUSIONS,
) -> dict[Occlusion, Verified]:
    """Return counts of ``setup`` for the target of ``known`` under occlusion models.

    All are counted on the same voxels; the result for the scene's own model is taken from
    ``known``. Sensors of one target leave out ``returns``, which is ``blind`` for them. The
    dictionary is empty if the robot has no bodies or the rule is ``certified``: an interval holds
    for one model only.
    """
    scene = verifier.scene
    sensors = [group.sensor for group in scene.with_cell(setup).groups]
    several = any(len(sensor.separations) > 1 and not sensor.zoned for sensor in sensors)
    differing = OCCLUSIONS if several else (*ONE_TARGET, scene.occlusion)
    if not scene.robot.bodies or verifier.rule == "certified":
        return {}
    return {
        occlusion: (
            known
            if occlusion == scene.occlusion
            else verifier.under(occlusion).verify(setup, known.target)
        )
        for occlusion in models
        if occlusion in differing
    }


def where_people_are(verifier: Verifier, setup: Setup, known: Verified) -> PeopleShare | None:
    """Return which part of the target of ``known`` the scene's person can touch, and its zeta.

    None if the scene states no person, if the target has this end already, or if the rule is
    ``certified``. A part of no voxel at any pose has the zeta 0.
    """
    target, scene = known.target, verifier.scene
    if scene.person is None or target.reachable == "person" or verifier.rule == "certified":
        return None
    cut, parts, share = replace(target, reachable="person"), list[PoseZeta](), 0.0
    for pose, whole in enumerate(known.poses):
        try:
            part = verifier.at_pose(setup, cut, pose)
        except EmptyTargetError:  # no person touches the target at this pose
            continue
        parts.append(part)
        share += whole.weight * (part.target_voxels or 0) / (whole.target_voxels or 1)
    if not parts:
        return PeopleShare(0.0, 0.0)
    total = math.fsum(p.weight for p in parts)
    return PeopleShare(
        share, weighted_mean([p.weight / total for p in parts], [p.zeta for p in parts])
    )


PARTS = ("rings", "single sensors", "sensors of the cell")


def by_part(verifier: Verifier, setup: Setup, known: Verified) -> dict[str, float]:
    """Return zeta in [0, 1] of each part alone for the target of ``known``: of the rings, the
    single sensors and the sensors of the cell.

    Parts without sensors are left out; the dictionary is empty if there are fewer than two parts,
    or if the rule is ``certified``. All are counted on the same voxels, with the same occluders.
    """
    bare, cell = replace(verifier.scene, cell_sensors=()), verifier.scene.cell_sensors
    each = (Setup(setup.rings), Setup((), setup.singles), Setup((), cell))
    parts = {name: part for name, part in zip(PARTS, each, strict=True) if part.sensors}
    if len(parts) < 2 or verifier.rule == "certified":
        return {}
    alone = verifier.in_scene(bare)
    return {name: alone.verify(part, known.target).zeta for name, part in parts.items()}


def mean_by_part(verifier: Verifier, setup: Setup, each: Sequence[Verified]) -> dict[str, float]:
    """Return ``by_part`` as the weighted mean over the scene's goals, whose counts are ``each``."""
    zetas = [by_part(verifier, setup, one) for one in each]
    weights = verifier.scene.goal_weights
    return {
        part: float(sum(w * zeta[part] for w, zeta in zip(weights, zetas, strict=True)))
        for part in zetas[0]
    }


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
