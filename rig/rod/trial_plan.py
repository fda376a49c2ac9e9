"""Trial points of the test rod: random points at each pose on both sides of the edge of coverage,
half of them predicted seen and half unseen.

The points are centres of the target's voxels at which the rod can stand. They form strata by pose,
prediction, and nearness to the edge of coverage: the places of the other prediction. As many are
drawn of one prediction as of the other, so that both kinds of error are equally likely to be
detected, and a quarter or more near the edge. A stratum's weight is its share of the target, from
which the share for the whole target follows.

If the target has too few points of a prediction, more are drawn beyond it, near the edge of
coverage there, on both of its sides: strata of weight 0. They show whether the edge is where it
should be.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from jaxtyping import Bool, Float, Int
from pydantic import Field

from ...coverage.definitions.definition import definition, refuse
from ...coverage.definitions.field_types import LONGEST_NAME, Items, Metres, Triple
from ...coverage.definitions.units import Covered, Decimals
from ...coverage.rings.ring import Setup
from ...coverage.targets.named import named_target
from ...coverage.targets.target import Target, key_text, named_kinds
from ...coverage.voxels.octree import voxels
from ...coverage.weight_field import WeightField
from ...formats.schema.versions import Versioned
from ...objectives.scene import Scene
from ..poses.planned_pose import Poses, planned_poses, require_alike
from .coverage_edge import Predicted, near_edge, places_beyond
from .rod import Rod, RodCriterion, placeable, seen

TRIALS = 120
VOXEL = 0.05  # m
_LEAST = 2  # minimum of points drawn from a stratum, if it has as many
_NEAR = 0.25  # least share of the trials of a prediction near the edge, and away from it
_SPLIT = 8  # trials of a prediction at a pose, from which those near the edge are a stratum


@definition
class Stratum:
    """Points of a pose with the same prediction."""

    pose: Annotated[int, Field(ge=0, le=100_000)]
    """Number of the pose."""
    covered: bool
    """Whether the rod is predicted to be seen."""
    weight: Annotated[float, Field(ge=0, le=1)]
    """Share of the target over all poses."""
    points: Annotated[int, Field(ge=1, le=100_000)]
    """Number of points."""
    edge: bool = False
    """Whether its points are near the edge of coverage. With weight 0 they are beyond the target.
    """


@definition
class Trial:
    """A point at which the rod is placed."""

    stratum: Annotated[int, Field(ge=0, le=100_000)]
    """Number of its stratum."""
    point: Triple[Annotated[float, Decimals(6, ge=-100, le=100)]]
    """The rod's centre in the base frame, m."""


@definition
class RodPlan:
    """Plan of T trials at P poses: the rod is placed upright, with its centre at each point."""

    target: Annotated[str, Field(max_length=2 * LONGEST_NAME)]
    """Name of the target."""
    target_radius: Metres | None
    """Radius of a target that has one, m."""
    testable: Annotated[float, Covered("testable_percent")]
    """Share of the target in which the rod can stand; all results refer to this part."""
    rod: Rod
    """The rod."""
    detection: RodCriterion
    """When a sensor detects the rod."""
    poses: Poses
    """Poses of the scene."""
    strata: Annotated[Items[Stratum], Field(min_length=1, max_length=20_000)]
    """Strata of the points."""
    trials: Annotated[Items[Trial], Field(min_length=1, max_length=100_000)]
    """The trials in order."""

    def __post_init__(self) -> None:
        try:
            if self.target in named_kinds():
                named_target(self.target, self.target_radius)
        except ValueError as error:
            refuse([(("target_radius",), self.target_radius, f"another: {error}")])
        require_alike("poses", self.poses)
        poses, strata = len(self.poses), len(self.strata)
        refuse(
            (("strata", i, "pose"), s.pose, f"0 to {poses - 1}")
            for i, s in enumerate(self.strata)
            if s.pose >= poses
        )
        refuse(
            (("trials", i, "stratum"), t.stratum, f"0 to {strata - 1}")
            for i, t in enumerate(self.trials)
            if t.stratum >= strata
        )

    @property
    def named(self) -> str:
        """The target."""
        return key_text(self.target, self.target_radius)

    @cached_property
    def joints(self) -> Float[np.ndarray, "P J"]:
        """Joint angles of the poses, rad."""
        return np.array([pose.q for pose in self.poses])

    @cached_property
    def point(self) -> Float[np.ndarray, "T 3"]:
        """Point of each trial in the base frame, m."""
        return np.array([trial.point for trial in self.trials])

    @cached_property
    def stratum(self) -> Int[np.ndarray, " T"]:
        """Stratum of each trial."""
        return np.array([trial.stratum for trial in self.trials])

    def _of_strata(self, key: str) -> np.ndarray:
        """Return what the stratum of each trial states (T,)."""
        stated: np.ndarray = np.array([getattr(stratum, key) for stratum in self.strata])
        return np.asarray(stated[self.stratum])

    @property
    def pose(self) -> Int[np.ndarray, " T"]:
        """Pose of each trial."""
        return self._of_strata("pose")

    @property
    def covered(self) -> Bool[np.ndarray, " T"]:
        """Whether each trial is predicted to be seen."""
        return self._of_strata("covered")

    @property
    def edge(self) -> Bool[np.ndarray, " T"]:
        """Which trials are near the edge of coverage."""
        return self._of_strata("edge")

    @property
    def beyond(self) -> Bool[np.ndarray, " T"]:
        """Which trials are beyond the target."""
        beyond: np.ndarray = self._of_strata("weight") == 0
        return beyond

    @property
    def zeta(self) -> float:
        """Share of the target in which the rod is predicted to be seen."""
        return float(sum(s.weight for s in self.strata if s.covered))


@dataclass(frozen=True)
class Places:
    """Points at which the rod can stand."""

    points: tuple[Float[np.ndarray, "_ 3"], ...]
    """Points of each pose, m."""
    weights: Float[np.ndarray, " P"]
    """Weight of each pose; the weights sum to 1."""
    testable: float
    """Share of the target in which the rod can stand."""


def places(scene: Scene, target: Target, rod: Rod, voxel: float = VOXEL) -> Places:
    """Return where in ``target`` the rod can stand, at each pose of ``scene``.

    Raises:
        ValueError: if there is no such point at a pose.
    """
    points, share = [], []
    for i, pose in enumerate(scene.poses):
        centres = voxels(scene.solid(target, i), voxel).centres()
        if target.importance is not None:
            centres = _repeated(centres, target.importance)
        good = centres[placeable(scene, pose.q, centres, rod)]
        if not len(good):
            raise ValueError(
                f"target {target} has no place at pose {i} where a rod of {rod.length:g} m can"
                " stand"
            )
        points.append(good)
        share.append(len(good) / len(centres))
    return Places(tuple(points), scene.pose_weights, float(scene.pose_weights @ np.array(share)))


def _repeated(points: Float[np.ndarray, "N 3"], weights: WeightField) -> Float[np.ndarray, "N 3"]:
    """Return as many points, each about as often as its weight says: by systematic sampling."""
    level = weights.levels_at(points)
    if not level.any():
        return points[:0]
    edges = np.cumsum(level) / level.sum()
    chosen = np.searchsorted(edges, (np.arange(len(points)) + 0.5) / len(points))
    return points[np.minimum(chosen, len(points) - 1)]


def rod_zeta(
    scene: Scene,
    setup: Setup,
    where: Places,
    rod: Rod,
    detection: RodCriterion,
    alive: Bool[np.ndarray, " K"] | None = None,
) -> float:
    """Return the share of the target in which the rod is seen, by testing each of its voxels."""
    shares = [
        seen(scene, setup, pose.q, points, rod, detection, alive).mean()
        for pose, points in zip(scene.poses, where.points, strict=True)
    ]
    return float(where.weights @ np.array(shares))


def plan_rod(
    scene: Scene,
    setup: Setup,
    target: Target,
    trials: int = TRIALS,
    rod: Rod | None = None,
    seed: int = 0,
    where: Places | None = None,
) -> RodPlan:
    """Draw the trials of a coverage check.

    Args:
        scene: robot, poses, cell.
        setup: as proposed, or as built.
        target: in which points are drawn.
        trials: number of trials over all poses.
        rod: the rod.
        seed: of the draws.
        where: points at which the rod can stand, if known.

    Raises:
        ValueError: for no trials, or a target without a place for the rod.
    """
    if trials < 1:
        raise ValueError(f"trials must be at least 1, got {trials}")
    rod, detection = rod or Rod(), RodCriterion()
    where, rng = where or places(scene, target, rod), np.random.default_rng(seed)
    strata, drawn = list[Stratum](), list[Trial]()
    for i, points in enumerate(where.points):
        q, weight = scene.poses[i].q, float(where.weights[i])

        def sees(centres: Float[np.ndarray, "N 3"], q: np.ndarray = q) -> Bool[np.ndarray, " N"]:
            return seen(scene, setup, q, centres, rod, detection)

        half, covered = max(round(trials * weight / 2), _LEAST), sees(points)
        more = np.zeros((0, 3)), np.zeros(0, bool)
        if (lack := half - min(covered.sum(), (~covered).sum())) > 0:
            more = places_beyond(scene, target, i, points, covered, rod, sees, int(lack))
        for s, centres, wanted in _strata(i, weight, (points, covered), more, half):
            chosen = centres[rng.choice(len(centres), wanted, replace=False)]
            drawn += [Trial(len(strata), tuple(point)) for point in chosen.tolist()]
            strata.append(s)
    # pose by pose, and randomly within a pose: who places the rod cannot guess the prediction
    pose = np.array([strata[trial.stratum].pose for trial in drawn])
    order = np.lexsort((rng.random(len(drawn)), pose))
    return RodPlan(
        *target.key,
        testable=where.testable,
        rod=rod,
        detection=detection,
        poses=planned_poses(np.array([p.q for p in scene.poses])),
        strata=tuple(strata),
        trials=tuple(drawn[i] for i in order),
    )


RodPlanFile = Annotated[RodPlan, Versioned()]


def _strata(
    pose: int, weight: float, target: Predicted, more: Predicted, half: int
) -> Iterator[tuple[Stratum, Float[np.ndarray, "N 3"], int]]:
    """Yield the strata of a pose, with their points and the number of points to draw.

    Args:
        pose: number of the pose.
        weight: its weight.
        target: points in the target, and which are predicted seen.
        more: the same beyond the target.
        half: points to draw of each prediction; more of one if there are too few of the other.
    """
    points, predicted = target
    edge = near_edge(*(np.concatenate(each) for each in zip(target, more, strict=True)))
    edge, edge_beyond = edge[: len(points)], edge[len(points) :]
    inside = {covered: int((predicted == covered).sum()) for covered in (True, False)}
    beyond = {covered: edge_beyond & (more[1] == covered) for covered in (True, False)}
    wanted = {c: min(half, inside[c] + int(beyond[c].sum())) for c in inside}
    for covered, count in inside.items():
        left = max(2 * half - sum(wanted.values()), 0)
        most = min(count, wanted[covered] + left)
        wanted[covered] = max(wanted[covered], most)
        near, far = (np.flatnonzero((predicted == covered) & (edge == e)) for e in (True, False))
        others = more[0][beyond[covered]]
        if not len(near) and most >= _SPLIT:  # the edge of coverage is beyond the target
            most -= min(round(_NEAR * most), len(others))
        if len(near) and len(far) and most >= _SPLIT:
            share = min(max(len(near) / (len(near) + len(far)), _NEAR), 1 - _NEAR)
            first = min(len(near), max(round(share * most), most - len(far)))
            parts = [(near, first, True), (far, most - first, False)]
        else:
            parts = [(np.flatnonzero(predicted == covered), most, not len(far))]
        for which, number, at_edge in parts:
            share = weight * len(which) / len(points)
            if len(which):
                yield Stratum(pose, covered, share, len(which), at_edge), points[which], number
        if (lack := min(wanted[covered] - most, len(others))) > 0:
            yield Stratum(pose, covered, 0.0, len(others), True), others, lack
