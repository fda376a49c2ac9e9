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
from ..stop_token import StopToken

# With more than ``MANY`` poses, setups are compared at some of them, and the chosen one is counted
# at all: where the mean counts, at ROUGH representative poses on voxels of side COARSE, m; where
# the worst pose counts, at the _LOWEST poses that are worst for the best setup so far.
COARSE, ROUGH, _LOWEST = 0.03, 64, 8


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

    With many poses, the setups are compared at some of them, and the chosen one is counted at all.

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
    scene, rivals = verifier.scene, len(setups) - 1
    some = scene
    if roughly := len(scene.poses) > MANY and rivals > 0 and scene.over_poses == "mean":
        some = _some(scene, luck)
    poses = len(scene.poses) + roughly * len(some.poses)
    poses += rivals * (_LOWEST if some.over_poses == "worst" else len(some.poses))
    counted = 0

    def at(_: int) -> None:
        nonlocal counted
        tell(counted, max(len(scene.goals) * poses, counted + 1))
        counted += 1

    verifier.at = at
    try:
        if len(scene.poses) <= MANY:
            return _best(verifier, setups, aim, brake)
        if roughly:
            return _roughly_first(verifier, some, setups, aim, brake)
        return _in_turn(verifier, setups, aim, brake)
    finally:
        verifier.at = lambda _: None


def _best(verifier: Verifier, setups: Sequence[Setup], aim: Criterion, brake: StopToken) -> Chosen:
    """Return the best setup: of all, or after Ctrl-C of those judged so far, at least of one."""
    found = list[Chosen]()
    for i, setup in enumerate(setups):
        try:
            found.append(_judged(verifier, setup, aim, i))
        except KeyboardInterrupt:
            brake.pulled.set()
            found = found or [_judged(verifier, setup, aim, i)]
            break
    return min(found, key=_rank)


def _roughly_first(
    verifier: Verifier, some: CoreScene, setups: Sequence[Setup], aim: Criterion, brake: StopToken
) -> Chosen:
    """Return the best of the setups by rough counts in the scene ``some``, counted at all poses
    unless Ctrl-C came."""
    best = replace(_best(_rough(verifier, some), setups, aim, brake), verified=())
    try:
        if not brake.pulled.is_set():
            return _judged(verifier, setups[best.index], aim, best.index)
    except KeyboardInterrupt:
        brake.pulled.set()
    return best


def _in_turn(
    verifier: Verifier, setups: Sequence[Setup], aim: Criterion, brake: StopToken
) -> Chosen:
    """Return the setup with the best worst pose, or the only one.

    The first, the most promising, is counted at all poses; a later one only where it is better at
    those poses that are worst for the best so far. After Ctrl-C the first is counted roughly.
    """
    scene, best = verifier.scene, None
    try:
        for i, setup in enumerate(setups if not brake.pulled.is_set() else ()):
            if best is not None and best.short == 0:
                lowest = _lowest(scene, best.verified)
                hard = Verifier(lowest, verifier.voxel, verifier.rule, at=verifier.at)
                if _judged(hard, setup, aim, i).exact <= best.exact:
                    continue
            judged = _judged(verifier, setup, aim, i)
            best = judged if best is None else min(best, judged, key=_rank)
    except KeyboardInterrupt:
        brake.pulled.set()
    return best or replace(_judged(_rough(verifier, scene), setups[0], aim, 0), verified=())


def _some(scene: CoreScene, luck: np.random.Generator) -> CoreScene:
    """Return the scene with a representative subset of its poses."""
    weights = representative(scene.pose_weights, ROUGH, luck)
    poses = (
        replace(p, weight=float(w)) for p, w in zip(scene.poses, weights, strict=True) if w > 0
    )
    return replace(scene, poses=tuple(poses))


def _lowest(scene: CoreScene, verified: Sequence[Verified]) -> CoreScene:
    """Return the scene with the poses that are worst for a setup with these counts."""
    zeta = np.array([[p.zeta for p in v.poses] for v in verified])  # (G, P)
    poses = np.argsort(scene.goal_weights @ zeta)[:_LOWEST]
    return replace(scene, poses=tuple(scene.poses[i] for i in poses.tolist()))


def _rough(verifier: Verifier, scene: CoreScene) -> Verifier:
    """Return a verifier of coarse voxels that reports its progress as ``verifier`` does."""
    return Verifier(scene, max(verifier.voxel or COARSE, COARSE), at=verifier.at)


def _rank(one: Chosen) -> tuple[float, float]:
    """Return a key by which better setups come first."""
    return one.short, -one.exact


def _judged(verifier: Verifier, setup: Setup, aim: Criterion, index: int) -> Chosen:
    """Return the exact count of one setup, the finalist of this index."""
    voxel = verifier.voxel or COARSE
    if not aim.plain:
        return Chosen(index, *judge(verifier, setup, aim), voxel)
    verified = verifier.verify_goals(setup)
    return Chosen(index, *verifier.judged(verified), voxel, verified)
