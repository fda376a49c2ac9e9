"""Quick estimate of ζ from fixed sample points, ring by ring.

What a ring covers does not depend on other rings. Its verdicts on the sample points of a target are
cached, and a setup is the sum over its rings. A slider that moves one ring of seven therefore costs
a seventh. Nothing is compiled.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from ..coverage.occlusion.occluders import Occluders, beams
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Group, Setup, setup_of_group
from ..coverage.rings.ring_kinematics import sensor_cones
from ..coverage.solids.base import Parts
from ..coverage.solids.beams import Beams
from ..coverage.targets.target import Target
from ..objectives.occlusion import occluders, sight
from ..objectives.pose_subset import representative
from ..objectives.scene import Scene

POINTS = 32_768  # sample points of a target, over all poses
SHOWN = 5_000  # points drawn for a target at one pose
_FEWEST = 256  # fewest sample points of a target at a pose
_POSES = 64  # largest number of representative poses
_KEPT = 128e6  # bytes of cached verdicts
UNSEEN, SHADOWED, ONCE, TWICE = range(4)


@dataclass(frozen=True)
class PointVerdict:
    """Coverage of N points."""

    held: Int[np.ndarray, " N"]
    seen: Int[np.ndarray, " N"]

    @property
    def kind(self) -> Int[np.ndarray, " N"]:
        """Class of each point (N,).

        UNSEEN: in no beam. SHADOWED: in a beam, but occluded. ONCE, TWICE: covered by one sensor,
        by more.
        """
        kind: np.ndarray = np.where(
            self.seen > 0, np.minimum(self.seen, 2) + 1, np.minimum(self.held, 1)
        )
        return kind

    @property
    def zeta(self) -> float:
        """Share of covered points."""
        return float(np.mean(self.seen > 0))


class QuickEstimate:
    """Estimated coverage of a scene's targets, pose by pose; safe for use from many threads."""

    def __init__(
        self, scene: Scene, targets: Sequence[Target], points: int = POINTS, seed: int = 0
    ) -> None:
        """Choose representative poses if the scene has many.

        Args:
            scene: robot, poses, occlusion.
            targets: targets to sample.
            points: number of sample points of each target.
            seed: random seed of the points.
        """
        self.scene, self.targets, self.seed = scene, tuple(targets), seed
        self.weights = representative(scene.pose_weights, _POSES, np.random.default_rng(seed))
        self.few = int(np.count_nonzero(self.weights))  # representative poses
        self.each: int = max(points // self.few, _FEWEST)
        self.points = lru_cache(len(targets) * _POSES)(self._points)
        self.beams = lru_cache(2048)(self._beams_of)
        self._of_ring = lru_cache(int(_KEPT / (4 * max(self.each, SHOWN))))(self._verdict)

    def _points(self, target: Target, pose: int, count: int) -> Float[np.ndarray, "N 3"]:
        """Return ``count`` points (N, 3) m spread evenly in ``target`` at a pose.

        A smaller count gives the first of the same points.

        Raises:
            EmptySolidError: if the target is empty.
        """
        return self.scene.sample(target, pose, count, self.seed)

    def _beams_of(self, ring: Group, pose: int, occlusion: Occlusion) -> tuple[Beams, Parts]:
        """Return the cones of a ring at a pose, and their visible parts; the cones themselves if
        nothing can occlude them.
        """
        q = self.scene.poses[pose].q
        cones = sensor_cones(self.scene.robot, setup_of_group(ring), q)
        return cones, sight(replace(self.scene, occlusion=occlusion), cones, q)

    def _verdict(
        self, ring: Group, target: Target, pose: int, occlusion: Occlusion, count: int
    ) -> PointVerdict:
        points = self.points(target, pose, count)
        cones, seen = self.beams(ring, pose, occlusion)
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
        """Return the coverage of the first ``count`` sample points of a target at a pose.

        Args:
            setup: setup to evaluate.
            target: one of the targets.
            pose: index of the pose.
            occlusion: model of occlusion.
            count: number of points.

        Raises:
            BodilessError: if the model needs bodies and the robot has none.
        """
        groups = self.scene.with_cell(setup).groups
        each = [self._of_ring(group, target, pose, occlusion, count) for group in groups]
        none = np.zeros(count, np.int16)
        return PointVerdict(sum((v.held for v in each), none), sum((v.seen for v in each), none))

    def zeta(
        self, setup: Setup, target: Target, occlusion: Occlusion, count: int | None = None
    ) -> float:
        """Return the estimate of ζ in [0, 1]: the covered share of the points, a weighted mean over
        poses.

        Args:
            setup: setup to evaluate.
            target: one of the targets.
            occlusion: model of occlusion.
            count: number of points at each pose; None for all.

        Raises:
            BodilessError: see ``verdict``.
        """
        shares = self.shares(setup, target, occlusion, count)
        return float(sum(self.weights[p] * share for p, share in shares.items()))

    def shares(
        self, setup: Setup, target: Target, occlusion: Occlusion, count: int | None = None
    ) -> dict[int, float]:
        """Return the covered share in [0, 1] at each representative pose, by the pose's index.

        Args:
            setup: setup to evaluate.
            target: one of the targets.
            occlusion: model of occlusion.
            count: number of points; None for all.

        Raises:
            BodilessError: see ``verdict``.
        """
        return {
            int(p): self.verdict(setup, target, int(p), occlusion, count or self.each).zeta
            for p in np.flatnonzero(self.weights)
        }


REPORTED = 20_000  # sample points of the target


@dataclass(frozen=True)
class SensorReport:
    """One sensor at one pose; shares are of the target's volume."""

    group: int
    """Index of its ring, or of itself if it is a single sensor."""
    sensor: int
    """Index on its ring."""
    covered: float
    """Share that it covers."""
    alone: float
    """Share that no other sensor covers."""
    blocked: float
    """Share that lies in its cone, but is occluded."""
    blockers: tuple[tuple[str, float], ...]
    """Names of the bodies and obstacles that occlude it, and the share behind each; most first."""


def sensor_report(
    glance: QuickEstimate,
    setup: Setup,
    target: Target,
    pose: int,
    occlusion: Occlusion,
    group: int,
    sensor: int,
) -> SensorReport:
    """Return the report of one sensor.

    Args:
        glance: estimate of the scene.
        setup: setup with the sensor.
        target: one of the targets.
        pose: index of the pose.
        occlusion: model of occlusion.
        group: index of the ring or single sensor.
        sensor: index of the sensor on its ring.

    Raises:
        IndexError: if there is no such sensor.
        BodilessError: see ``QuickEstimate.verdict``.
    """
    if not 0 <= sensor < setup.groups[group].count:
        raise IndexError(f"ring {group} has no sensor {sensor}")
    points = glance.points(target, pose, REPORTED)
    number = glance.verdict(setup, target, pose, occlusion, REPORTED).seen
    cones, seen = glance.beams(setup.groups[group], pose, occlusion)
    held = cones.part(points, sensor) <= 0
    clear = held if seen is cones else held & (seen.part(points, sensor) <= 0)
    hidden = points[held & ~clear]
    blockers = []
    for name, one in _each_occluder(glance, pose, occlusion) if len(hidden) else ():
        part = beams(cones, one, "shadow" if occlusion == "ignore" else occlusion)
        behind = np.count_nonzero(part.part(hidden, sensor) > 0) / len(points)
        if behind:
            blockers.append((name, behind))
    return SensorReport(
        group,
        sensor,
        float(clear.mean()),
        float((clear & (number == 1)).mean()),
        len(hidden) / len(points),
        tuple(sorted(blockers, key=lambda b: -b[1])),
    )


def _each_occluder(
    glance: QuickEstimate, pose: int, occlusion: Occlusion
) -> Iterator[tuple[str, Occluders]]:
    """Yield the name of each body and obstacle, and it as the only occluder."""
    scene = replace(glance.scene, occlusion=occlusion)
    every = occluders(scene, scene.poses[pose].q)
    names = [body.name for body in scene.robot.bodies]
    if every.bodies is not None:
        for i, name in enumerate(names):
            start, end, radius = (a[i : i + 1] for a in every.bodies.arrays())
            yield name, Occluders(type(every.bodies)(start, end, radius))
    others = [o.name for o in scene.obstacles] + [c.name for c in scene.robot.carried]
    for name, body in zip(others, every.obstacles, strict=False):
        yield name, Occluders(None, (body,))


def nearest_sensor(
    apexes: Float[np.ndarray, "K 3"],
    origin: Float[np.ndarray, " 3"],
    direction: Float[np.ndarray, " 3"],
) -> int:
    """Return the index of the sensor that a ray hits, or passes most closely.

    Of sensors that are equally close to the ray, the one nearer to its origin counts.

    Args:
        apexes: places (K, 3) m of the sensors.
        origin: start of the ray, m.
        direction: unit direction of the ray.
    """
    away = apexes - origin
    along = away @ direction
    across = np.linalg.norm(away - along[:, None] * direction, axis=1)
    reached = across <= across.min() + _CHIP
    return int(np.argmin(np.where(reached, along, np.inf)))


_CHIP = 0.012  # m, half the edge of a drawn sensor
