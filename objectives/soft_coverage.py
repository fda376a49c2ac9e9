"""Soft coverage of a setup: a function of its rings' values that JAX differentiates.

The value is the criterion of a search on sample points, with soft beams: the weighted mean over
goals, poses and mountings, with floors, or the soft minimum over poses or losses.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from ..coverage.arrays import Array
from ..coverage.rings.mounting_errors import Misplaced, misplaced
from ..coverage.rings.ring_kinematics import (
    RingArrays,
    SensorPoses,
    seen_from,
    sensor_poses,
    with_base,
)
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import carried_at, robot_capsules
from ..coverage.soft.beams import RingsAt
from ..coverage.soft.estimator import SHARP, Choices, choices, log_uncovered
from ..coverage.soft.first_return import soft_stop
from ..coverage.soft.line_of_sight import Occluding
from ..coverage.solids.capsules import Capsules
from ..coverage.solids.polyhedra import Polyhedron, polyhedron_shadow
from ..coverage.solids.sensor_beams import BeamShapes, MixedBeams
from .criterion import Criterion
from .floors import worth
from .occlusion import check_bodies
from .scene import CoreScene

# of the soft minimum over N poses or losses, which exceeds the minimum by at most this times log N
TEMPERATURE = 0.005
_STRAIGHT = np.array([[[1.0, 0.0, 0.0]]], np.float32)  # the seat of a sensor that does not err
Term = tuple[int, int]  # goal and pose


class Sample(NamedTuple):
    """Points of T terms on which soft coverage is computed."""

    points: Float[Array, "T N 3"]
    """The points, m, base frame."""
    share: Float[Array, ""] | float = 1.0
    """Their share of all points."""
    rest: Float[Array, "T U"] | float = 0.0
    """Sum over the other points of the degree to which they count as covered, over all points."""


class SoftCoverage:
    """Soft coverage over a scene's goals and poses.

    One object compiles once for each number of rings and sensors, whatever their links and counts.
    """

    def __init__(
        self,
        scene: CoreScene,
        terms: Sequence[Term],
        points: Sequence[Float[np.ndarray, "N 3"]],
        aim: Criterion | None = None,
    ) -> None:
        """Store T terms; for several mountings all terms of the first come first.

        Args:
            scene: robot, poses, goals and occlusion.
            terms: goal and pose of each term.
            points: N points of each term, m, base frame.
            aim: the criterion; by default ζ itself.

        Raises:
            BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
        """
        self.scene, self.aim = scene, aim or Criterion()
        check_bodies(scene, scene.occlusion)
        self._goal, self._pose = (np.array(column) for column in zip(*terms, strict=True))  # (T,)
        self._mounting = np.arange(len(terms)) // (len(terms) // self.aim.mountings)  # (T,)
        self.all = Sample(jnp.asarray(np.stack(points), jnp.float32))
        frames = np.array([forward(scene.robot.chain, p.q) for p in scene.poses], np.float32)
        self._frames = frames  # (P, F, 4, 4)
        self._bodies: Capsules | None = None
        obstacles = [_stacked([o.body] * len(frames)) for o in scene.obstacles]
        if scene.occlusion != "ignore":
            self._bodies = robot_capsules(scene.robot, frames)
            carried = [carried_at(scene.robot, T) for T in frames]
            obstacles += [_stacked(one) for one in zip(*carried, strict=True)]
        self._obstacles = obstacles
        self._chosen = jax.jit(self.choose, static_argnums=4)
        self._compiled = jax.jit(self.criterion)
        self._mean = jax.jit(self._of_all, static_argnums=3)
        self._slope = jax.jit(jax.value_and_grad(self.criterion, argnums=1, has_aux=True))

    def share(
        self, arrays: RingArrays, values: Any, width: float = SHARP, sample: Sample | None = None
    ) -> float:
        """Return the soft coverage; by default the share of all points that are in a beam."""
        values, width = jnp.asarray(values, jnp.float32), jnp.float32(width)
        sample = sample or self.all
        chosen = self._chosen(arrays, values, sample.points, width, self.near(arrays))
        return float(self._compiled(arrays, values, sample, width, chosen)[0])

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
        (value, _), slope = self._both(arrays, values, width, sample or self.all)
        return float(value), np.asarray(slope, float)

    def first(self, count: int) -> Sample:
        """Return the first ``count`` points of each term, or somewhat fewer, as ``undecided``
        does."""
        n = self.all.points.shape[1]
        return Sample(self.all.points[:, : -(-n // max(-(-n // count), 1))])

    def undecided(self, arrays: RingArrays, values: Any, width: float, count: int) -> Sample:
        """Return the ``count`` points of each term that are nearest to being covered or not, with
        what the others contribute.

        Small moves of the rings change what is covered at these points only.
        """
        points = np.asarray(self.all.points)  # (T, N, 3)
        n, count = points.shape[1], self.first(count).points.shape[1]
        if count == n:
            return self.all
        padded = np.concatenate([points, points[:, : -n % count]], axis=1)
        parts = [
            np.asarray(self._both(arrays, values, width, Sample(jnp.asarray(some)))[0][1])
            for some in np.split(padded, padded.shape[1] // count, axis=1)
        ]
        covered = np.concatenate(parts, axis=2)[:, :, :n]  # (T, U, N)
        nearness = (covered * (1 - covered)).max(axis=1)  # (T, N)
        order = np.argsort(-nearness, axis=1, kind="stable")
        some = np.take_along_axis(points, order[:, :count, None], axis=1)
        others = np.take_along_axis(covered, order[:, None, count:], axis=2)
        rest = jnp.asarray(others.sum(axis=2, dtype=float) / n, jnp.float32)
        return Sample(jnp.asarray(some), jnp.float32(count / n), rest)

    def _both(self, arrays: RingArrays, values: Any, width: float, sample: Sample) -> Any:
        # two compiled functions: in one, XLA would compute the choices again for each part of the
        # gradient
        values, width = jnp.asarray(values, jnp.float32), jnp.float32(width)
        chosen = self._chosen(arrays, values, sample.points, width, self.near(arrays))
        share, rest = jnp.float32(sample.share), jnp.asarray(sample.rest, jnp.float32)
        units = self._units(arrays)
        rest = jnp.broadcast_to(rest, (len(self._pose), units))
        whole = Sample(sample.points, share, rest)
        return self._slope(arrays, values, whole, width, chosen)

    def mean(
        self, arrays: RingArrays, values: Float[Array, "3 R"], width: Float[Array, ""] | float
    ) -> Float[jax.Array, ""]:
        """Return the weighted mean of soft ζ over goals and poses, without floors; differentiable
        by the values, and works under ``jit`` and ``vmap``.

        It is NaN for values that are not finite or a width that is not above 0, which the sums over
        points would turn into a number.
        """
        mean: jax.Array = self._mean(arrays, jnp.asarray(values), width, self.near(arrays))
        return mean

    def _of_all(self, arrays: RingArrays, values: Any, width: Any, most: int) -> Any:
        """Return the mean on all points."""
        still, wide = jax.lax.stop_gradient((values, jnp.asarray(width, jnp.float32)))
        chosen = self.choose(arrays, still, self.all.points, wide, most)
        zetas = self._zetas(arrays, values, self.all, width, chosen)[0][:, 0]
        weights = self.scene.goal_weights[self._goal] * self.scene.pose_weights[self._pose]
        mean = jnp.asarray(weights / self.aim.mountings, zetas.dtype) @ zetas
        sound = jnp.isfinite(values).all() & (width > 0) & jnp.isfinite(width)
        return mean * jnp.where(sound, 1, jnp.nan).astype(zetas.dtype)

    def near(self, arrays: RingArrays, largest: int | None = None) -> int:
        """Return how many sensors of a ring count at a point: two, or more where beams overlap or
        several sensors must see it.

        Args:
            arrays: the rings.
            largest: the largest number of sensors of a ring; by default that of ``arrays``.
        """
        each = arrays.beams
        half = np.asarray(each.half_angle)
        if each.half_up is not None:
            half = np.maximum(half, np.arctan(np.hypot(np.tan(half), np.tan(each.half_up))))
        if each.special is not None:
            half = np.where(np.asarray(each.special.half_thickness) > 0, math.pi, half)
        seeing = np.asarray(each.range_m) > 0
        if largest is None:
            largest = int(np.bincount(np.asarray(arrays.ring)[seeing]).max(initial=1))
        overlap = math.ceil(float(half[seeing].max(initial=0.0)) * largest / math.pi)
        more = self.aim.seen - 1 + (self.aim.losing == "sensor")
        return min(largest, max(2, overlap) + more)

    def criterion(
        self,
        arrays: RingArrays,
        values: Any,
        sample: Sample,
        width: Any,
        chosen: Choices,
        counts: Any = None,
    ) -> tuple[Any, Any]:
        """Return the criterion, reduced for missed floors, and the degrees (T, U, N) to which the
        points count as covered; traceable.

        Args:
            arrays: the rings.
            values: their positions, tilts and phases.
            sample: the points.
            width: width of the sigmoid, m.
            chosen: result of ``choose`` for the same values and points.
            counts: real numbers of sensors of the rings; None: those of ``arrays``.
        """
        zetas, covered = self._zetas(arrays, values, sample, width, chosen, counts)  # (T, U)
        scene, goals, poses = self.scene, len(self.scene.goals), len(self.scene.poses)
        share = jnp.asarray(scene.pose_weights / self.aim.mountings, zetas.dtype)
        by_pose = jnp.zeros((goals, poses, zetas.shape[1]), zetas.dtype)
        by_pose = by_pose.at[self._goal, self._pose].add(zetas)  # sums over the mountings
        weights = jnp.asarray(scene.goal_weights, zetas.dtype)
        goal = jnp.einsum("gpu,p->ug", by_pose, share)  # (U, G)
        mean = worth(goal, scene)  # (U,)
        if self.aim.losing:
            return _soft_minimum(mean, self._may_be_lost(arrays)), covered
        if scene.over_poses == "worst":
            at_pose = weights @ by_pose[..., 0] / self.aim.mountings  # (P,)
            return _soft_minimum(at_pose) + mean[0] - goal[0] @ weights, covered
        return mean[0], covered

    def choose(
        self,
        arrays: RingArrays,
        values: Any,
        points: Any,
        width: Any,
        most: int,
        counts: Any = None,
    ) -> Choices:
        """Return what is discrete about the sensors, for each term; see ``criterion``."""
        rings, _, occluding = self._placed(arrays, values, counts)

        def term(here: Any, hidden: Any, points: Any) -> Choices:
            return choices(here, points, most, width, hidden)

        chosen: Choices = self._each_term(term, rings, occluding, points)
        return chosen

    def _zetas(
        self,
        arrays: RingArrays,
        values: Any,
        sample: Sample,
        width: Any,
        chosen: Choices,
        counts: Any = None,
    ) -> tuple[Float[jax.Array, "T U"], Float[jax.Array, "T U N"]]:
        """Return the soft ζ of each term: one, or without each ring or sensor that may be lost; and
        the degrees to which points count as covered."""
        wide = jax.lax.stop_gradient(jnp.asarray(width, jnp.float32))
        rings, seat, occluding = self._placed(arrays, values, counts)
        sensors = arrays.turn.shape[0]

        def term(here: Any, hidden: Any, points: Any, chosen: Choices, seat: Any) -> Any:
            free = log_uncovered(here, points, wide, chosen, hidden, seat)
            return self._covered(free, chosen.near.sensor, sensors)

        seats = None if seat is None else seat[self._mounting]
        covered = self._each_term(term, rings, occluding, sample.points, chosen, seats)
        return sample.rest + sample.share * covered.mean(axis=-1), covered

    def _placed(
        self, arrays: RingArrays, values: Any, counts: Any
    ) -> tuple[RingsAt, Any, Occluding | None]:
        """Return rings and seats in all mountings at all poses, and what occludes at all poses."""
        arrays = jax.tree.map(
            lambda a: jnp.asarray(a, jnp.float32 if jnp.result_type(a).kind == "f" else None),
            arrays,
        )
        values = jnp.asarray(values, jnp.float32)
        values = jnp.pad(values, ((0, 0), (0, arrays.length.shape[0] - values.shape[1])))
        rings, seat = _rings_at(arrays, values, self._frames, self._drawn(arrays))
        if counts is not None:
            held = rings.count[..., len(counts) :]
            every = jnp.broadcast_to(counts, (*held.shape[:-1], len(counts)))
            rings = replace(rings, count=jnp.concatenate([every, held], axis=-1))
        if seat is not None:
            seat = jnp.where(self._of_cell(arrays)[None, :, None], _STRAIGHT, seat)
        return rings, seat, self._occluding(arrays, values)

    def _each_term(self, function: Any, rings: Any, occluding: Any, *each: Any) -> Any:
        """Return the results of a function of the rings, the occluders and ``each`` for all
        terms."""

        def term(one: Any) -> Any:
            pose, mounting, *more = one
            here = jax.tree.map(lambda a: a[mounting, pose], rings)
            hidden = jax.tree.map(lambda a: a[mounting, pose], occluding)
            return function(here, hidden, *more)

        terms = (self._pose, self._mounting, *each)
        if len(self._pose) == 1:  # a loop takes longer to compile
            one = term(jax.tree.map(lambda a: a[0], terms))
            return jax.tree.map(lambda a: a[None], one)
        return jax.lax.map(term, terms)

    def _occluding(self, arrays: RingArrays, values: Any) -> Occluding | None:
        """Return what occludes the sensors at all poses; None if nothing does."""
        if self._bodies is None and not self._obstacles:
            return None
        bodies, mountings = self._bodies, self.aim.mountings
        if bodies is not None:
            radius = jnp.broadcast_to(bodies.radius, bodies.start.shape[:-1])
            bodies = Capsules(jnp.asarray(bodies.start), jnp.asarray(bodies.end), radius)
        blind = self.scene.occlusion == "blind"
        if not blind and not self._obstacles:
            return Occluding(jax.tree.map(lambda a: jnp.stack([a] * mountings), bodies))
        frames = jnp.asarray(self._frames)
        seats = seen_from(arrays, self._mounted(arrays, values), frames, arrays.beams.square)
        solids = [(*(jnp.asarray(a) for a in at), faces) for at, faces in self._obstacles]

        def at_pose(bodies: Any, solids: Any, seats: Any) -> Occluding:
            cones = arrays.beams.solids(*seats)
            obstacles = tuple(Polyhedron(*one) for one in solids)
            planes = tuple(polyhedron_shadow(cones.apex, one) for one in obstacles)
            if not blind:
                return Occluding(bodies, planes)
            zoned = cones.zoned if isinstance(cones, MixedBeams) else False
            stop = soft_stop(cones.around(), bodies, obstacles)
            stop = jnp.where(zoned, jnp.inf, stop)
            return Occluding(bodies, planes, stop) if zoned is not False else Occluding(stop=stop)

        axes = (0, [(0, 0, 0, None)] * len(solids), 0)
        everywhere = jax.vmap(jax.vmap(at_pose, axes), (None, None, 0))
        occluding: Occluding = everywhere(bodies, solids, seats)
        return occluding

    def _mounted(self, arrays: RingArrays, values: Any) -> SensorPoses:
        """Return the poses of sensors (D, K, 3) in all mountings."""
        meant = sensor_poses(arrays, *values)
        nominal = SensorPoses(*(v[None] for v in meant))
        drawn = self._drawn(arrays)
        if drawn is None:
            return nominal
        stays = self._of_cell(arrays)[None, :, None]
        return SensorPoses(
            *(
                jnp.where(stays, a, b)
                for a, b in zip(nominal, misplaced(arrays, meant, drawn), strict=True)
            )
        )

    def _of_cell(self, arrays: RingArrays) -> Bool[Array, " K"]:
        """Return which sensors are the cell's; padding ones may follow them."""
        stays: Array = arrays.ring >= len(arrays.length) - len(self.scene.cell_sensors)
        return stays

    def _may_be_lost(self, arrays: RingArrays) -> Bool[Array, " U"]:
        """Return which rings or sensors there are that may be lost."""
        seeing = jnp.asarray(arrays.beams.range_m) > -jnp.inf
        if self.aim.losing == "sensor":
            return seeing & ~self._of_cell(arrays)
        some = arrays.ring[None] == jnp.arange(self._units(arrays))[:, None]
        return (some & seeing[None]).any(axis=1)

    def _units(self, arrays: RingArrays) -> int:
        """Return the number U of rings or sensors that may be lost; 1 if none may."""
        if not self.aim.losing:
            return 1
        each = arrays.length if self.aim.losing == "ring" else arrays.turn
        return each.shape[0]

    def _drawn(self, arrays: RingArrays) -> Misplaced | None:
        """Return the drawn errors of all rings but the cell's sensors, and of all sensors; None
        without errors."""
        still = len(self.scene.cell_sensors)
        drawn = self.aim.drawn(arrays.length.shape[0] - still, arrays.turn.shape[0])
        return None if drawn is None else replace(drawn.beside(still), seat=drawn.seat)

    def _covered(self, log_uncovered: Any, sensor: Any, sensors: int) -> Float[jax.Array, "U N"]:
        """Return the degree to which points count as covered, without each ring or sensor that may
        be lost, if one may."""
        if self.aim.seen > 1:
            multiplicity = -jnp.expm1(log_uncovered).sum(axis=(0, 1))
            return jnp.clip(multiplicity - (self.aim.seen - 1), 0.0, 1.0)[None]
        total = log_uncovered.sum(axis=(0, 1))
        covered = -jnp.expm1(total)[None]  # (1, N)
        if not self.aim.losing:
            return covered
        if self.aim.losing == "ring":
            return -jnp.expm1(total[None] - log_uncovered.sum(axis=1))
        alone = jnp.exp(total[None, None] - log_uncovered) - jnp.exp(total)[None, None]  # (G, M, N)
        n = jnp.broadcast_to(jnp.arange(alone.shape[2]), alone.shape)
        each = jnp.zeros((sensors, alone.shape[2]), alone.dtype).at[sensor, n].add(alone)
        return covered - each


def _rings_at(
    arrays: RingArrays, values: Any, frames: Float[Array, "P F 4 4"], drawn: Misplaced | None
) -> tuple[RingsAt, Any]:
    """Return the rings in all D mountings at all P poses, and the seats (D, K, 3) of sensors; see
    ``soft_views``."""
    position, tilt, phase = values
    own = arrays.ring[None] == jnp.arange(len(arrays.length))[:, None]
    own = own & (arrays.beams.range_m > -jnp.inf)[None]  # (G, K)
    first = own.argmax(axis=1)
    shapes: BeamShapes = jax.tree.map(lambda a: a[first], arrays.beams)
    frame = jnp.stack([arrays.zero, arrays.side, arrays.axis], axis=-2)[None]  # (1, G, 3, 3)
    height, seat = (position * arrays.length)[None], None  # (1, G)
    if drawn is not None:
        turn = Rotation.from_rotvec(np.asarray(drawn.turn).reshape(-1, 3)).as_matrix()
        turn = jnp.asarray(turn.reshape(*drawn.turn.shape, 3), jnp.float32)  # (D, G, 3, 3)
        frame = turn.swapaxes(-1, -2) @ frame
        height = height + jnp.asarray(drawn.slip, jnp.float32)
        seat = _seats(drawn)
    centre = arrays.start[None] + height[..., None] * arrays.axis[None]  # (D, G, 3)
    T = with_base(jnp.asarray(frames))[:, arrays.frame]  # (P, G, 4, 4)
    rotation, origin = T[..., :3, :3], T[..., :3, 3]
    centre = jnp.einsum("pgij,dgj->dpgi", rotation, centre, precision="highest") + origin[None]
    frame = jnp.einsum("pgij,dgkj->dpgki", rotation, frame, precision="highest")

    def everywhere(a: Any) -> Any:
        return jnp.broadcast_to(a, (*centre.shape[:-1], *a.shape[1:]))

    rest = (tilt, phase, own.sum(axis=1).astype(jnp.float32), first, arrays.radius, shapes)
    zero, side, axis = (frame[..., i, :] for i in range(3))
    return RingsAt(centre, axis, zero, side, *jax.tree.map(everywhere, rest)), seat


def _seats(drawn: Misplaced) -> Float[jax.Array, "D K 3"]:
    """Return the direction of each sensor's axis by its intended axis, up vector and ring."""
    astray = np.hypot(drawn.seat[..., 0], drawn.seat[..., 1])
    aside = np.sinc(astray / np.pi)[..., None] * drawn.seat
    return jnp.asarray(np.concatenate([np.cos(astray)[..., None], aside], axis=-1), jnp.float32)


def _stacked(each: Sequence[Polyhedron]) -> tuple[list[np.ndarray], np.ndarray]:
    """Return a solid at P poses: normals (P, F, 3), offsets (P, F) m, edges (P, E, 2, 3) m; and its
    faces."""
    keys = "normal", "offset", "edges"
    at_poses = [np.stack([np.asarray(getattr(b, key), np.float32) for b in each]) for key in keys]
    return at_poses, np.asarray(each[0].faces)


def _soft_minimum(values: Float[jax.Array, " N"], some: Any = True) -> Float[jax.Array, ""]:
    """Return -T log(mean(exp(-v / T))) of some values."""
    some = jnp.broadcast_to(some, values.shape)
    count = jnp.maximum(some.sum(), 1).astype(values.dtype)
    least = jax.nn.logsumexp(-values / TEMPERATURE, where=some) - jnp.log(count)
    return -TEMPERATURE * least
