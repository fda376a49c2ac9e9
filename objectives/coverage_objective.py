"""What the search climbs: its aim, weighted over targets and poses, soft with a gradient, and as a share of points."""

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..coverage.chain import forward
from ..coverage.cloud import BLOCK, Cloud, cloud
from ..coverage.mounting import misplaced_axes
from ..coverage.points import sample
from ..coverage.rings import RingValues, Setup, sensor_axes, sensor_optics
from ..coverage.soft import SHARP, Soft
from ..coverage.soft_loss import soft_losses
from ..coverage.soft_seen import soft_seen
from ..coverage.solids import Cones
from ..coverage.targets import target_solid
from .aim import Aim
from .scene import Scene

_SOFTNESS = 0.1  # of the minimum over losses, for each m of a sigmoid's width
_PIECE = {"cpu": (16, None)}  # setups in one call, and how many of these at once: on a CPU one after the other,
_PIECE_ELSEWHERE = (256, 4)  # on an accelerator several, as memory holds them


def _each(function: Callable[[Any], Any], arrays: Any) -> Any:
    """``function`` along the first axis of ``arrays``, as many at once as suits the device."""
    return jax.lax.map(function, arrays, batch_size=_piece()[1])


def _piece() -> tuple[int, int | None]:
    return _PIECE.get(jax.default_backend(), _PIECE_ELSEWHERE)


class TargetPoints:
    """Points of every goal at every pose of a scene, drawn once: targets do not move with the rings."""

    def __init__(self, scene: Scene, count: int, seed: int, mountings: int = 1) -> None:
        """Draw ``count`` points in each goal at each pose, anew for each of so many mountings: the luck of the points then
        evens out over these, and fewer will do.

        Raises:
            ValueError: if a target is empty.
        """
        self.mountings = mountings
        self.terms = [(g, p) for _ in range(mountings) for g in range(len(scene.goals)) for p in range(len(scene.poses))]
        seeds = np.random.SeedSequence(seed).generate_state(len(self.terms))
        self.points = [
            sample(target_solid(scene.goals[g].target, scene.robot, scene.poses[p].q, scene.shape), count, int(s))
            for (g, p), s in zip(self.terms, seeds, strict=True)
        ]
        self.weights = np.array([scene.goal_weights[g] * scene.pose_weights[p] for g, p in self.terms]) / mountings

    def clouds(self, count: int) -> Cloud:
        """The first ``count`` points of each term as one cloud with a leading axis of terms.

        Whatever the count, the shape is the same, so that one compilation serves all.
        """
        blocks = -(-len(self.points[0]) // BLOCK)
        each = [cloud(points[:count], blocks=blocks) for points in self.points]
        return jax.tree.map(lambda *a: jnp.asarray(np.stack(a)), *each)


class CoverageObjective:
    """Weighted mean over a scene's goals and poses of what is aimed at, for setups with the links, counts and radii of
    ``setup``: of zeta, unless told otherwise.

    Setups are given by their values (3, R): positions, tilts and phases of the rings. Arithmetic is in 32 bit, which is
    enough for a search that the exact count judges. One object serves many threads, and compiles once for all clouds of
    its points, widths and numbers of setups.
    """

    def __init__(self, scene: Scene, setup: Setup, points: TargetPoints, aim: Aim | None = None) -> None:
        """Raises ValueError if a ring sits on a link that the robot has not, or the points are for other mountings."""
        self.scene, self.setup, self.aim = scene, setup, aim or Aim()
        if points.mountings != self.aim.mountings:
            raise ValueError(f"points are for {points.mountings} mountings, the aim has {self.aim.mountings}")
        self._errors, self._lost = self.aim.drawn(setup), self.aim.groups(setup)
        each = len(scene.goals) * len(scene.poses)
        self._pose = jnp.asarray([p + i // each * len(scene.poses) for i, (_, p) in enumerate(points.terms)])
        self._weights = jnp.asarray(points.weights, jnp.float32)
        frames = np.array([forward(scene.robot.chain, pose.q) for pose in scene.poses])
        self._frames = jnp.asarray(frames, jnp.float32)
        self._optics = tuple(jnp.asarray(a, jnp.float32) for a in sensor_optics(setup))
        self._soft = jax.jit(self._of_each)

    def _axes(self, values: Any) -> tuple[Any, Any]:
        """Apexes and axes (N, K, 3) at all poses, mounting by mounting."""
        where = (self.scene.robot, self.setup, RingValues(*values), self._frames)
        if self._errors is None:
            return sensor_axes(*where)
        apex, axis = (a.reshape(-1, *a.shape[2:]) for a in misplaced_axes(*where, self._errors))
        return apex, axis

    def _mean(self, values: Any, clouds: Cloud, width: Any, slopes: Any) -> tuple[Any, Any]:
        (apex, axis), pull_back = jax.vjp(self._axes, values)

        def terms(soft: Any, slopes: Any) -> Soft:
            def term(pose_cloud: Any) -> Any:
                pose, points = pose_cloud
                return soft(Cones(apex[pose], axis[pose], *self._optics), points, slopes)

            return _each(term, (self._pose, clouds))

        if self._lost is None:
            each = terms(lambda cones, points, slopes: soft_seen(cones, points, width, self.aim.seen, slopes=slopes), slopes)
            value = jnp.dot(self._weights, each.zeta)
        else:
            value, each = self._after_the_worst_loss(self._lost, terms, width, slopes)
        weighted = partial(jnp.multiply, self._weights[:, None, None])
        by_apex = jnp.zeros_like(apex).at[self._pose].add(weighted(each.by_apex))
        by_axis = jnp.zeros_like(axis).at[self._pose].add(weighted(each.by_axis))
        return value, pull_back((by_apex, by_axis))[0]

    def _after_the_worst_loss(self, lost: np.ndarray, terms: Any, width: Any, slopes: Any) -> tuple[Any, Any]:
        """The least of the zetas after each loss, softly: -s log sum exp(-zeta / s). Its slope is that of their mean by the
        weights that the soft minimum gives them, which takes a first run over all terms."""
        softness = width * _SOFTNESS

        def losses(weights: Any) -> Any:
            return lambda cones, points, slopes: soft_losses(cones, lost, points, width, weights, slopes=slopes)

        even = jnp.ones(int(lost.max()) + 1, self._weights.dtype)
        zetas = (self._weights[:, None] * terms(losses(even), False).zeta).sum(axis=0)
        weights = jax.nn.softmax(-zetas / softness)
        return -softness * jax.nn.logsumexp(-zetas / softness), terms(losses(weights), slopes)

    def _of_each(self, values: Any, count: Any, *where: Any) -> tuple[Any, Any]:
        """Of the first ``count`` setups of ``values``; the others only fill its shape, which is the same for any count."""

        def one(row: Any) -> Any:
            return jax.lax.cond(
                row[0], self._mean, lambda x, *_: (jnp.zeros((), x.dtype), jnp.zeros_like(x)), row[1], *where
            )

        return _each(one, (jnp.arange(len(values)) < count, values))

    def _in_pieces(self, values: Any, *where: Any) -> tuple[np.ndarray, np.ndarray]:
        size, found = _piece()[0], []
        for i in range(0, len(values), size):
            piece = values[i : i + size]
            padded = np.zeros((size, *piece.shape[1:]), np.float32)
            padded[: len(piece)] = piece
            found.append([np.asarray(a[: len(piece)], float) for a in self._soft(padded, len(piece), *where)])
        zetas, slopes = zip(*found, strict=True)
        return np.concatenate(zetas), np.concatenate(slopes)

    def soft(
        self, values: Float[np.ndarray, "S 3 R"], width: float, clouds: Cloud
    ) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, "S 3 R"]]:
        """Soft value in [0, 1] of S setups, and its gradients by positions, tilts and phases."""
        return self._in_pieces(values, clouds, float(width), True)

    def zetas(self, values: Float[np.ndarray, "S 3 R"], clouds: Cloud, width: float = SHARP) -> Float[np.ndarray, " S"]:
        """Soft value in [0, 1] of S setups without gradients, in a quarter of the time.

        At the default width it is the share of the points inside a cone, or as many as the aim asks for.
        """
        return self._in_pieces(values, clouds, float(width), False)[0]
