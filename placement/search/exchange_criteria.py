"""The criteria of a search, evaluated by counts of the sensors that see each point of an exchange.

Where one ring is moved, its places differ only at the points where it matters, given how many other
sensors see each point. The criterion of many places follows from the ring's counts there. Where a
worst pose or a worst loss counts, a soft minimum of small ``softness`` takes its place, so that a
ring that improves one of several equally bad ones is not moved in vain.
"""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int, UInt8, UInt16

from ...coverage.arrays import Array
from ...coverage.ring_views.detections import MOST, Detections
from ...coverage.ring_views.ring_views import Views
from ...objectives.criterion import Criterion
from ...objectives.floors import floors, worth
from ...objectives.scene import Scene
from .exchange_points import Field

_NOTHING = 1e-9  # share up to which nothing is lost
_SENSORS = 1 << 16  # more than the largest number of a sensor in its group


@dataclass(frozen=True)
class Tally:
    """What Q groups, at least one, see of N points: the places for rings, then what stays.

    Tallies share the rows of the groups in which they do not differ, and their sums over all groups
    follow from those of the tally before. A change of one ring thus costs the same beside few
    rings and beside many.
    """

    count: tuple[UInt8[np.ndarray, " N"], ...]
    """Number of sensors of each group that see each point, at most the criterion's ``most``."""
    sensor: tuple[UInt16[np.ndarray, " N"], ...] | None
    """Number, in its group, of a sensor that sees the point; None if the criterion needs none."""

    @cached_property
    def total(self) -> Int[np.ndarray, " N"]:
        """Number of sensors that see each point, each group's at most ``most``."""
        total = np.zeros(len(self.count[0]), np.int32)
        for row in self.count:
            total += row
        return total

    def owner(self, index: Int[np.ndarray, " M"], but: int | None = None) -> Int[np.ndarray, " M"]:
        """Return, for points that one sensor sees beside those of group ``but``, the number of that
        sensor: its group's times ``_SENSORS``, and its own."""
        owner = np.zeros(len(index), int)
        for group, count in enumerate(self.count):
            if group != but:
                own = 0 if self.sensor is None else self.sensor[group][index]
                owner += count[index] * (np.int64(group * _SENSORS) + own)
        return owner

    def changed(self, views: Mapping[int, Views]) -> "Tally":
        """Return the tally in which some groups see what they do at the first place of their
        ``views``."""
        count = list(self.count)
        sensor = None if self.sensor is None else list(self.sensor)
        for group, view in views.items():
            count[group] = view.counts[0]
            if sensor is not None and view.sensor is not None:
                sensor[group] = view.sensor[0]
        new = Tally(tuple(count), None if sensor is None else tuple(sensor))
        total = self.total.copy()
        for group in views:
            total += new.count[group]
            total -= self.count[group]
        vars(new)["total"] = total
        return new

    def views(self, group: int, index: Int[np.ndarray, " M"]) -> Views:
        """Return what a group sees of points, as views from one place."""
        sensor = None if self.sensor is None else self.sensor[group][index][None]
        return Views(self.count[group][index][None], sensor)


@dataclass(frozen=True)
class Rest:
    """The points where one ring matters, given all others."""

    index: Int[np.ndarray, " M"]
    """Indices of the points."""
    values: Callable[[Views], Float[np.ndarray, " K"]]
    """Return the criterion for K places of the ring, from what it sees of these points."""


class ExchangeCriterion:
    """A criterion by counts."""

    most = 1
    """Sensors of a ring to count at a point."""
    named = False
    """Whether it needs to know which sensor sees a point."""
    detections: Detections | None = None
    """What is to be detected at the points; None: the sensors that see them are counted."""

    def __init__(self, scene: Scene) -> None:
        """Store the goals and their floors."""
        self.scene = scene

    @abstractmethod
    def value(self, field: Field, tally: Tally, softness: float) -> float:
        """Return the criterion of a setup."""

    @abstractmethod
    def rest(self, field: Field, tally: Tally, ring: int, softness: float) -> Rest:
        """Return the points where ``ring`` matters, and the values of its places."""


def criterion_by_counts(scene: Scene, aim: Criterion) -> ExchangeCriterion:
    """Return a search's criterion by counts."""
    if aim.detection is not None:
        return MeanDetection(scene, Detections(aim.detection))
    if aim.losing:
        return AfterLoss(scene, aim.losing == "sensor")
    if scene.over_poses == "worst":
        return WorstPose(scene)
    return MeanCoverage(scene, aim.seen)


def _worth(zetas: Float[np.ndarray, "*batch G"], scene: Scene) -> Float[Array, "*batch"]:
    """Return the weighted mean of the goals' zetas, less what missed floors cost."""
    return worth(zetas, scene.goal_weights, floors(scene))


def soft_minimum(
    values: Float[np.ndarray, "*batch P"], softness: float
) -> Float[np.ndarray, "*batch"] | np.floating:
    """Return the minimum (...) of values (..., P), or with s = ``softness`` above 0 the soft
    minimum -s log mean exp(-v / s), which lies at most s log P above it."""
    least: np.ndarray = values.min(axis=-1)
    if softness <= 0:
        return least
    off = np.exp((np.asarray(least)[..., None] - values) / softness)
    soft: np.ndarray = least - softness * np.log(off.mean(axis=-1))
    return soft


class MeanCoverage(ExchangeCriterion):
    """The weighted share of points that at least ``most`` sensors see, with the goals' floors."""

    def __init__(self, scene: Scene, seen: int) -> None:
        super().__init__(scene)
        self.most = seen

    def value(self, field: Field, tally: Tally, softness: float) -> float:
        covered = tally.total + field.held.cell >= self.most
        return float(_worth(field.part[covered].sum(axis=0, dtype=float), self.scene))

    def rest(self, field: Field, tally: Tally, ring: int, softness: float) -> Rest:
        lack = self.most + tally.count[ring] - tally.total - field.held.cell  # (N,)
        index = np.flatnonzero(lack > 0)
        part, lack = field.part[index], lack[index]  # (M, G), (M,)
        base = field.total - part.sum(axis=0, dtype=float)  # (G,), covered without this ring

        def values(views: Views) -> Float[np.ndarray, " K"]:
            covered = views.counts if self.most == 1 else views.counts >= lack
            return np.asarray(_worth(base + covered @ part, self.scene))

        return Rest(index, values)


class MeanDetection(ExchangeCriterion):
    """The mean probability that a test piece at a point is detected; see ``Detections``."""

    most = MOST

    def __init__(self, scene: Scene, detections: Detections) -> None:
        super().__init__(scene)
        self.detections, self._share = detections, detections.share

    def _degree(self, total: Int[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
        return self._share.take(total, mode="clip")

    def value(self, field: Field, tally: Tally, softness: float) -> float:
        degree = self._degree(tally.total + field.held.cell)
        return float(_worth(degree @ field.part, self.scene))

    def rest(self, field: Field, tally: Tally, ring: int, softness: float) -> Rest:
        others = tally.total - tally.count[ring] + field.held.cell
        index = np.flatnonzero(others < len(self._share) - 1)
        part, others = field.part[index], others[index]  # (M, G), (M,)
        base = field.total - part.sum(axis=0, dtype=float)  # (G,), where nothing is left to gain

        def values(views: Views) -> Float[np.ndarray, " K"]:
            degree = self._degree(others + views.counts)
            return np.asarray(_worth(base + degree @ part, self.scene))

        return Rest(index, values)


class WorstPose(ExchangeCriterion):
    """The least share of points over the poses, each the mean over the goals."""

    def value(self, field: Field, tally: Tally, softness: float) -> float:
        covered = tally.total + field.held.cell > 0
        _, zeta = self.by_pose(field, tally)
        cost = self._penalty(field.part[covered].sum(axis=0, dtype=float))
        return float(soft_minimum(zeta, softness) - cost)

    def by_pose(
        self, field: Field, tally: Tally
    ) -> tuple[Int[np.ndarray, " P"], Float[np.ndarray, " P"]]:
        """Return the poses of a field, and the mean over the goals at each."""
        covered = tally.total + field.held.cell > 0
        poses, of_point = np.unique(field.pose, return_inverse=True)
        return poses, np.bincount(of_point, field.in_pose * covered)

    def _penalty(
        self, goals: Float[np.ndarray, "*batch G"]
    ) -> Float[np.ndarray, "*batch"] | np.floating | float:
        """Return what goals (..., G) below their floors cost."""
        if all(goal.at_least <= 0 for goal in self.scene.targets):
            return 0.0
        cost: np.ndarray = goals @ self.scene.goal_weights - _worth(goals, self.scene)
        return cost

    def rest(self, field: Field, tally: Tally, ring: int, softness: float) -> Rest:
        others = tally.total + field.held.cell - tally.count[ring] > 0
        _, pose = np.unique(field.pose, return_inverse=True)
        base = np.bincount(pose, field.in_pose * others)  # (P,)
        index = np.flatnonzero(~others)
        index = index[np.argsort(pose[index], kind="stable")]
        some, first = np.unique(pose[index], return_index=True)
        part, weight = field.part[index], field.in_pose[index]
        goals = field.total - part.sum(axis=0, dtype=float)

        def values(views: Views) -> Float[np.ndarray, " K"]:
            zeta = np.tile(base, (len(views.counts), 1))  # (K, P)
            if len(first):
                zeta[:, some] += np.add.reduceat(views.counts * weight, first, axis=1)
            cost = self._penalty(goals + views.counts @ part)
            return np.asarray(soft_minimum(zeta, softness) - cost)

        return Rest(index, values)


class AfterLoss(ExchangeCriterion):
    """The share of points that is left after the worst loss of a ring or sensor.

    It is the covered share less the largest share that one ring or sensor sees alone.
    """

    def __init__(self, scene: Scene, named: bool) -> None:
        """Lose single sensors if ``named``, else rings, of which then one sensor matters."""
        super().__init__(scene)
        self.named, self.most = named, 1 + named

    def _total(self, field: Field, tally: Tally) -> Int[np.ndarray, " N"]:
        # no loss uncovers what the cell's sensors see
        total: np.ndarray = tally.total + 2 * (field.held.cell > 0)
        return total

    def _worst(
        self, alone: Float[np.ndarray, "*batch Q"], softness: float
    ) -> Float[np.ndarray, "*batch"] | np.floating:
        """Return the largest of the shares that a loss costs, or a soft maximum."""
        most: np.ndarray = alone.max(axis=-1, initial=0.0)
        if softness <= 0:
            return most
        off = np.where(alone > _NOTHING, np.exp((alone - most[..., None]) / softness), 0.0)
        soft: np.ndarray = most + softness * np.log(np.maximum(off.sum(axis=-1), 1.0))
        return soft

    def value(self, field: Field, tally: Tally, softness: float) -> float:
        total, weight = self._total(field, tally), field.part @ self.scene.goal_weights
        once = np.flatnonzero(total == 1)
        alone = _sums(_numbered(tally.owner(once)), weight[once], 1)
        return float(weight[total > 0].sum() - self._worst(alone, softness))

    def rest(self, field: Field, tally: Tally, ring: int, softness: float) -> Rest:
        others = self._total(field, tally) - tally.count[ring]
        index = np.flatnonzero(others <= 1)
        weight = field.part @ self.scene.goal_weights
        base = float(weight[others > 0].sum())
        once, weight = others[index] == 1, weight[index]  # (M,)
        owner = np.zeros(len(index), int)
        owner[once] = _numbered(tally.owner(index[once], ring))
        alone = _sums(owner[once], weight[once], 1)  # (Q,)
        size = len(alone)

        def values(views: Views) -> Float[np.ndarray, " K"]:
            k, m = np.nonzero(views.counts)
            places = len(views.counts)
            first = ~once[m]
            gain = _sums(k[first], weight[m[first]], places)
            second = ~first
            shared = _sums(k[second] * size + owner[m[second]], weight[m[second]], places * size)
            new = gain[:, None]
            if views.sensor is not None:
                only = first & (views.counts[k, m] == 1)
                sensor = views.sensor[k[only], m[only]]
                each = int(sensor.max(initial=0)) + 1
                new = _sums(k[only] * each + sensor, weight[m[only]], places * each)
                new = new.reshape(places, each)
            left = np.concatenate([alone - shared.reshape(places, size), new], axis=1)
            each_value: np.ndarray = base + gain - self._worst(left, softness)
            return each_value

        return Rest(index, values)


def _numbered(values: Int[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
    """Return small numbers that are equal where the values are."""
    return np.unique(values, return_inverse=True)[1]


def _sums(
    index: Int[np.ndarray, " N"], weights: Float[np.ndarray, " N"], least: int
) -> Float[np.ndarray, " Q"]:
    """Return the sums of weights by index, at least ``least`` of them; floats also of none."""
    return np.bincount(index, weights, least).astype(float)
