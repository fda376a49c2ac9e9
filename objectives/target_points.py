"""Points drawn in the targets of a scene, on which a search evaluates setups."""

import numpy as np

from .gap_goals import gap_points, without_gaps
from .scene import Scene


class TargetPoints:
    """Points of every goal at every pose of a scene, drawn once: targets do not depend on rings."""

    def __init__(
        self, scene: Scene, count: int, seed: int, mountings: int = 1, gaps: bool = False
    ) -> None:
        """Draw ``count`` points in each goal at each pose, separately for each mounting.

        The Monte Carlo error then averages out over the mountings, so fewer points suffice.

        Args:
            scene: the scene.
            count: number of points of a goal at a pose.
            seed: random seed.
            mountings: number of mountings.
            gaps: whether the goals with a largest gap are those of ``with_gap_goals``.

        Raises:
            ValueError: if a target is empty.
        """
        self.mountings = mountings
        self.scene = scene = scene if gaps else without_gaps(scene)
        """The scene; goals that state a largest gap are those of ``with_gap_goals``."""
        self.terms = [
            (g, p)
            for _ in range(mountings)
            for g in range(len(scene.targets))
            for p in range(len(scene.poses))
        ]
        seeds = np.random.SeedSequence(seed).generate_state(len(self.terms))
        drawn = [
            gap_points(scene, goal, p, count, int(s))
            if goal.largest_gap is not None
            else (scene.sample(goal.target, p, count, int(s)), 0.0)
            for goal, p, s in (
                (scene.targets[g], p, s) for (g, p), s in zip(self.terms, seeds, strict=True)
            )
        ]
        self.points = [points for points, _ in drawn]
        self.radius = [radius for _, radius in drawn]
        """Radius of the ball about each point of a term that a beam is to meet, m; 0: the point
        itself is to be seen; infinity: nothing is to be met."""
