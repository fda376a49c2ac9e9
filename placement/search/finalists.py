"""Which of the climbs that came furthest is best: the exact count chooses, and counts the chosen
one as was asked.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...coverage.rings.ring import Setup
from ...objectives.criterion import Criterion, judge
from ...objectives.pose_subset import MANY, representative
from ...objectives.scene import Scene
from ...objectives.verify import Verified, Verifier
from .local_search import StopToken

# Of more than ``MANY`` poses the finalists are compared roughly, and the chosen one is then counted
# as asked.
# m, side of the voxels, and poses that stand for all (all, where the worst one counts)
COARSE, ROUGH = 0.03, 64


@dataclass(frozen=True)
class Chosen:
    """Which of the finalists is best; by how much it falls short of floors, and its value, both in
    [0, 1]; the side of the voxels counted, m; and, at many poses, zeta goal by goal where it is
    what is aimed at."""

    index: int
    short: float
    exact: float
    voxel: float
    verified: tuple[Verified, ...] = ()


def choose(
    verifier: Verifier,
    setups: Sequence[Setup],
    aim: Criterion,
    brake: StopToken,
    luck: np.random.Generator,
    tell: Callable[[int, int], None] = lambda counted, to_count: None,
) -> Chosen:
    """The best of the setups by the exact count; of many poses, compared on coarser voxels at some
    of them first.

    Args:
        verifier: counts the answer; its ``at`` is taken for the progress.
        setups: the finalists, the best guess first.
        aim: what is made large.
        brake: is pulled by Ctrl-C, which cuts the count short; there is always an answer.
        luck: draws the poses that stand for all.
        tell: is given the targets at poses counted, and of how many, before each.

    Raises:
        ValueError: for an empty target.
    """
    scene, asked = verifier.scene, verifier.voxel or COARSE
    many = len(scene.poses) > MANY
    some = _some(scene, luck) if many and scene.over_poses == "mean" else scene
    total = len(scene.goals) * (len(some.poses) * len(setups) + len(scene.poses) * many)
    counted = 0

    def at(_: int) -> None:
        nonlocal counted
        tell(counted, total)
        counted += 1

    verifier.at = at
    rough = Verifier(some, max(asked, COARSE), at=at) if many else verifier
    judged = _judge(rough, setups, aim, brake)
    index = min(range(len(judged)), key=lambda i: (judged[i][0], -judged[i][1]))
    found = Chosen(index, *judged[index], rough.voxel or COARSE)
    try:
        if many and not brake.pulled.is_set() and not aim.plain:
            found = Chosen(index, *judge(verifier, setups[index], aim), asked)
        elif many and not brake.pulled.is_set():
            verified = tuple(verifier.verify(setups[index], goal.target) for goal in scene.goals)
            found = Chosen(index, *verifier.judged(verified), asked, verified)
    except KeyboardInterrupt:
        brake.pulled.set()
    finally:
        verifier.at = lambda _: None
    return found


def _some(scene: Scene, luck: np.random.Generator) -> Scene:
    """The scene with few poses that stand for all."""
    weights = representative(scene.pose_weights, ROUGH, luck)
    poses = (
        replace(p, weight=float(w)) for p, w in zip(scene.poses, weights, strict=True) if w > 0
    )
    return replace(scene, poses=tuple(poses))


def _judge(
    verifier: Verifier, setups: Sequence[Setup], aim: Criterion, brake: StopToken
) -> list[tuple[float, float]]:
    """The verifier's judgements of the first setups: of all, unless Ctrl-C comes; of one at
    least.
    """
    found: list[tuple[float, float]] = []
    for setup in setups:
        try:
            found.append(judge(verifier, setup, aim))
        except KeyboardInterrupt:
            brake.pulled.set()
            return found or [judge(verifier, setup, aim)]
    return found
