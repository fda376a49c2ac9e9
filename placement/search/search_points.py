"""Sample points of a search with what is computed from them once: the objective and the fields of
the exchange."""

from functools import cached_property

from ...objectives.criterion import Criterion
from ...objectives.pose_subset import poses_at_once
from ...objectives.scene import CoreScene
from ...objectives.soft_objective import CoverageObjective
from ...objectives.target_points import TargetPoints
from .design import Space
from .exchange_points import ACTIVE, Fields, active_poses
from .schedule import Schedule

_LEAST = 256  # fewest points of a goal at a pose in a stage of local search
_SPARSE = 8  # fewest points of a goal at a pose at all
# points of all goals, poses and mountings up to which each has ``_LEAST`` of them: with thousands
# of poses they would fill the memory
_MANY = 1 << 19


class SearchPoints:
    """Points, objective and occluders of a search.

    They depend on the scene, the criterion, the seed, and the links, radii and sensors of a space.
    Searches that differ only in the number of rings can share them, with the compiled objective.
    """

    def __init__(
        self, scene: CoreScene, space: Space, aim: Criterion, schedule: Schedule, seed: int
    ) -> None:
        """Draw the points that a schedule needs.

        Raises:
            ValueError: for an empty target, or floors of goals that the criterion does not support.
        """
        self._space, self._aim, goals = space, aim, len(scene.goals) * aim.mountings
        poses = ACTIVE if active_poses(scene) else len(scene.poses)
        exchanged = [r.points // (goals * poses) for r in schedule.rounds]
        terms = goals * len(scene.poses)
        least = min(_LEAST, max(_SPARSE, _MANY // terms))
        most = max([least, *self.sizes(scene, aim, schedule), *exchanged])
        self.points = TargetPoints(scene, most, seed, aim.mountings)
        self.objective = CoverageObjective(scene, self.points, aim)

    @staticmethod
    def at_once(scene: CoreScene, aim: Criterion, schedule: Schedule) -> list[int]:
        """Return the number of poses that each stage of a schedule uses."""
        goals = len(scene.goals) * aim.mountings
        return [poses_at_once(stage.points, goals, len(scene.poses)) for stage in schedule.stages]

    @staticmethod
    def sizes(scene: CoreScene, aim: Criterion, schedule: Schedule) -> list[int]:
        """Return the points of each goal at each pose in each stage of a schedule."""
        goals, poses = len(scene.goals) * aim.mountings, SearchPoints.at_once(scene, aim, schedule)
        return [
            max(_LEAST, stage.points // (goals * n))
            for stage, n in zip(schedule.stages, poses, strict=True)
        ]

    @cached_property
    def fields(self) -> Fields:
        """The points in mount coordinates, with the occluders."""
        return Fields(self._space, self.points, self._aim)
