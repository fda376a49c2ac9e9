"""Choice among the finalists of a search by the exact count."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...coverage.rings.ring import Setup
from ...objectives.criterion import Criterion, judge
from ...objectives.pose_subset import MANY, representative
from ...objectives.scene import CoreScene
from ...objectives.verified import Verified
from ...objectives.verify import Verifier
from .stop_token import StopToken

# With more than ``MANY`` poses the finalists are compared roughly, and the chosen one is then
# counted with the requested voxels.
# m, side of the coarse voxels; number of representative poses (all where the worst one counts)
COARSE, ROUGH = 0.03, 64


@dataclass(frozen=True)
class Chosen:
    """The finalist that the exact count prefers."""

    index: int
    """Index of the finalist."""
    short: float
    """Sum by which it misses the goals' floors, in [0, 1]."""
    exact: float
    """Exact value, in [0, 1]."""
    voxel: float
    """Side of the voxels of the count, m."""
    verified: tuple[Verified, ...] = ()
    """Exact ζ of each goal, where ζ is the criterion and its count was not rough."""


def choose(
    verifier: Verifier,
    setups: Sequence[Setup],
    aim: Criterion,
    brake: StopToken,
    luck: np.random.Generator,
    tell: Callable[[int, int], None] = lambda counted, to_count: None,
) -> Chosen:
    """Return the setup with the best exact count.

    With many poses, the setups are first compared on coarser voxels, at a subset of the poses.

    Args:
        verifier: counts the answer; its ``at`` is replaced to report progress.
        setups: the finalists, the most promising first.
        aim: the criterion to maximise.
        brake: set by Ctrl-C, which cuts the count short; there is always an answer.
        luck: random generator that draws the representative poses.
        tell: receives the number of pairs of target and pose counted so far and in total, before
            each.

    Raises:
        ValueError: for an empty target.
    """
    scene, voxel = verifier.scene, verifier.voxel or COARSE
    many = len(scene.poses) > MANY
    some = _some(scene, luck) if many and scene.over_poses == "mean" else scene
    total = len(scene.goals) * (len(some.poses) * len(setups) + len(scene.poses) * many)
    counted = 0

    def at(_: int) -> None:
        nonlocal counted
        tell(counted, total)
        counted += 1

    verifier.at = at
    rough = Verifier(some, max(voxel, COARSE), at=at) if many else verifier
    judged = _judge_all(rough, setups, aim, brake)
    index = min(range(len(judged)), key=lambda i: (judged[i][0], -judged[i][1]))
    short, exact, verified = judged[index]
    chosen = Chosen(index, short, exact, rough.voxel or COARSE, () if many else verified)
    try:
        if many and not brake.pulled.is_set():
            short, exact, verified = _judged(verifier, setups[index], aim)
            chosen = Chosen(index, short, exact, voxel, verified)
    except KeyboardInterrupt:
        brake.pulled.set()
    finally:
        verifier.at = lambda _: None
    return chosen


def _some(scene: CoreScene, luck: np.random.Generator) -> CoreScene:
    """Return the scene with a representative subset of its poses."""
    weights = representative(scene.pose_weights, ROUGH, luck)
    poses = (
        replace(p, weight=float(w)) for p, w in zip(scene.poses, weights, strict=True) if w > 0
    )
    return replace(scene, poses=tuple(poses))


_Judged = tuple[float, float, tuple[Verified, ...]]
"""Shortfall, value, and exact ζ of each goal where ζ is the criterion."""


def _judged(verifier: Verifier, setup: Setup, aim: Criterion) -> _Judged:
    """Judge one setup."""
    if not aim.plain:
        return *judge(verifier, setup, aim), ()
    verified = verifier.verify_goals(setup)
    return *verifier.judged(verified), verified


def _judge_all(
    verifier: Verifier, setups: Sequence[Setup], aim: Criterion, brake: StopToken
) -> list[_Judged]:
    """Judge the setups in order: all of them, or after Ctrl-C at least one."""
    judged: list[_Judged] = []
    for setup in setups:
        try:
            judged.append(_judged(verifier, setup, aim))
        except KeyboardInterrupt:
            brake.pulled.set()
            return judged or [_judged(verifier, setup, aim)]
    return judged
