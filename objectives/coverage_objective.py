"""What the search climbs: weighted zeta over targets and poses, soft with a gradient, and the plain share of points."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..coverage.chain import forward
from ..coverage.cloud import BLOCK, Cloud, cloud
from ..coverage.points import sample
from ..coverage.rings import RingValues, Setup, sensor_axes, sensor_optics
from ..coverage.soft import point_zeta, soft_zeta
from ..coverage.solids import Cones
from ..coverage.targets import target_solid
from .scene import Scene

_NEAR = (24, 48, 96)  # how many cones a block looks at: a choice of few, as each is compiled anew


class TargetPoints:
    """Points of every goal at every pose of a scene, drawn once: targets do not move with the rings."""

    def __init__(self, scene: Scene, count: int, seed: int) -> None:
        """Draw ``count`` points in each goal at each pose.

        Raises:
            ValueError: if a target is empty.
        """
        self.terms = [(g, p) for g in range(len(scene.goals)) for p in range(len(scene.poses))]
        seeds = np.random.SeedSequence(seed).generate_state(len(self.terms))
        self.points = [
            sample(target_solid(scene.goals[g].target, scene.robot, scene.poses[p].q, scene.shape), count, int(s))
            for (g, p), s in zip(self.terms, seeds, strict=True)
        ]
        self.weights = np.array([scene.goal_weights[g] * scene.pose_weights[p] for g, p in self.terms])

    def clouds(self, count: int) -> Cloud:
        """The first ``count`` points of each term as one cloud with a leading axis of terms."""
        each = [cloud(points[:count], min(BLOCK, count)) for points in self.points]
        return jax.tree.map(lambda *a: jnp.asarray(np.stack(a)), *each)


class CoverageObjective:
    """Weighted mean of zeta over a scene's goals and poses, for setups with the links, counts and radii of ``setup``.

    Arithmetic is in 32 bit, which is enough for a search that the exact count judges. One object serves many threads.
    """

    def __init__(self, scene: Scene, setup: Setup, points: TargetPoints) -> None:
        """Raises ValueError if a ring sits on a link that the robot has not."""
        self.scene, self.setup = scene, setup
        self._pose = jnp.asarray([p for _, p in points.terms])
        self._weights = jnp.asarray(points.weights, jnp.float32)
        frames = np.array([forward(scene.robot.chain, pose.q) for pose in scene.poses])
        self._frames = jnp.asarray(frames, jnp.float32)
        self._optics = tuple(jnp.asarray(a, jnp.float32) for a in sensor_optics(setup))
        self._soft = jax.jit(self._soft_mean, static_argnames="near")
        self._hard = jax.jit(self._hard_mean)

    def _axes(self, values: Any) -> tuple[Any, Any]:
        return sensor_axes(self.scene.robot, self.setup, RingValues(*values), self._frames)

    def _soft_mean(self, values: Any, clouds: Cloud, width: Any, near: int) -> tuple[Any, Any, Any]:
        (apex, axis), pull_back = jax.vjp(self._axes, values)

        def term(pose_cloud: Any) -> Any:
            pose, points = pose_cloud
            return soft_zeta(Cones(apex[pose], axis[pose], *self._optics), points, width, near)

        each = jax.lax.map(term, (self._pose, clouds))
        weighted = partial(jnp.multiply, self._weights[:, None, None])
        by_apex = jnp.zeros_like(apex).at[self._pose].add(weighted(each.by_apex))
        by_axis = jnp.zeros_like(axis).at[self._pose].add(weighted(each.by_axis))
        return jnp.dot(self._weights, each.zeta), pull_back((by_apex, by_axis))[0], each.near.max()

    def _hard_mean(self, values: Any, clouds: Cloud) -> Any:
        apex, axis = self._axes(values)

        def term(pose_cloud: Any) -> Any:
            pose, points = pose_cloud
            return point_zeta(Cones(apex[pose], axis[pose], *self._optics), points)

        return jnp.dot(self._weights, jax.lax.map(term, (self._pose, clouds)))

    def soft(
        self, values: Float[np.ndarray, "3 R"], width: float, clouds: Cloud, near: int | None = None
    ) -> tuple[float, Float[np.ndarray, "3 R"], int]:
        """Soft zeta in [0, 1], its gradient by positions, tilts and phases, and the cones a block needed to look at.

        ``near`` is a guess of the last; a guess too small costs a second evaluation, never a wrong value.
        """
        x = jnp.asarray(values, jnp.float32)
        sensors = self.setup.sensors
        guess = self._bucket(sensors if near is None else near)
        value, slope, needed = self._soft(x, clouds, jnp.float32(width), near=guess)
        if int(needed) > guess:
            value, slope, needed = self._soft(x, clouds, jnp.float32(width), near=self._bucket(int(needed)))
        return float(value), np.asarray(slope, float), int(needed)

    def _bucket(self, near: int) -> int:
        return min((b for b in _NEAR if b >= near), default=self.setup.sensors)

    def hard(self, values: Float[np.ndarray, "3 R"], clouds: Cloud) -> float:
        """Share in [0, 1] of the points inside a cone."""
        return float(self._hard(jnp.asarray(values, jnp.float32), clouds))
