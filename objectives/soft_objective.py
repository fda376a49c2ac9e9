"""The objective that the local search maximises: ζ, weighted over targets and poses, as a soft
value with a gradient or as a share of points.
"""

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from ..coverage.arrays import Array
from ..coverage.rings.ring_kinematics import (
    RingArrays,
    SensorPoses,
    in_links,
    ring_slopes,
    seen_from,
    sensor_poses,
)
from ..coverage.robots.kinematics import forward
from ..coverage.soft.estimator import SHARP
from ..coverage.soft.sampling import Cloud
from .floors import STEEP, floors
from .parameterization import Interval, SetupArrays, decode, value_slopes
from .scene import CoreScene
from .soft_terms import Rows, SoftTerms
from .target_points import TargetPoints

# of the soft minimum over P poses, which exceeds the minimum by at most this times log P
TEMPERATURE = 0.005
_AT_ONCE = 16  # setups per batch


def _soft_minimum(zetas: Float[np.ndarray, " P"]) -> tuple[float, Float[np.ndarray, " P"]]:
    """Return the soft minimum of the zetas (P,), and its slope by each."""
    from scipy.special import logsumexp, softmax

    lack = -zetas / TEMPERATURE
    return TEMPERATURE * float(np.log(len(zetas)) - logsumexp(lack)), softmax(lack)


class CoverageObjective:
    """Weighted mean of ζ over a scene's goals and poses.

    One object handles setups with one number of rings and sensors. Where the scene maximises the
    worst pose, the mean over poses is replaced by the soft minimum over the poses of the mean over
    the goals, -T log(mean(exp(-zeta / T))). A goal whose zeta falls short of its floor lowers the
    value by a steep parabola.

    A setup is given by its arrays (``RingArrays`` and ``Interval``) and its values (3, R), which
    ``decode`` reads. Only ``SoftTerms`` is compiled, for all setups with one number of sensors.
    NumPy computes the sensor poses and the chain rule back to the values, which is little work.
    One object may be used by many threads.
    """

    def __init__(self, scene: CoreScene, points: TargetPoints) -> None:
        """Store the scene, and the points drawn for its goals and poses."""
        self.scene = scene
        self._goal, self._pose = (np.array(column) for column in zip(*points.terms, strict=True))
        self._goal_weights = scene.goal_weights
        self._floors = floors(scene)
        self._frames = np.array([forward(scene.robot.chain, pose.q) for pose in scene.poses])
        self._terms = SoftTerms(scene, self._frames)

    def soft(
        self,
        setups: SetupArrays,
        values: Float[np.ndarray, "S 3 R"],
        width: float,
        clouds: Cloud,
    ) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, "S 3 R"]]:
        """Return soft values of S setups, and their gradients by the setups' values.

        Args:
            setups: ``(RingArrays, Interval)`` of the setups, stacked along a first axis.
            values: values of the rings, as ``decode`` reads them.
            width: width of the sigmoid, m.
            clouds: points of every goal at every pose.
        """
        return self._in_pieces(setups, values, clouds, width, True)

    def zetas(
        self,
        setups: SetupArrays,
        values: Float[np.ndarray, "S 3 R"],
        clouds: Cloud,
        width: float = SHARP,
    ) -> Float[np.ndarray, " S"]:
        """Return soft values of S setups without gradients, in a quarter of the time.

        At the default width, zeta is the share of the points inside a cone.
        """
        return self._in_pieces(setups, values, clouds, width, False)[0]

    def _in_pieces(
        self,
        setups: SetupArrays,
        values: Float[np.ndarray, "S 3 R"],
        clouds: Cloud,
        width: float,
        slopes: bool,
    ) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, "S 3 R"]]:
        results = []
        for i in range(0, len(values), _AT_ONCE):
            some, x = jax.tree.map(
                lambda a, i=i: a[i : i + _AT_ONCE], (setups, np.asarray(values, float))
            )
            results.append(self._of_some(some, x, clouds, float(width), slopes))
        worths, gradients = zip(*results, strict=True)
        return np.concatenate(worths), np.concatenate(gradients)

    def _of_some(
        self,
        setups: SetupArrays,
        values: Float[np.ndarray, "S 3 R"],
        clouds: Cloud,
        width: float,
        slopes: bool,
    ) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, "S 3 R"]]:
        """Return value and slopes (3, R) of each setup."""
        each: list[SetupArrays] = [
            jax.tree.map(lambda a, i=i: a[i], setups) for i in range(len(values))
        ]
        places = [
            sensor_poses(slots, *decode(where, x))
            for (slots, where), x in zip(each, values, strict=True)
        ]
        looks = [self._looks(slots, here) for (slots, _), here in zip(each, places, strict=True)]
        rows: Rows = jax.tree.map(lambda *a: np.concatenate(a), *looks)
        soft = self._terms(rows, clouds, width, slopes)
        zetas = np.asarray(soft.zeta).reshape(len(values), -1)  # (S, T)
        worths, gradients = [], np.zeros_like(values)
        for i, (value, pull) in enumerate(map(self._worth, zetas)):
            worths.append(value)
            if slopes:
                mine = slice(i * len(pull), (i + 1) * len(pull))
                by = [None if a is None else pull[:, None, None] * a[mine] for a in soft[1:]]
                gradients[i] = self._pulled_back(*each[i], values[i], places[i], by)
        return np.array(worths), gradients

    def _looks(self, slots: RingArrays, here: SensorPoses) -> Rows:
        """Return the rows of all T terms for one setup."""
        parts = seen_from(slots, here, self._frames, slots.beams.square)
        apex, axis, *up = (v[self._pose] for v in parts)
        terms = len(self._pose)
        beams = jax.tree.map(lambda a: np.broadcast_to(a, (terms, *np.shape(a))), slots.beams)
        return Rows(np.arange(terms), self._pose, apex, axis, beams, up[0] if up else None)

    def _worth(self, zetas: Float[np.ndarray, " T"]) -> tuple[float, Float[np.ndarray, " T"]]:
        """Return a setup's value, and its slopes by the zetas (T,)."""
        goal, pose, weights = self._goal, self._pose, self._goal_weights
        poses = self.scene.pose_weights
        share = poses[pose]
        zeta = np.bincount(goal, share * zetas, len(weights))
        short = np.maximum(self._floors - zeta, 0.0)
        value, pull = float(weights @ zeta), share * (weights + 2 * STEEP * short)[goal]
        if self.scene.over_poses == "worst":
            by_pose = np.bincount(pose, weights[goal] * zetas, len(poses))
            value, least = _soft_minimum(by_pose)
            pull = pull + (least - poses)[pose] * weights[goal]
        return value - STEEP * float(short @ short), pull

    def _pulled_back(
        self,
        slots: RingArrays,
        where: Interval,
        values: Float[np.ndarray, "3 R"],
        here: SensorPoses,
        slopes: Sequence[Float[Array, "T K 3"] | None],
    ) -> Float[np.ndarray, "3 R"]:
        """Return slopes (3, R) by the values, from slopes (T, K, 3) by the terms' sensors."""
        frames = self._frames[self._pose]
        by: list[Any] = [
            None if a is None else in_links(slots, a, frames).sum(axis=0) for a in slopes
        ]
        return value_slopes(where, values, *ring_slopes(slots, here, *by))
