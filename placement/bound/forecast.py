"""Whether an upper bound will say nothing, known in seconds."""

import numpy as np
from jaxtyping import Float

from ...objectives.criterion import Criterion
from ...objectives.scene import Scene
from ..space.design import Space
from .pose_bounds import AtPose, Effort
from .upper_bound import BoundsBySensors

_EFFORT = Effort(points=400, steps=24, voxels=60_000)
_MOST = 16  # pairs of target and pose; beyond, nothing is known in seconds
_NEAR = 0.005  # below the wanted coverage: the margins of a bound are larger


def says_nothing(scene: Scene, space: Space, aim: Criterion, wanted: float = 1.0) -> bool:
    """Return whether the upper bound of a design space will not be below a coverage.

    Layouts that are used in fractions on a coarse lattice of prices cover that much. No prices on
    this lattice then have a lower bound, and finer ones have one that is hardly lower.

    Args:
        scene: robot, poses, targets, rules.
        space: the setups.
        aim: criterion of the search.
        wanted: the coverage, in [0, 1].

    Raises:
        ValueError: for an empty target.
    """
    weights = np.outer(scene.goal_weights, scene.pose_weights)
    if weights.size > _MOST:
        return False
    poses = [AtPose(scene, space, p, aim.seen) for p in range(weights.shape[1])]
    each = np.ones((*weights.shape, 1))
    for g, p in np.ndindex(*weights.shape):
        each[g, p] = poses[p].bounds(g, _EFFORT, priced=False)[0][-1]
    for i in np.argsort(-weights, axis=None, kind="stable")[: _EFFORT.terms]:
        if not _reaches(scene, each, wanted):
            break
        g, p = (int(k) for k in np.unravel_index(i, weights.shape))
        each[g, p] = min(each[g, p, 0], poses[p].covered(g, _EFFORT, 1.0 - _NEAR))
    return _reaches(scene, each, wanted)


def _reaches(scene: Scene, each: Float[np.ndarray, "G P 1"], wanted: float) -> bool:
    return bool(BoundsBySensors(scene, each, np.ones_like(each)).total[0] >= wanted - _NEAR)
