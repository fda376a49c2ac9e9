"""What is wanted: weighted zeta over targets and poses, soft for the search and on points for a quick look."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..coverage.chain import forward
from ..coverage.points import sample
from ..coverage.rings import RingValues, Setup, sensor_axes, sensor_optics
from ..coverage.soft import point_zeta, soft_zeta
from ..coverage.solids import Cones
from ..coverage.targets import target_solid
from .scene import Scene


class CoverageObjective:
    """Weighted mean of zeta over a scene's goals and poses, for setups with the links, counts and radii of ``setup``.

    Every goal has its own points at every pose, drawn once: targets do not move with the rings. Arithmetic is in 32 bit,
    enough for a search that the exact count judges.
    """

    def __init__(self, scene: Scene, setup: Setup, points: int, seed: int) -> None:
        """Draw ``points`` points in each goal at each pose.

        Raises:
            ValueError: if a ring sits on a link that the robot has not, or a target is empty.
        """
        self.scene, self.setup, self.points = scene, setup, points
        terms = [(g, p) for g in range(len(scene.goals)) for p in range(len(scene.poses))]
        seeds = np.random.SeedSequence(seed).generate_state(len(terms))
        clouds = [
            sample(target_solid(scene.goals[g].target, scene.robot, scene.poses[p].q, scene.shape), points, int(s))
            for (g, p), s in zip(terms, seeds, strict=True)
        ]
        self._clouds = jnp.asarray(np.array(clouds), jnp.float32)
        self._pose = jnp.asarray([p for _, p in terms])
        self._weights = jnp.asarray([scene.goal_weights[g] * scene.pose_weights[p] for g, p in terms], jnp.float32)
        frames = np.array([forward(scene.robot.chain, pose.q) for pose in scene.poses])
        self._frames = jnp.asarray(frames, jnp.float32)
        self._optics = tuple(jnp.asarray(a, jnp.float32) for a in sensor_optics(setup))
        self._soft = jax.jit(jax.value_and_grad(partial(self._mean, soft_zeta)))
        self._hard = jax.jit(partial(self._mean, lambda cones, cloud, width: point_zeta(cones, cloud)))

    def _mean(self, zeta: Any, values: Float[jax.Array, "3 R"], clouds: Any, width: Any) -> Any:
        apex, axis = sensor_axes(self.scene.robot, self.setup, RingValues(*values), self._frames)

        def term(pose_cloud: Any) -> Any:
            pose, cloud = pose_cloud
            return zeta(Cones(apex[pose], axis[pose], *self._optics), cloud, width)

        return jnp.dot(self._weights, jax.lax.map(term, (self._pose, clouds)))

    def soft(
        self, values: Float[np.ndarray, "3 R"], width: float, points: int
    ) -> tuple[float, Float[np.ndarray, "3 R"]]:
        """Soft zeta in [0, 1] and its gradient by positions, tilts and phases, on the first ``points`` of the points."""
        value, slope = self._soft(jnp.asarray(values, jnp.float32), self._clouds[:, :points], jnp.float32(width))
        return float(value), np.asarray(slope, float)

    def hard(self, values: Float[np.ndarray, "3 R"]) -> float:
        """Share in [0, 1] of all points inside a cone."""
        return float(self._hard(jnp.asarray(values, jnp.float32), self._clouds, jnp.float32(0)))
