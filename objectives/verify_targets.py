"""Counted zeta of one setup for several targets: one descent counts the voxels of all of them."""

import time
from collections.abc import Sequence
from functools import partial

from ..coverage.rings.ring import Setup
from ..coverage.targets.target import Target
from ..coverage.voxels.octree import MOST_SETS, count_each
from .pose_workers import each_pose
from .sampling_error import PointCount
from .verified import PoseZeta, Verified
from .verify import Verifier


def verify_targets(verifier: Verifier, setup: Setup, targets: Sequence[Target]) -> list[Verified]:
    """Return ``verifier.verify(setup, target)`` for each target, with fewer descents.

    The setup's octree is the same for all targets, so targets whose voxels fit into memory together
    share one; they also share its time equally.

    Raises:
        ValueError: if a target is empty, or its radius lies within V_R.
        TooFineError: if a count would take days.
        BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
    """
    results = []
    for some in _groups(verifier, targets):
        if len(some) == 1:
            results.append(verifier.verify(setup, some[0]))
            continue
        start = time.perf_counter()
        at_pose = partial(_at_pose, verifier, setup, some)
        poses = each_pose(at_pose, len(verifier.scene.poses), verifier.at)
        seconds = (time.perf_counter() - start) / len(some)
        results += [
            verifier.over_poses(target, each, seconds)
            for target, each in zip(some, zip(*poses, strict=True), strict=True)
        ]
    return results


def _at_pose(
    verifier: Verifier, setup: Setup, targets: Sequence[Target], pose: int
) -> list[PoseZeta]:
    """Return zeta at a pose of targets that fit into memory together."""
    sets = [wanted for target in targets for wanted, _ in verifier.pieces(target, pose)]
    seen, voxel = verifier.seen(setup, pose), verifier.point_voxel
    counts = [PointCount() for _ in sets]
    each = count_each(seen, voxel, verifier.points, sets, verifier.memory / 2)
    for count, wanted, counted in zip(counts, sets, each, strict=True):
        count.add(wanted, counted, [(1, wanted, counted)])
    return [verifier.counted(pose, count) for count in counts]


def _groups(verifier: Verifier, targets: Sequence[Target]) -> list[list[Target]]:
    """Split the targets into runs whose voxels fit into a quarter of the memory together."""
    if verifier.rule not in ("sampled", "centre"):
        return [[target] for target in targets]
    scene, groups, room = verifier.scene, list[list[Target]](), 0.0
    for target in targets:
        if target.importance is not None:  # many sets of its own
            groups.append([target])
            room = 0.0
            continue
        need = max(verifier.most_bytes(target, i) for i in range(len(scene.poses)))
        if not groups or need > room or len(groups[-1]) == MOST_SETS:
            groups.append([])
            room = verifier.memory / 4
        groups[-1].append(target)
        room -= need
    return groups
