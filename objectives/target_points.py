"""Points drawn in the targets of a scene, on which a search evaluates setups."""

import numpy as np

from .scene import Scene


class TargetPoints:
    """Points of every goal at every pose of a scene, drawn once: targets do not depend on rings."""

    def __init__(self, scene: Scene, count: int, seed: int, mountings: int = 1) -> None:
        """Draw ``count`` points in each goal at each pose, separately for each mounting.

        The Monte Carlo error then averages out over the mountings, so fewer points suffice.

        Raises:
            ValueError: if a target is empty.
        """
        self.mountings = mountings
        self.terms = [
            (g, p)
            for _ in range(mountings)
            for g in range(len(scene.targets))
            for p in range(len(scene.poses))
        ]
        seeds = np.random.SeedSequence(seed).generate_state(len(self.terms))
        self.points = [
            scene.sample(scene.targets[g].target, p, count, int(s))
            for (g, p), s in zip(self.terms, seeds, strict=True)
        ]
