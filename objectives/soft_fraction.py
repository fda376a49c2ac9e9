"""Soft coverage of a setup as a function that JAX can differentiate, compile and vectorise.

``jax.custom_vjp`` supplies the hand-written gradient by the beams of ``coverage.soft``. JAX itself
differentiates only the cheap part, the positions of the beams.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from ..coverage.arrays import Array
from ..coverage.rings.ring_kinematics import RingArrays, seen_from, sensor_poses
from ..coverage.robots.kinematics import forward
from ..coverage.soft.estimator import Soft, soft_zeta
from ..coverage.soft.sampling import Cloud
from ..coverage.solids.sensor_beams import BeamShapes
from .scene import CoreScene
from .soft_terms import SoftTerms


class SoftFraction:
    """The weighted mean of soft ζ over terms; a term is the points of one cloud at one pose.

    One object compiles once for each number of rings and sensors.
    """

    def __init__(
        self,
        scene: CoreScene,
        clouds: Cloud,
        pose: Int[np.ndarray, " T"],
        weights: Float[np.ndarray, " T"],
    ) -> None:
        """Store T terms.

        Args:
            scene: robot, poses and occlusion.
            clouds: T clouds, stacked along a first axis.
            pose: index (T,) of each cloud's pose.
            weights: weight (T,) of each term in the mean.

        Raises:
            BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
        """
        frames = np.array([forward(scene.robot.chain, p.q) for p in scene.poses])
        self._frames = jnp.asarray(frames)  # (P, F, 4, 4)
        self._clouds, self._pose = clouds, jnp.asarray(pose)
        self._weights = jnp.asarray(weights, clouds.points.dtype)
        self._zeta = _differentiable(SoftTerms(scene, frames))
        self._compiled = jax.jit(self._mean)

    def __call__(
        self, arrays: RingArrays, values: Float[Array, "3 R"], width: float | Array
    ) -> Float[jax.Array, ""]:
        """Return soft ζ in [0, 1] of a setup, differentiable by the ``values`` of its rings.

        Args:
            arrays: R rings and their sensors, and single sensors after them, which stay.
            values: positions, tilts (rad) and phases (rad) of the rings.
            width: width of the sigmoid, m; treated as a constant.

        Returns:
            Soft ζ; NaN for values that are not finite or a width that is not above 0, which the
            sums over points would otherwise turn into a number.
        """
        mean: jax.Array = self._compiled(arrays, jnp.asarray(values), jax.lax.stop_gradient(width))
        return mean

    def _mean(self, arrays: RingArrays, values: Any, width: Any) -> Any:
        dtype = self._clouds.points.dtype
        singles = arrays.length.shape[0] - values.shape[1]
        here = sensor_poses(arrays, *jnp.pad(values, ((0, 0), (0, singles))))
        parts = seen_from(arrays, here, self._frames, arrays.beams.square)
        beams = tuple(part.astype(dtype) for part in parts)  # each (P, K, 3)
        shapes: BeamShapes = jax.tree.map(
            lambda a: jnp.asarray(a, None if a.dtype == bool else dtype), arrays.beams
        )
        wide = jnp.asarray(width, dtype)

        def term(one: Any) -> Any:
            cloud, pose = one
            return self._zeta(tuple(b[pose] for b in beams), (shapes, pose, cloud, wide))

        clouds = tuple(jax.tree.leaves(self._clouds))
        zetas = jax.lax.map(term, (clouds, self._pose))  # (T,)
        sound = jnp.isfinite(values).all() & (wide > 0) & jnp.isfinite(wide)
        return (self._weights * zetas).sum() * jnp.where(sound, 1, jnp.nan).astype(dtype)


def _differentiable(terms: SoftTerms) -> Callable[[Any, Any], Any]:
    """Return soft ζ as a function of beams, (K, 3) each, with its hand-written gradient."""

    def soft(beams: Any, fixed: Any, slopes: bool) -> Soft:
        shapes, pose, cloud, width = fixed
        cones = shapes.solids(*beams)
        return soft_zeta(terms.past(cones, pose), Cloud(*cloud), width, slopes=slopes)

    def value_of(beams: Any, fixed: Any) -> Any:
        return soft(beams, fixed, False).zeta

    def both_of(beams: Any, fixed: Any) -> tuple[Any, Any]:
        zeta, *slopes = soft(beams, fixed, True)
        return zeta, tuple(slopes[: len(beams)])

    if jax.default_backend() == "cpu":
        # one setup after the other: vectorised setups would all do the work of the slowest block
        value_of = jax.custom_batching.sequential_vmap(value_of)  # type: ignore[no-untyped-call]
        both_of = jax.custom_batching.sequential_vmap(both_of)  # type: ignore[no-untyped-call]

    @jax.custom_vjp
    def zeta(beams: Any, fixed: Any) -> Any:
        return value_of(beams, fixed)

    def pulled_back(slopes: Any, pull: Any) -> tuple[Any, None]:
        return tuple(pull * slope for slope in slopes), None

    zeta.defvjp(both_of, pulled_back)
    return zeta
