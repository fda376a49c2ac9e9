"""Zeta of detection: the expected share of a target in which a test piece is detected in time."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float

from ..coverage.arrays import rows
from ..coverage.detection.detection import Detection, bounds, detectors
from ..coverage.detection.noticed import NEGLIGIBLE, Noticed, noticed
from ..coverage.rings.ring import Setup
from ..coverage.rings.ring_kinematics import sensor_cones
from ..coverage.targets.target import Target
from ..coverage.voxels.certified_bounds import bracket
from ..coverage.voxels.octree_cells import Cells, Region, first_cells
from ..coverage.voxels.sample_points import points_in_blocks
from ..coverage.voxels.voxel_bitmask import LEVEL, VOXELS
from ..coverage.voxels.voxel_set import VoxelSet, centre
from ..coverage.weight_field import WeightField
from .detected import Detected, PoseDetected
from .occlusion import occluders
from .pose_workers import each_pose
from .sampling_error import error_of
from .scene import Scene
from .verified import weighted_mean
from .verify import VOXEL, Verifier

LAW_ERROR = (0.045, 0.07)
"""Error of the law, as a share: that of sensors of one zone, and where some have several. It holds
95 % of 528 questions of ``place-rings study detection`` with the seeds 100 and 101."""
_MEANS = ("zeta", "low", "high", "error", "assumed_low", "assumed_high")
_CHUNK = 1 << 13  # pairs of a block and a sensor evaluated at once, at 64 points for each
_BITS = np.arange(VOXELS, dtype=np.uint64)[:, None]


def noticed_in(
    scene: Scene, setup: Setup, pose: int, detection: Detection, assumed: bool = False
) -> Noticed:
    """Return where a setup and the cell's sensors detect a test piece at a pose of a scene.

    Args:
        scene: the scene.
        setup: the setup.
        pose: number of the pose.
        detection: the question.
        assumed: whether also by both ends of what the law's assumptions leave open.

    Raises:
        ValueError: if no source states a sensor's range in such light.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    q, placed = scene.poses[pose].q, scene.with_cell(setup)
    sensors = [group.sensor for group in placed.groups for _ in range(group.count)]
    of, ends = detectors(sensors, detection), bounds(sensors, detection) if assumed else ()
    cones = sensor_cones(scene.robot, placed, q)
    return noticed(cones, occluders(scene, q), scene.occlusion, of, detection, *ends)


def several_zones(scene: Scene, setup: Setup) -> bool:
    """Return whether a sensor of a setup or the cell has several zones."""
    return any(group.sensor.zones > 1 for group in scene.with_cell(setup).groups)


@dataclass
class ExpectedCount:
    """Sums over a target's voxels."""

    detected: Float[np.ndarray, " L"]
    """Summed weight times the probability that the piece is detected, by each of the
    assumptions."""
    voxels: int = 0
    """Number of voxels."""
    weight: float = 0.0
    """Summed weight."""
    largest: float = 0.0
    """No voxel has a larger weight."""
    pairs: Float[np.ndarray, " 3"] = field(default_factory=lambda: np.zeros(3))
    """Over pairs of neighbours, with the difference a of weight times probability by the first
    assumptions and the difference b of weight, both 0 outside the target: summed a², ab and b²."""

    @property
    def zetas(self) -> list[float]:
        """Expected shares, in [0, 1], by each of the assumptions."""
        return [min(float(d) / self.weight, 1.0) for d in self.detected]

    @property
    def error(self) -> float:
        """Error of the share that sample points give: 3.3 standard deviations.

        It is computed as that of a covered share (``PointCount.error``): the residual of a voxel is
        its weight times (probability - zeta).
        """
        return error_of(self.pairs, self.zetas[0], self.largest, self.weight)


def count_expected(
    noticed: Noticed,
    wanted: VoxelSet,
    rule: str,
    weights: WeightField | None,
    start: Cells,
    count: ExpectedCount,
) -> None:
    """Add the voxels of a target, each judged at its point, to a count.

    Sensors whose probability is at most ``NEGLIGIBLE`` in a whole cell of the octree are left out
    there, and a block of 64 voxels in which bounds of the probability differ by no more is counted
    by their mean. So each voxel's probability is exact to ``NEGLIGIBLE`` for every sensor.

    Args:
        noticed: the sensors.
        wanted: the voxels.
        rule: ``sampled`` or ``centre``.
        weights: the target's weights, if it has any.
        start: octree cells that hold the voxels, paired with all sensors.
        count: the sums.
    """
    count.voxels += len(wanted)
    if weights is None:
        count.weight += len(wanted)
        count.largest = 1.0
        count.pairs[2] += wanted.differing
    for blocks in _blocks(noticed, wanted, start, keep=weights is not None):
        points = points_in_blocks(blocks.numbers, wanted.voxel, rule == "sampled")
        inside = wanted.words(blocks.key) >> _BITS & np.uint64(1)  # (64, B)
        weight = inside.astype(float)
        if weights is not None:
            weight *= weights.levels_at(points.reshape(-1, 3)).reshape(weight.shape)
            count.weight += float(weight.sum())
            count.largest = max(count.largest, float(weight.max(initial=0.0)))
        each = weight * _probability(noticed, blocks, points, wanted.voxel)
        count.detected += [float(detected.sum()) for detected in each]
        for axis in range(3):  # bits 0, 1 and 2 of a voxel's number tell partners apart
            a, b = (np.diff(v.reshape(8, 2, 2, 2, -1), axis=3 - axis) for v in (each[0], weight))
            count.pairs[:2] += (a * a).sum(), (a * b).sum()
            if weights is not None:
                count.pairs[2] += (b * b).sum()


def _blocks(noticed: Noticed, wanted: VoxelSet, start: Cells, keep: bool) -> Iterator[Cells]:
    """Yield blocks of 4 x 4 x 4 voxels with a wanted one, paired with the sensors that may detect
    the piece in them; blocks without such a sensor only with ``keep``."""
    for cells in start.slices(_CHUNK):
        cells = cells.only(wanted.count_in(cells.key, 1 << 3 * cells.level) > 0)
        (cell, part), reach = cells.pairs[0], 3**0.5 / 2 * wanted.voxel * (1 << cells.level)
        at = centre(cells.numbers, cells.level, wanted.voxel)[cell]
        matters, _ = noticed.decide(at, cell, part, reach)
        cells = cells.left(((cell[matters], part[matters]),), cells.mark)
        if not keep:
            cells = cells.only(np.bincount(cells.pairs[0][0], minlength=len(cells)) > 0)
        if len(cells) and cells.level > LEVEL:  # depth first: memory holds one run of each level
            yield from _blocks(noticed, wanted, cells.children(), keep)
        elif len(cells):
            yield cells


def _probability(
    noticed: Noticed, blocks: Cells, points: Float[np.ndarray, "64 B 3"], voxel: float
) -> Float[np.ndarray, "L 64 B"]:
    """Return the probability of detection at the points of blocks' voxels, by each of the
    assumptions."""
    (cell, sensor), count = blocks.pairs[0], len(blocks)
    middle = rows(centre(blocks.numbers, LEVEL, voxel), cell)
    each = noticed.chances(middle, sensor, 3**0.5 / 2 * voxel * (1 << LEVEL))
    low, high = (noticed.together(p, cell, count) for p in (each.low, each.high))
    value = np.repeat(((low + high) / 2)[:, None], len(points), axis=1)
    open_ = high - low > NEGLIGIBLE
    some = open_.any(axis=0)
    if some.any():
        pairs = np.flatnonzero(some[cell] & (each.high > 0).any(axis=0))
        cell, sensor, number = cell[pairs], sensor[pairs], np.cumsum(some) - 1
        chance = noticed.chance(rows(points, cell), sensor)
        exact = noticed.together(chance, number[cell], int(some.sum()))
        value[..., some] = np.where(open_[:, None, some], exact, value[..., some])
    return value


def at_pose(
    verifier: Verifier,
    setup: Setup,
    target: Target,
    pose: int,
    detection: Detection,
    assumed: bool = False,
) -> PoseDetected:
    """Return zeta of detection at a pose, by the rule and on the voxels of ``verifier``.

    With ``assumed`` a count also has the ends of what the law's assumptions leave open.

    Under the rule ``certified`` the interval holds the mean of the law over the target, by cells of
    the verifier's voxel or of 0.01 m: its width falls with their side, so a requested width would
    take far more of them than that of zeta.

    Raises:
        ValueError: as ``Verifier.verify``; for the rule ``touch``; in light without a figure.
    """
    scene = verifier.scene
    certified, weight = verifier.rule == "certified", float(scene.pose_weights[pose])
    law = noticed_in(scene, setup, pose, detection, assumed and not certified)
    solid = scene.solid(target, pose)
    if certified:
        verifier.at(pose)
        b = bracket(solid, law, 0.0, verifier.voxel or VOXEL, weights=target.importance)
        # what was left out: a sensor adds at most its own probability
        low, high = b.low, min(b.high + len(law) * NEGLIGIBLE, 1.0)
        return PoseDetected(weight=weight, zeta=(low + high) / 2, low=low, high=high)
    voxel, count = verifier.point_voxel, ExpectedCount(np.zeros(len(law.rates)))
    for wanted, region in verifier.pieces(target, pose):
        start = _start(law, solid.bounds(), voxel, region)
        count_expected(law, wanted, verifier.rule, target.importance, start, count)
    error = count.error if verifier.rule == "sampled" else None
    zeta, *ends = count.zetas
    least, most = ends or (None, None)
    return PoseDetected(weight=weight, zeta=zeta, error=error, assumed_low=least, assumed_high=most)


def detected(verifier: Verifier, setup: Setup, target: Target, detection: Detection) -> Detected:
    """Return zeta of detection of a target over the poses of the verifier's scene, with the error
    of the count or a guaranteed interval and, beside a count, with the ends of what the law's
    assumptions leave open; raises as ``at_pose``.
    """
    start = time.perf_counter()
    here = partial(at_pose, verifier, setup, target, detection=detection, assumed=True)
    poses = each_pose(here, len(verifier.scene.poses), verifier.at)
    return Detected(
        question=detection,
        **{key: _mean(poses, key) for key in _MEANS},
        law_error=LAW_ERROR[several_zones(verifier.scene, setup)],
        cell=(verifier.voxel or VOXEL) if verifier.rule == "certified" else None,
        poses=poses,
        seconds=time.perf_counter() - start,
    )


def _mean(poses: Sequence[PoseDetected], key: str) -> Any:
    """Return the weighted mean of a value at all poses; None where it is not known."""
    each = [getattr(p, key) for p in poses]
    return None if None in each else weighted_mean([p.weight for p in poses], each)


def _start(law: Noticed, box: Any, voxel: float, region: Region | None) -> Cells:
    """Return octree cells of a target, paired with all sensors."""
    if region is not None:
        return region.start([law], 0, LEVEL)
    return first_cells([law], box, voxel, 0, LEVEL)
