"""Sample points of a search with what is computed from them once: the fields of the exchange."""

from functools import cached_property

from ...objectives.criterion import Criterion, check_criterion
from ...objectives.scene import CoreScene
from ...objectives.target_points import TargetPoints
from .design import Space
from .exchange_points import ACTIVE, Fields, active_poses
from .schedule import Schedule

_LEAST = 256  # fewest points of a goal at a pose
_SPARSE = 8  # fewest points of a goal at a pose where there are very many
# points of all goals, poses and mountings up to which each has ``_LEAST`` of them: with thousands
# of poses they would fill the memory
_MANY = 1 << 19


class SearchPoints:
    """Points and occluders of a search.

    They depend on the scene, the criterion, the seed, and the links, radii and sensors of a space.
    Searches that differ only in the number of rings can share them.
    """

    def __init__(
        self, scene: CoreScene, space: Space, aim: Criterion, schedule: Schedule, seed: int
    ) -> None:
        """Draw the points that a schedule needs.

        Raises:
            ValueError: for an empty target, or floors of goals that the criterion does not support.
        """
        check_criterion(scene, aim)
        self._space, self._aim, goals = space, aim, len(scene.goals) * aim.mountings
        poses = ACTIVE if active_poses(scene) else len(scene.poses)
        terms = goals * len(scene.poses)
        least = min(_LEAST, max(_SPARSE, _MANY // terms))
        most = max([least, *(r.points // (goals * poses) for r in schedule)])
        self.points = TargetPoints(scene, most, seed, aim.mountings)

    @cached_property
    def fields(self) -> Fields:
        """The points in mount coordinates, with the occluders."""
        return Fields(self._space, self.points, self._aim)
