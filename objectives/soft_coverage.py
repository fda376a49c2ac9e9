"""Soft coverage of a setup on points of a scene, with its gradient by the rings' values.

The value is the criterion of a search with soft beams: the weighted mean over goals, poses and
mountings, with floors, or the soft minimum over poses or losses.
"""

import math
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..coverage.arrays import Array
from ..coverage.rings.ring_kinematics import RingArrays
from ..coverage.soft.estimator import SHARP
from .criterion import Criterion
from .occlusion import check_bodies
from .scene import Scene
from .soft_terms import AT_ONCE, Sample, SoftTerms, Term

# The sensors are chosen in a function of its own: within that of the gradient, XLA would choose
# them again for each part of it.
_chosen = jax.jit(SoftTerms.choose, static_argnames="most")
_value = jax.jit(SoftTerms.criterion)
_slope = jax.jit(jax.value_and_grad(SoftTerms.criterion, argnums=2, has_aux=True))
_mean = jax.jit(SoftTerms.mean, static_argnames="most")


class SoftCoverage:
    """Soft coverage over a scene's goals and poses; see ``SoftTerms``."""

    def __init__(
        self,
        scene: Scene,
        terms: Sequence[Term],
        points: Sequence[Float[np.ndarray, "N 3"]],
        aim: Criterion | None = None,
        ball: Sequence[float] | None = None,
    ) -> None:
        """Store T terms; for several mountings all terms of the first come first.

        Args:
            scene: robot, poses, goals and occlusion.
            terms: goal and pose of each term.
            points: N points of each term, m, base frame.
            aim: the criterion; by default ζ itself.
            ball: radius of the ball about each point of a term that a beam is to meet, m; see
                ``SoftTerms.of``.

        Raises:
            BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
        """
        check_bodies(scene, scene.occlusion)
        self.scene, self.aim = scene, aim or Criterion()
        self.terms = SoftTerms.of(scene, terms, self.aim, ball)
        self.all = Sample(jnp.asarray(np.stack(points), jnp.float32))

    def share(
        self, arrays: RingArrays, values: Any, width: float = SHARP, sample: Sample | None = None
    ) -> float:
        """Return the soft coverage; by default the share of all points that are in a beam."""
        piece, *_ = self._pieces(arrays, values, width, sample or self.all)
        return float(self._applied(_value, arrays, values, width, piece)[0])

    def value_and_slope(
        self, arrays: RingArrays, values: Any, width: float, sample: Sample | None = None
    ) -> tuple[float, Float[np.ndarray, "3 R"]]:
        """Return the soft coverage and its gradient by positions, tilts and phases.

        Args:
            arrays: R rings and their sensors, and single sensors after them, which stay.
            values: positions, tilts (rad) and phases (rad) of the rings.
            width: width of the sigmoid, m.
            sample: the points; by default all.
        """
        pieces = self._pieces(arrays, values, width, sample or self.all)
        each = [self._applied(_slope, arrays, values, width, piece) for piece in pieces]
        slopes = [np.asarray(slope, float) for _, slope in each]
        return float(each[0][0][0]), np.sum(slopes, axis=0)

    def first(self, total: int, least: int) -> Sample:
        """Return ``total`` points, or somewhat fewer, as ``undecided`` does: the first of each
        term, at least ``least`` of each."""
        terms, n, _ = self.all.points.shape
        count = max(total // terms, least)
        return Sample(self.all.points[:, : -(-n // max(-(-n // count), 1))])

    def undecided(
        self,
        arrays: RingArrays,
        values: Any,
        width: float,
        total: int,
        least: int,
        sloping: bool = True,
    ) -> Sample:
        """Return ``total`` points with what the others contribute: of each term those that are
        nearest to being covered or not, at least ``least``.

        Small moves of the rings change what is covered at these points only. If ``sloping``, what
        JAX compiles here serves ``value_and_slope`` on these points, else ``share``.
        """
        points = np.asarray(self.all.points)  # (T, N, 3)
        n, count = points.shape[1], self.first(total, least).points.shape[1]
        if count == n:
            return self.all
        function = _slope if sloping else _value
        parts = [
            self._applied(function, arrays, values, width, Sample(jnp.asarray(some)))
            for some in _split(points, count)
        ]
        degrees = [np.asarray((part[0] if sloping else part)[1]) for part in parts]
        covered = np.concatenate(degrees, axis=2)[:, :, :n]  # (T, U, N)
        nearness = (covered * (1 - covered)).max(axis=1)  # (T, N)
        order = np.argsort(-nearness, axis=1, kind="stable")
        some = np.take_along_axis(points, order[:, :count, None], axis=1)
        others = np.take_along_axis(covered, order[:, None, count:], axis=2)
        rest = jnp.asarray(others.sum(axis=2, dtype=float) / n, jnp.float32)
        return Sample(jnp.asarray(some), jnp.float32(count / n), rest)

    def _pieces(
        self, arrays: RingArrays, values: Any, width: float, sample: Sample
    ) -> list[Sample]:
        """Return the points in pieces of one size, each with what the others contribute.

        The sum of the gradients of all pieces is the gradient.
        """
        terms, n, _ = sample.points.shape
        pairs = terms * n * len(arrays.length) * self.near(arrays)
        if pairs <= AT_ONCE:
            return [sample]
        size = -(-n // -(-pairs // AT_ONCE))
        parts = _split(np.asarray(sample.points), size)
        real = np.arange(len(parts) * size).reshape(-1, 1, 1, size) < n
        shares = np.where(real, sample.share * size / n, 0.0)
        pieces = [Sample(*each) for each in zip(parts, shares, strict=True)]
        each = [
            (piece.share * self._applied(_value, arrays, values, width, piece)[1]).mean(axis=-1)
            for piece in pieces
        ]
        whole = sample.rest + sum(each)
        return [piece._replace(rest=whole - mine) for piece, mine in zip(pieces, each, strict=True)]

    def _applied(
        self, function: Any, arrays: RingArrays, values: Any, width: float, sample: Sample
    ) -> Any:
        """Return the result of ``_value`` or ``_slope``."""
        values, width = jnp.asarray(values, jnp.float32), jnp.float32(width)
        most, shape = self.near(arrays), (len(self.terms.pose), self.terms.units(arrays))
        chosen = _chosen(self.terms, arrays, values, sample.points, width, most=most)
        rest = jnp.broadcast_to(jnp.asarray(sample.rest, jnp.float32), shape)
        whole = Sample(sample.points, jnp.asarray(sample.share, jnp.float32), rest)
        return function(self.terms, arrays, values, whole, width, chosen)

    def mean(
        self, arrays: RingArrays, values: Float[Array, "3 R"], width: Float[Array, ""] | float
    ) -> Float[jax.Array, ""]:
        """Return the weighted mean of soft ζ over goals and poses, without floors; differentiable
        by the values, and works under ``jit`` and ``vmap``.

        It is NaN for values that are not finite or a width that is not above 0, which the sums over
        points would turn into a number.
        """
        values, points, most = jnp.asarray(values), self.all.points, self.near(arrays)
        mean: jax.Array = _mean(self.terms, arrays, values, points, width, most=most)
        return mean

    def near(self, arrays: RingArrays, largest: int | None = None) -> int:
        """Return how many sensors of a ring count at a point: two, or more where beams overlap or
        several sensors must see it.

        Args:
            arrays: the rings.
            largest: the largest number of sensors of a ring; by default that of ``arrays``.
        """
        each = arrays.beams
        half = np.asarray(each.by_shape(lambda shape, sizes: shape.outer(sizes)))
        seeing = np.asarray(each.range_m) > 0
        if largest is None:
            largest = int(np.bincount(np.asarray(arrays.ring)[seeing]).max(initial=1))
        if self.aim.detection is not None:  # near a ring a piece reaches into the beams of half
            return min(largest, largest // 2 + 2)
        overlap = math.ceil(float(half[seeing].max(initial=0.0)) * largest / math.pi)
        more = self.aim.seen - 1 + (self.aim.losing == "sensor")
        return min(largest, max(2, overlap) + more)


def _split(points: Float[np.ndarray, "T N 3"], size: int) -> list[Float[np.ndarray, "T size 3"]]:
    """Return the points of T terms in pieces of one size; the last point fills the last piece."""
    n = points.shape[1]
    pieces = -(-n // size)
    return np.split(points[:, np.minimum(np.arange(pieces * size), n - 1)], pieces, axis=1)
