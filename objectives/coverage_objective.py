"""What the search climbs: its aim, weighted over targets and poses, soft with a gradient, and as a share of points."""

from collections.abc import Callable
from functools import partial
from threading import Lock
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..coverage.capsules import Capsules, robot_capsules
from ..coverage.chain import forward
from ..coverage.cloud import BLOCK, Cloud, cloud
from ..coverage.mounting import misplaced_axes, misplaced_beams
from ..coverage.optics import optics
from ..coverage.points import sample
from ..coverage.slots import Slots, slot_axes, slot_beams
from ..coverage.soft import SHARP, Seen, Soft
from ..coverage.soft_cell import InCell
from ..coverage.soft_hidden import Hidden
from ..coverage.soft_loss import soft_losses
from ..coverage.soft_seen import soft_seen
from ..coverage.solids import Cones
from .aim import Aim, check_aim
from .scene import Scene
from .space import Stretch, decode

MARGIN = 0.003  # above a floor, so that a soft value that reaches it does so when counted
TEMPERATURE = 0.005  # of the soft minimum over P poses, which exceeds the minimum by at most this times log P
STEEP = 100.0  # of the parabola under a floor: 0.01 short costs 0.01, and 2 for each further
_SOFTNESS = 0.1  # of the minimum over losses, for each m of a sigmoid's width
_PIECE = {"cpu": (16, None)}  # setups in one call, and how many of these at once: on a CPU one after the other,
_PIECE_ELSEWHERE = (256, 4)  # on an accelerator several, as memory holds them


def _each(function: Callable[[Any], Any], arrays: Any) -> Any:
    """``function`` along the first axis of ``arrays``, as many at once as suits the device."""
    return jax.lax.map(function, arrays, batch_size=_piece()[1])


def _piece() -> tuple[int, int | None]:
    return _PIECE.get(jax.default_backend(), _PIECE_ELSEWHERE)


def _soft_minimum(zetas: Any, among: Any) -> tuple[Any, Any]:
    """The soft minimum of some of the zetas (P,), and its slope by each."""
    lack = jnp.where(among, -zetas / TEMPERATURE, -jnp.inf)
    count = jnp.sum(among, dtype=zetas.dtype)
    return TEMPERATURE * (jnp.log(count) - jax.nn.logsumexp(lack)), jax.nn.softmax(lack)


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
            sample(scene.solid(scene.goals[g].target, p), count, int(s)) for (g, p), s in zip(self.terms, seeds, strict=True)
        ]

    def clouds(self, count: int) -> Cloud:
        """The first ``count`` points of each term as one cloud with a leading axis of terms.

        Whatever the count, the shape is the same, so that one compilation serves all.
        """
        blocks = -(-len(self.points[0]) // BLOCK)
        each = [cloud(points[:count], blocks=blocks) for points in self.points]
        return jax.tree.map(lambda *a: jnp.asarray(np.stack(a)), *each)


class CoverageObjective:
    """Weighted mean over a scene's goals and poses of what is aimed at (zeta, unless told otherwise), for setups with one
    number of rings and sensors; where the scene asks for the worst pose, the soft minimum over the poses of the mean over
    the goals, -T log(mean(exp(-zeta / T))).

    A setup is given by its arrays (``Slots`` and ``Stretch``) and its values (3, R), which ``decode`` reads. A goal whose
    zeta falls short of its floor lowers the value by a steep parabola. Arithmetic is in 32 bit, which is enough for a search
    that the exact count judges. One object serves many threads, and compiles once for all clouds of its points, widths,
    links, counts and numbers of setups.
    """

    def __init__(self, scene: Scene, points: TargetPoints, aim: Aim | None = None) -> None:
        """Take the scene's goals and poses, and the points that were drawn for them and for the aim's mountings.

        Raises:
            ValueError: if the points are for another number of mountings, or the goals have floors that the aim cannot keep.
        """
        self.scene, self.aim = scene, aim or Aim()
        if points.mountings != self.aim.mountings:
            raise ValueError(f"points are for {points.mountings} mountings, the aim has {self.aim.mountings}")
        check_aim(scene, self.aim)
        self._goal, self._pose = (jnp.asarray(column) for column in zip(*points.terms, strict=True))
        mounting = np.arange(len(points.terms)) // (len(points.terms) // points.mountings)
        self._view = self._pose + jnp.asarray(mounting * len(scene.poses))
        self._goal_weights = jnp.asarray(scene.goal_weights, jnp.float32)
        self._floors = jnp.asarray([g.at_least + MARGIN if g.at_least > 0 else -1.0 for g in scene.goals], jnp.float32)
        frames = np.array([forward(scene.robot.chain, pose.q) for pose in scene.poses])
        self._frames = jnp.asarray(frames, jnp.float32)
        self._bodies = None
        if scene.occlusion != "ignore":
            self._bodies = jax.tree.map(partial(jnp.asarray, dtype=jnp.float32), robot_capsules(scene.robot, frames))
        self._soft, self._compiling, self._compiled = jax.jit(self._of_each), Lock(), False

    def _mean(self, slots: Slots, where: Stretch, values: Any, clouds: Cloud, poses: Any, width: Any, slopes: Any) -> Any:
        """Value, gradient and zeta pose by pose (P,) of one setup; ``poses`` (P,): weights of the poses, of which those of
        weight 0 are not looked at."""
        seen, pull_back = jax.vjp(partial(self._views, slots, where), values)
        apex = seen[0]
        share = poses[self._pose] / self.aim.mountings

        def terms(soft: Callable[[Seen, Cloud], Soft], zetas: tuple[int, ...] = ()) -> Soft:
            def look(row: Any) -> Any:
                view, pose, points = row
                apex, axis, *rest = (part[view] for part in seen)
                up = rest[0] if rest else None
                looks = optics(apex, axis, slots.half_angle, slots.range_m, up, slots.half_up)
                return soft(self._past(looks, pose), points)

            def skip(_: Any) -> Soft:
                return Soft(jnp.zeros(zetas, apex.dtype), *(jnp.zeros_like(part[0]) for part in seen))

            return _each(lambda row: jax.lax.cond(poses[row[1]] > 0, look, skip, row), (self._view, self._pose, clouds))

        by_pose = jnp.zeros_like(poses)
        if self.aim.losing is None:
            each = terms(lambda cones, points: soft_seen(cones, points, width, self.aim.seen, slopes=slopes))
            zeta = jnp.zeros_like(self._goal_weights).at[self._goal].add(share * each.zeta)
            by_pose = by_pose.at[self._pose].add(self._goal_weights[self._goal] * each.zeta / self.aim.mountings)
            short = jnp.maximum(self._floors - zeta, 0.0)
            worth = self._goal_weights + 2 * STEEP * short
            value = jnp.dot(self._goal_weights, zeta) - STEEP * jnp.dot(short, short)
        else:
            worth = self._goal_weights
            value, each = self._after_the_worst_loss(slots, terms, share * worth[self._goal], width, slopes)
        pull = share * worth[self._goal]
        if self.scene.over_poses == "worst":
            least, weights = _soft_minimum(by_pose, poses > 0)
            value = least - STEEP * jnp.dot(short, short)
            pull = pull + (weights - poses)[self._pose] * self._goal_weights[self._goal]
        weighted = partial(jnp.multiply, pull[:, None, None])
        slopes_of = (slope for slope in (each.by_apex, each.by_axis, each.by_up) if slope is not None)
        by = tuple(jnp.zeros_like(apex).at[self._view].add(weighted(slope)) for slope in slopes_of)
        return value, pull_back(by)[0], by_pose

    def _views(self, slots: Slots, where: Stretch, values: Any) -> tuple[Any, ...]:
        """Apexes, axes and, where beams may be square, ups (N, K, 3) at all poses, mounting by mounting."""
        position, tilt, phase = decode(where, values)
        errors = self.aim.drawn(slots.length.shape[0], slots.ring.shape[0])
        if errors is None:
            seen = slot_axes if slots.half_up is None else slot_beams
            return seen(slots, position, tilt, phase, self._frames)
        drawn = misplaced_axes if slots.half_up is None else misplaced_beams
        found = drawn(slots, position, tilt, phase, self._frames, errors)
        return tuple(part.reshape(-1, *part.shape[2:]) for part in found)

    def _past(self, cones: Cones, pose: Any) -> Seen:
        """What the scene's occlusion and obstacles leave of cones at a pose."""
        seen: Cones | Hidden = cones
        if self._bodies is not None:
            start, end, radius = self._bodies
            seen = Hidden(cones, Capsules(start[pose], end[pose], radius), self.scene.occlusion)
        return InCell(seen, tuple(o.body for o in self.scene.obstacles)) if self.scene.obstacles else seen

    def _after_the_worst_loss(self, slots: Slots, terms: Any, share: Any, width: Any, slopes: Any) -> tuple[Any, Soft]:
        """The least of the zetas after each loss, softly: -s log sum exp(-zeta / s). Its slope is that of their mean by the
        weights that the soft minimum gives them, which takes a first run over all terms."""
        lost = slots.ring if self.aim.losing == "ring" else jnp.arange(slots.ring.shape[0])
        losses = (slots.length if self.aim.losing == "ring" else slots.ring).shape
        softness = width * _SOFTNESS

        def run(weights: Any, slopes: Any) -> Soft:
            return terms(lambda cones, points: soft_losses(cones, lost, points, width, weights, slopes=slopes), losses)

        zetas = (share[:, None] * run(jnp.ones(losses, share.dtype), False).zeta).sum(axis=0)
        weights = jax.nn.softmax(-zetas / softness)
        return -softness * jax.nn.logsumexp(-zetas / softness), run(weights, slopes)

    def _of_each(self, setups: Any, values: Any, count: Any, *where: Any) -> tuple[Any, Any, Any]:
        """Of the first ``count`` setups; the others only fill their shape, which is the same for any count."""

        def one(row: Any) -> Any:
            wanted, (slots, stretch), x = row
            nothing = jnp.zeros((), x.dtype), jnp.zeros_like(x), jnp.zeros(len(self.scene.poses), x.dtype)
            return jax.lax.cond(wanted, lambda: self._mean(slots, stretch, x, *where), lambda: nothing)

        return _each(one, (jnp.arange(len(values)) < count, setups, values))

    def _in_pieces(self, setups: Any, values: Any, *where: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        size, found = _piece()[0], []
        for i in range(0, len(values), size):
            index = np.minimum(np.arange(i, i + size), len(values) - 1)
            n = min(size, len(values) - i)
            some, x = jax.tree.map(lambda a, index=index: _narrow(a[index]), (setups, np.asarray(values)))
            found.append([np.asarray(a[:n], float) for a in self._run(some, x, n, *where)])
        zetas, slopes, by_pose = (np.concatenate(part) for part in zip(*found, strict=True))
        return zetas, slopes, by_pose

    def _run(self, *arguments: Any) -> Any:
        """The first call alone, so that of several threads only one compiles."""
        if self._compiled:
            return self._soft(*arguments)
        with self._compiling:
            found = self._soft(*arguments)
            self._compiled = True
        return found

    def soft(
        self, setups: Any, values: Float[np.ndarray, "S 3 R"], width: float, clouds: Cloud, poses: Any = None
    ) -> tuple[Float[np.ndarray, " S"], Float[np.ndarray, "S 3 R"]]:
        """Soft values of S setups, and their gradients by the setups' values.

        Args:
            setups: their ``(Slots, Stretch)``, stacked along a first axis.
            values: of the rings, as ``decode`` reads them.
            width: of the sigmoid, m.
            clouds: points of every goal at every pose.
            poses: weights (P,) of the poses, by default the scene's.
        """
        return self._in_pieces(setups, values, clouds, self._weights(poses), float(width), True)[:2]

    def zetas(
        self, setups: Any, values: Float[np.ndarray, "S 3 R"], clouds: Cloud, width: float = SHARP, poses: Any = None
    ) -> Float[np.ndarray, " S"]:
        """Soft values of S setups without gradients, in a quarter of the time.

        At the default width zeta is the share of the points inside a cone.
        """
        return self._in_pieces(setups, values, clouds, self._weights(poses), float(width), False)[0]

    def by_pose(
        self, setups: Any, values: Float[np.ndarray, "S 3 R"], clouds: Cloud, width: float = SHARP
    ) -> Float[np.ndarray, "S P"]:
        """Soft zeta of S setups at every pose, the weighted mean over the goals."""
        return self._in_pieces(setups, values, clouds, self._weights(None), float(width), False)[2]

    def _weights(self, poses: Any) -> Any:
        return jnp.asarray(self.scene.pose_weights if poses is None else poses, jnp.float32)


def _narrow(array: Any) -> Any:
    return array.astype(np.float32) if array.dtype.kind == "f" else array.astype(np.int32)
