"""ζ at a glance: what each ring sees of points that are drawn once, so that moving one ring asks
for that ring alone.

What a ring sees depends on no other ring. So its verdicts on the fixed points of a target are kept,
and a setup is the sum over its rings: a slider that moves one of seven costs a seventh. Nothing is
compiled.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from ..coverage.occlusion.model import Occlusion
from ..coverage.rings.ring import Ring, Setup
from ..coverage.rings.ring_kinematics import sensor_cones
from ..coverage.soft.sampling import sample
from ..coverage.solids.base import Parts
from ..coverage.solids.cones import Cones
from ..coverage.targets import Target
from ..objectives.occlusion import sight
from ..objectives.pose_subset import representative
from ..objectives.scene import Scene

POINTS = 32_768  # of a target, at all poses together
SHOWN = 5_000  # of a target at one pose, as they are drawn
_FEWEST = 256  # of a target at a pose
_POSES = 64  # that stand for all
_KEPT = 128e6  # bytes of verdicts
UNSEEN, SHADOWED, ONCE, TWICE = range(4)


@dataclass(frozen=True)
class PointVerdict:
    """How many sensors' beams hold each of N points were nothing in the way, and how many see it,
    both (N,).
    """

    held: Int[np.ndarray, " N"]
    seen: Int[np.ndarray, " N"]

    @property
    def kind(self) -> Int[np.ndarray, " N"]:
        """UNSEEN: in no beam. SHADOWED: in some, but something is in the way. ONCE, TWICE: seen by
        one sensor, by more.
        """
        kind: np.ndarray = np.where(
            self.seen > 0, np.minimum(self.seen, 2) + 1, np.minimum(self.held, 1)
        )
        return kind

    @property
    def zeta(self) -> float:
        """The share of the points that are seen."""
        return float(np.mean(self.seen > 0))


class QuickEstimate:
    """The share of points that setups see of a scene's targets, pose by pose; for many threads at
    once.
    """

    def __init__(
        self, scene: Scene, targets: Sequence[Target], points: int = POINTS, seed: int = 0
    ) -> None:
        """Choose the poses that stand for all where they are many. ``points``: of each target;
        ``seed``: of all that is drawn."""
        self.scene, self.targets, self.seed = scene, tuple(targets), seed
        self.weights = representative(scene.pose_weights, _POSES, np.random.default_rng(seed))
        self.few = int(np.count_nonzero(self.weights))  # poses that stand for all
        self.each: int = max(points // self.few, _FEWEST)
        self.points = lru_cache(len(targets) * _POSES)(self._points)
        self._beams = lru_cache(2048)(self._beams_of)
        self._of_ring = lru_cache(int(_KEPT / (4 * max(self.each, SHOWN))))(self._verdict)

    def _points(self, target: Target, pose: int, count: int) -> Float[np.ndarray, "N 3"]:
        """Points (N, 3) m of ``target`` at a pose, even in it; fewer are the first of more.
        EmptySolidError for none.
        """
        return sample(self.scene.solid(target, pose), count, self.seed)

    def _beams_of(self, ring: Ring, pose: int, occlusion: Occlusion) -> tuple[Cones, Parts]:
        q = self.scene.poses[pose].q
        cones = sensor_cones(self.scene.robot, Setup((ring,)), q)
        return cones, sight(replace(self.scene, occlusion=occlusion), cones, q)

    def _verdict(
        self, ring: Ring, target: Target, pose: int, occlusion: Occlusion, count: int
    ) -> PointVerdict:
        points = self.points(target, pose, count)
        cones, seen = self._beams(ring, pose, occlusion)
        held = np.stack([cones.part(points, k) <= 0 for k in range(len(cones))])
        if seen is cones:
            number = held.sum(axis=0, dtype=np.int16)
            return PointVerdict(number, number)
        sensor, point = np.nonzero(held)
        clear = seen.part(points[point], sensor) <= 0
        return PointVerdict(
            held.sum(axis=0, dtype=np.int16),
            np.bincount(point[clear], minlength=len(points)).astype(np.int16),
        )

    def verdict(
        self, setup: Setup, target: Target, pose: int, occlusion: Occlusion, count: int = SHOWN
    ) -> PointVerdict:
        """What a setup's sensors see of the first ``count`` points of a target at a pose, under a
        model of occlusion.

        Raises:
            BodilessError: for a robot without bodies that should shadow or blind its sensors.
        """
        each = [self._of_ring(ring, target, pose, occlusion, count) for ring in setup.rings]
        none = np.zeros(count, np.int16)
        return PointVerdict(sum((v.held for v in each), none), sum((v.seen for v in each), none))

    def zeta(self, setup: Setup, target: Target, occlusion: Occlusion) -> float:
        """About ζ, in [0, 1]: the weighted mean over the poses of the share of the points that are
        seen. BodilessError as for ``verdict``."""
        shares = {
            int(p): self.verdict(setup, target, int(p), occlusion, self.each).zeta
            for p in np.flatnonzero(self.weights)
        }
        return float(sum(self.weights[p] * share for p, share in shares.items()))
