"""Choice among the finalists of a search by the exact count."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...coverage.rings.ring import Setup
from ...objectives.criterion import judge
from ...objectives.pose_subset import MANY, representative
from ...objectives.scene import Scene
from ...objectives.smallest_object import gap_excess
from ...objectives.verified import Verified
from ...objectives.verify import Verifier
from .context import SearchContext

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
    excess: float = 0.0
    """Sum by which spheres that no sensor sees exceed the largest gaps, as a share of each."""
    verified: tuple[Verified, ...] = ()
    """Exact ζ of each goal, where ζ is the criterion and its count was not rough."""

    @property
    def missed(self) -> float:
        """What the goals' floors and largest gaps lack, in sum of shares."""
        return self.short + self.excess


def choose(
    setups: Sequence[Setup],
    context: SearchContext,
    luck: np.random.Generator,
    tell: Callable[[int, int], None] = lambda counted, to_count: None,
) -> Chosen:
    """Return the setup with the best exact count.

    With many poses, the setups are compared at some of them, and the chosen one is counted at all.

    Args:
        setups: the finalists, the most promising first.
        context: has the criterion, the verifier, whose ``at`` is replaced to report progress, and
            the brake that Ctrl-C sets: it cuts the count short, but there is always an answer.
        luck: random generator that draws the representative poses.
        tell: receives the number of pairs of target and pose counted so far and in total, before
            each.

    Raises:
        ValueError: for an empty target.
    """
    scene, verifier, rivals = context.scene, context.verifier, len(setups) - 1
    some = scene
    if roughly := len(scene.poses) > MANY and rivals > 0 and scene.over_poses == "mean":
        some = _some(scene, luck)
    poses = len(scene.poses) + roughly * len(some.poses)
    poses += rivals * (_LOWEST if some.over_poses == "worst" else len(some.poses))
    counted = 0

    def at(_: int) -> None:
        nonlocal counted
        tell(counted, max(len(scene.targets) * poses, counted + 1))
        counted += 1

    verifier.at = at
    try:
        if len(scene.poses) <= MANY:
            return _best(setups, context)
        if roughly:
            return _roughly_first(some, setups, context)
        return _in_turn(setups, context)
    finally:
        verifier.at = lambda _: None


def _best(setups: Sequence[Setup], context: SearchContext) -> Chosen:
    """Return the best setup: of all, or after Ctrl-C of those judged so far, at least of one."""
    judged = list[Chosen]()
    for i in range(len(setups)):
        try:
            judged.append(_judged(setups, i, context))
        except KeyboardInterrupt:
            context.brake.pulled.set()
            judged = judged or [_judged(setups, i, context)]
            break
    return min(judged, key=_rank)


def _roughly_first(some: Scene, setups: Sequence[Setup], context: SearchContext) -> Chosen:
    """Return the best of the setups by rough counts in the scene ``some``, counted at all poses
    unless Ctrl-C came."""
    best = replace(_best(setups, _rough(context, some)), verified=())
    try:
        if not context.brake.pulled.is_set():
            return _judged(setups, best.index, context)
    except KeyboardInterrupt:
        context.brake.pulled.set()
    return best


def _in_turn(setups: Sequence[Setup], context: SearchContext) -> Chosen:
    """Return the setup with the best worst pose, or the only one.

    The first, the most promising, is counted at all poses; a later one only where it is better at
    those poses that are worst for the best so far. After Ctrl-C the first is counted roughly.
    """
    scene, verifier, best = context.scene, context.verifier, None
    try:
        for i in range(len(setups)) if not context.brake.pulled.is_set() else ():
            if best is not None and best.missed == 0:
                lowest = _lowest(scene, best.verified)
                hard = Verifier(lowest, verifier.voxel, verifier.rule, at=verifier.at)
                if judge(hard, setups[i], context.aim)[1] <= best.exact:
                    continue
            judged = _judged(setups, i, context)
            best = judged if best is None else min(best, judged, key=_rank)
    except KeyboardInterrupt:
        context.brake.pulled.set()
    return best or replace(_judged(setups, 0, _rough(context, scene)), verified=())


def _some(scene: Scene, luck: np.random.Generator) -> Scene:
    """Return the scene with a representative subset of its poses."""
    weights = representative(scene.pose_weights, ROUGH, luck)
    poses = (
        replace(p, weight=float(w)) for p, w in zip(scene.poses, weights, strict=True) if w > 0
    )
    return replace(scene, poses=tuple(poses))


def _lowest(scene: Scene, verified: Sequence[Verified]) -> Scene:
    """Return the scene with the poses that are worst for a setup with these counts."""
    zeta = np.array([[p.zeta for p in v.poses] for v in verified])  # (G, P)
    poses = np.argsort(scene.goal_weights @ zeta)[:_LOWEST]
    return replace(scene, poses=tuple(scene.poses[i] for i in poses.tolist()))


def _rough(context: SearchContext, scene: Scene) -> SearchContext:
    """Return the context of a count in coarse voxels, which reports its progress likewise."""
    verifier = context.verifier
    coarse = Verifier(scene, max(verifier.voxel or COARSE, COARSE), at=verifier.at)
    return replace(context, verifier=coarse)


def _rank(one: Chosen) -> tuple[float, float]:
    """Return a key by which better setups come first."""
    return one.missed, -one.exact


def _judged(setups: Sequence[Setup], index: int, context: SearchContext) -> Chosen:
    """Return the exact count of the finalist of this index."""
    verifier, aim, setup = context.verifier, context.aim, setups[index]
    voxel = verifier.voxel or COARSE
    if not aim.plain:
        return Chosen(index, *judge(verifier, setup, aim), voxel)
    verified = verifier.verify_goals(setup)
    excess = gap_excess(verifier.scene, setup)
    return Chosen(index, *verifier.judged(verified), voxel, excess, verified)
