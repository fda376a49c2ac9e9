"""The objective that the local search maximises: the criterion, weighted over targets and poses, as
a soft value with a gradient or as a share of points.
"""

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from ..coverage.arrays import Array
from ..coverage.rings.mounting_errors import misplaced
from ..coverage.rings.ring_kinematics import (
    RingArrays,
    SensorPoses,
    in_links,
    ring_slopes,
    seen_from,
    sensor_poses,
)
from ..coverage.robots.kinematics import forward
from ..coverage.soft.estimator import SHARP, Soft
from ..coverage.soft.sampling import Cloud
from .criterion import Criterion, check_criterion
from .floors import STEEP, floors
from .parameterization import Interval, SetupArrays, decode, value_slopes
from .scene import CoreScene
from .soft_terms import Rows, SoftTerms
from .target_points import TargetPoints

# of the soft minimum over P poses, which exceeds the minimum by at most this times log P
TEMPERATURE = 0.005
_SOFTNESS = 0.1  # of the minimum over losses, per m of the sigmoid's width
_AT_ONCE = 16  # setups per batch


def _soft_minimum(
    zetas: Float[np.ndarray, " P"], among: Bool[np.ndarray, " P"]
) -> tuple[float, Float[np.ndarray, " P"]]:
    """Return the soft minimum of the zetas (P,) selected by ``among``, and its slope by each."""
    from scipy.special import logsumexp, softmax

    lack = np.where(among, -zetas / TEMPERATURE, -np.inf)
    return TEMPERATURE * float(np.log(np.count_nonzero(among)) - logsumexp(lack)), softmax(lack)


class CoverageObjective:
    """Weighted mean of the criterion over a scene's goals and poses, by default of zeta.

    One object handles setups with one number of rings and sensors. Where the scene maximises the
    worst pose, the mean over poses is replaced by the soft minimum over the poses of the mean over
    the goals, -T log(mean(exp(-zeta / T))). A goal whose zeta falls short of its floor lowers the
    value by a steep parabola.

    A setup is given by its arrays (``RingArrays`` and ``Interval``) and its values (3, R), which
    ``decode`` reads. Only ``SoftTerms`` is compiled, for all setups with one number of sensors.
    NumPy computes the sensor poses and the chain rule back to the values, which is little work.
    One object may be used by many threads.
    """

    def __init__(
        self, scene: CoreScene, points: TargetPoints, aim: Criterion | None = None
    ) -> None:
        """Store the scene, the points drawn for its goals, poses and mountings, and the criterion.

        Raises:
            ValueError: if the points are for another number of mountings, or the goals have floors
                that the criterion does not support.
        """
        self.scene, self.aim = scene, aim or Criterion()
        if points.mountings != self.aim.mountings:
            raise ValueError(
                f"points are for {points.mountings} mountings, but the criterion has"
                f" {self.aim.mountings}"
            )
        check_criterion(scene, self.aim)
        self._goal, self._pose = (np.array(column) for column in zip(*points.terms, strict=True))
        self._mounting = np.arange(len(points.terms)) // (len(points.terms) // points.mountings)
        self._goal_weights = scene.goal_weights
        self._floors = floors(scene)
        self._frames = np.array([forward(scene.robot.chain, pose.q) for pose in scene.poses])
        self._terms = SoftTerms(scene, self._frames, self.aim.seen)

    def _seats(
        self, slots: RingArrays, where: Interval, values: Float[np.ndarray, "3 R"]
    ) -> SensorPoses:
        """Return the poses of all sensors, (D, K, 3), for each mounting."""
        meant = sensor_poses(slots, *decode(where, values))
        errs = ~self._of_cell(slots)
        errors = self.aim.drawn(slots.length.shape[0], slots.ring.shape[0])
        return (
            SensorPoses(*(v[None] for v in meant))
            if errors is None
            else misplaced(slots, meant, errors.only(errs, errs[slots.ring]))
        )

    def _looks(self, slots: RingArrays, here: SensorPoses, some: Int[np.ndarray, " T"]) -> Rows:
        """Return the rows that the terms of indices ``some`` (T,) evaluate for one setup."""
        at, pose = np.unique(self._pose[some], return_inverse=True)
        parts = seen_from(slots, here, self._frames[at], slots.beams.square)
        apex, axis, *up = (v[self._mounting[some], pose] for v in parts)
        lost = self._lost(slots)
        beams, group = jax.tree.map(
            lambda a: np.broadcast_to(a, (len(some), *np.shape(a))), (slots.beams, lost)
        )
        return Rows(some, self._pose[some], apex, axis, beams, up[0] if up else None, group)

    def _of_cell(self, slots: RingArrays) -> Bool[np.ndarray, " R"]:
        """Return which rows are sensors of the cell, the last ones: they neither err nor fail."""
        rows: int = slots.length.shape[0]
        return np.arange(rows) >= rows - len(self.scene.cell_sensors)

    def _lost(self, slots: RingArrays) -> Int[np.ndarray, " K"] | None:
        """Return the group with which each sensor is lost; None if none is.

        For a sensor that is never lost it is the number of groups.
        """
        if self.aim.losing is None:
            return None
        ring = np.asarray(slots.ring)
        own = ring if self.aim.losing == "ring" else np.arange(len(ring))
        groups = slots.length.shape[0] if self.aim.losing == "ring" else len(ring)
        return np.where(self._of_cell(slots)[ring], groups, own)

    def _worth(
        self,
        zetas: Float[np.ndarray, " T"],
        some: Int[np.ndarray, " T"],
        poses: Float[np.ndarray, " P"],
    ) -> tuple[float, Float[np.ndarray, " T"]]:
        """Return a setup's value, and its slopes by the zetas (T,) of terms ``some``."""
        goal, pose, weights = self._goal[some], self._pose[some], self._goal_weights
        share = poses[pose] / self.aim.mountings
        zeta = np.bincount(goal, share * zetas, len(weights))
        short = np.maximum(self._floors - zeta, 0.0)
        value, pull = float(weights @ zeta), share * (weights + 2 * STEEP * short)[goal]
        if self.scene.over_poses == "worst":
            by_pose = np.bincount(pose, weights[goal] * zetas / self.aim.mountings, len(poses))
            value, least = _soft_minimum(by_pose, poses > 0)
            pull = pull + (least - poses)[pose] * weights[goal]
        return value - STEEP * float(short @ short), pull

    def _pulled_back(
        self,
        slots: RingArrays,
        where: Interval,
        values: Float[np.ndarray, "3 R"],
        here: SensorPoses,
        some: Int[np.ndarray, " T"],
        slopes: Sequence[Float[Array, "T K 3"] | None],
    ) -> Float[np.ndarray, "3 R"]:
        """Return slopes (3, R) by the values, from slopes (T, K, 3) by terms ``some``."""
        by: list[Any] = [np.zeros_like(here.apex) if a is not None else None for a in slopes]
        for total, slope in zip(by, slopes, strict=True):
            if slope is not None:
                np.add.at(
                    total,
                    self._mounting[some],
                    in_links(slots, slope, self._frames[self._pose[some]]),
                )
        return value_slopes(where, values, *ring_slopes(slots, here, *by))

    def _of_some(
        self,
        setups: SetupArrays,
        values: Float[np.ndarray, "S 3 R"],
        clouds: Cloud,
        poses: Float[np.ndarray, " P"],
        width: float,
        slopes: bool,
    ) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, "S 3 R"]]:
        """Return value and slopes (3, R) of each setup.

        ``poses`` (P,) holds weights; poses of weight 0 are not evaluated.
        """
        some = np.flatnonzero(poses[self._pose] > 0)
        each: list[SetupArrays] = [
            jax.tree.map(lambda a, i=i: a[i], setups) for i in range(len(values))
        ]
        places = [
            self._seats(slots, where, x) for (slots, where), x in zip(each, values, strict=True)
        ]
        looks = [
            self._looks(slots, here, some) for (slots, _), here in zip(each, places, strict=True)
        ]
        rows: Rows = jax.tree.map(lambda *a: np.concatenate(a), *looks)
        if self.aim.losing is None:
            soft = self._terms(rows, clouds, width, slopes)
            zetas = np.asarray(soft.zeta).reshape(len(values), -1)
            worth = [self._worth(z, some, poses) for z in zetas]
        else:
            losses = (setups[0].length if self.aim.losing == "ring" else setups[0].ring).shape[1]
            soft, worth = self._after_the_worst_loss(
                rows, losses, some, clouds, poses, width, slopes
            )
        results = []
        for i, (value, pull) in enumerate(worth):
            slope = np.zeros_like(values[i])
            if slopes:
                mine = slice(i * len(some), (i + 1) * len(some))
                by = [None if a is None else pull[:, None, None] * a[mine] for a in soft[1:]]
                slots, where = each[i]
                slope = self._pulled_back(slots, where, values[i], places[i], some, by)
            results.append((value, slope))
        worths, gradients = zip(*results, strict=True)
        return np.stack(worths), np.stack(gradients)

    def _after_the_worst_loss(
        self,
        rows: Rows,
        losses: int,
        some: Int[np.ndarray, " T"],
        clouds: Cloud,
        poses: Float[np.ndarray, " P"],
        width: float,
        slopes: bool,
    ) -> tuple[Soft, list[tuple[float, Float[np.ndarray, " T"]]]]:
        """Return the soft minimum of the zetas after each loss, -s log sum exp(-zeta / s).

        Its slope is the slope of their mean with the soft minimum's weights. Computing these takes
        a first pass over all terms.
        """
        from scipy.special import logsumexp, softmax

        share, softness = (
            poses[self._pose[some]] * self._goal_weights[self._goal[some]],
            width * _SOFTNESS,
        )
        soft = self._terms(
            rows._replace(weights=np.ones((len(rows.term), losses))), clouds, width, False
        )
        zetas = np.tensordot(share, np.asarray(soft.zeta).reshape(-1, len(some), losses), (0, 1))
        if slopes:
            weights = np.repeat(softmax(-zetas / softness, axis=1), len(some), axis=0)
            soft = self._terms(rows._replace(weights=weights), clouds, width, True)
        values = -softness * logsumexp(-zetas / softness, axis=1)
        return soft, [(float(value), share) for value in values]

    def _in_pieces(
        self,
        setups: SetupArrays,
        values: Float[np.ndarray, "S 3 R"],
        clouds: Cloud,
        poses: Float[np.ndarray, " P"] | None,
        width: float,
        slopes: bool,
    ) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, "S 3 R"]]:
        weights = self.scene.pose_weights if poses is None else np.asarray(poses, float)
        results = []
        for i in range(0, len(values), _AT_ONCE):
            some, x = jax.tree.map(
                lambda a, i=i: a[i : i + _AT_ONCE], (setups, np.asarray(values, float))
            )
            results.append(self._of_some(some, x, clouds, weights, float(width), slopes))
        worths, gradients = zip(*results, strict=True)
        return np.concatenate(worths), np.concatenate(gradients)

    def soft(
        self,
        setups: SetupArrays,
        values: Float[np.ndarray, "S 3 R"],
        width: float,
        clouds: Cloud,
        poses: Float[np.ndarray, " P"] | None = None,
    ) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, "S 3 R"]]:
        """Return soft values of S setups, and their gradients by the setups' values.

        Args:
            setups: ``(RingArrays, Interval)`` of the setups, stacked along a first axis.
            values: values of the rings, as ``decode`` reads them.
            width: width of the sigmoid, m.
            clouds: points of every goal at every pose.
            poses: weights (P,) of the poses, by default the scene's.
        """
        return self._in_pieces(setups, values, clouds, poses, width, True)

    def zetas(
        self,
        setups: SetupArrays,
        values: Float[np.ndarray, "S 3 R"],
        clouds: Cloud,
        width: float = SHARP,
        poses: Float[np.ndarray, " P"] | None = None,
    ) -> Float[np.ndarray, " S"]:
        """Return soft values of S setups without gradients, in a quarter of the time.

        At the default width, zeta is the share of the points inside a cone.
        """
        return self._in_pieces(setups, values, clouds, poses, width, False)[0]
