"""Soft coverage of a setup as a function of its rings' values that JAX traces, over points of goals
at poses.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from ..coverage.arrays import Array
from ..coverage.occlusion.occlusion_mode import REPORTING, Occlusion
from ..coverage.rings.mounting_errors import Misplaced, misplaced
from ..coverage.rings.ring_kinematics import (
    RingArrays,
    SensorPoses,
    seen_from,
    sensor_poses,
)
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import carried_at, robot_capsules
from ..coverage.soft.beams import RingsAt, rings_at
from ..coverage.soft.estimator import (
    Choices,
    choices,
    covered,
    detected,
    log_uncovered,
    log_undetected,
)
from ..coverage.soft.line_of_sight import Occluding, occluding
from ..coverage.solids.capsules import Capsules
from ..coverage.solids.polyhedra import Polyhedron
from .criterion import Criterion
from .floors import floors, soft_minimum, worth
from .gap_goals import without_gaps
from .scene import Scene

_STRAIGHT = np.array([[[1.0, 0.0, 0.0]]], np.float32)  # the seat of a sensor that does not err
_ANYWHERE = 1e4  # m, radius of a ball that every beam meets
AT_ONCE = 1 << 17  # pairs of rings, or of sensors, and points at once: they fit in a cache
Term = tuple[int, int]  # goal and pose


class Sample(NamedTuple):
    """Points of T terms on which soft coverage is computed."""

    points: Float[Array, "T N 3"]
    """The points, m, base frame."""
    share: Float[Array, "*each"] | float = 1.0
    """Their share of all points, or that share times each one's weight (1, 1, N)."""
    rest: Float[Array, "T U"] | float = 0.0
    """Sum over the other points of the degree to which they count as covered, over all points."""


@partial(
    jax.tree_util.register_dataclass,
    data_fields=(
        *("goal", "pose", "mounting", "ball", "frames", "bodies", "obstacles"),
        *("weights", "of_pose", "floors"),
    ),
    meta_fields=("occlusion", "over_poses", "aim", "still"),
)
@dataclass(frozen=True)
class SoftTerms:
    """T terms, each the points of a goal at a pose in a mounting, and what the sensors see past.

    What depends on a scene are arrays, so that all scenes of one shape share one compilation.
    """

    goal: Int[Array, " T"]
    """Target of each term."""
    pose: Int[Array, " T"]
    """Pose of each term."""
    mounting: Int[Array, " T"]
    """Mounting of each term."""
    ball: Float[Array, " T"]
    """Radius of the ball about each point of a term that a beam is to meet, m."""
    frames: Float[Array, "P F 4 4"]
    """Frames of the robot, T_base_frame."""
    bodies: Capsules | None
    """Bodies of the robot (P, N); None where they hide nothing."""
    obstacles: list[tuple[Array, Array, Array, Array]]
    """Solids at P poses: normals (P, F, 3), offsets (P, F) m, edges (P, E, 2, 3) m, and faces."""
    weights: Float[Array, " G"]
    """Weights of the goals, summing to 1."""
    of_pose: Float[Array, " P"]
    """Weights of the poses, summing to 1."""
    floors: Float[Array, " G"]
    """Floors of the goals; see ``floors``."""
    occlusion: Occlusion
    """The occlusion model."""
    over_poses: Literal["mean", "worst"]
    """What counts over the poses."""
    aim: Criterion
    """The criterion."""
    still: int
    """Number of the cell's sensors, which come last."""

    @staticmethod
    def of(
        scene: Scene, terms: Sequence[Term], aim: Criterion, ball: Sequence[float] | None = None
    ) -> "SoftTerms":
        """Return the terms of a scene; for several mountings all of the first come first.

        ``ball`` is the radius of the ball about each point of a term that a beam is to meet, m,
        infinity where none must; by default 0.
        """
        scene = scene if ball is not None else without_gaps(scene)
        goal, pose = (np.array(column) for column in zip(*terms, strict=True))
        mounting = np.arange(len(terms)) // (len(terms) // aim.mountings)
        frames = np.array([forward(scene.robot.chain, p.q) for p in scene.poses], np.float32)
        bodies: Capsules | None = None
        obstacles = [_stacked([o.body] * len(frames)) for o in scene.obstacles]
        if scene.occlusion != "ignore":
            bodies = robot_capsules(scene.robot, frames)
            carried = [carried_at(scene.robot, T) for T in frames]
            obstacles += [_stacked(one) for one in zip(*carried, strict=True)]
        weights, of_pose, least = (
            a.astype(np.float32) for a in (scene.goal_weights, scene.pose_weights, floors(scene))
        )
        balls = np.minimum(np.zeros(len(terms)) if ball is None else ball, _ANYWHERE)
        return SoftTerms(
            *(
                goal,
                pose,
                mounting,
                balls.astype(np.float32),
                frames,
                bodies,
                obstacles,
                weights,
                of_pose,
                least,
            ),
            *(scene.occlusion, scene.over_poses, aim, len(scene.cell_sensors)),
        )

    def criterion(
        self,
        arrays: RingArrays,
        values: Any,
        sample: Sample,
        width: Any,
        chosen: Choices,
    ) -> tuple[Any, Any]:
        """Return the criterion, reduced for missed floors, and the degrees (T, U, N) to which the
        points count as covered; traceable.

        Args:
            arrays: the rings.
            values: their positions, tilts and phases.
            sample: the points.
            width: width of the sigmoid, m.
            chosen: result of ``choose`` for the same values and points.
        """
        zetas, degrees = self._zetas(arrays, values, sample, width, chosen)  # (T, U)
        share, weights = self.of_pose / self.aim.mountings, self.weights
        by_pose = jnp.zeros((len(weights), len(share), zetas.shape[1]), zetas.dtype)
        by_pose = by_pose.at[self.goal, self.pose].add(zetas)  # sums over the mountings
        goal = jnp.einsum("gpu,p->ug", by_pose, share)  # (U, G)
        mean = worth(goal, weights, self.floors)  # (U,)
        if self.aim.losing:
            return soft_minimum(mean, self._may_be_lost(arrays)), degrees
        if self.over_poses == "worst":
            at_pose = weights @ by_pose[..., 0] / self.aim.mountings  # (P,)
            return soft_minimum(at_pose) + mean[0] - goal[0] @ weights, degrees
        return mean[0], degrees

    def mean(self, arrays: RingArrays, values: Any, points: Any, width: Any, most: int) -> Any:
        """Return the weighted mean of soft ζ over goals and poses, without floors; NaN for values
        that are not finite or a width that is not above 0."""
        still, wide = jax.lax.stop_gradient((values, jnp.asarray(width, jnp.float32)))
        chosen = self.choose(arrays, still, points, wide, most)
        zetas = self._zetas(arrays, values, Sample(points), width, chosen)[0][:, 0]
        weights = self.weights[self.goal] * self.of_pose[self.pose] / self.aim.mountings
        sound = jnp.isfinite(values).all() & (width > 0) & jnp.isfinite(width)
        return (weights @ zetas) * jnp.where(sound, 1, jnp.nan).astype(zetas.dtype)

    def choose(
        self,
        arrays: RingArrays,
        values: Any,
        points: Any,
        width: Any,
        most: int,
    ) -> Choices:
        """Return what is discrete about the sensors, for each term; see ``criterion``."""
        rings, _, occluders = self._placed(arrays, values, None)

        def term(here: Any, hidden: Any, points: Any, ball: Any) -> Choices:
            return choices(here, points, most, width, hidden, ball)

        chosen: Choices = self._each_term(term, rings, occluders, points, self.ball)
        return chosen

    def _zetas(
        self,
        arrays: RingArrays,
        values: Any,
        sample: Sample,
        width: Any,
        chosen: Choices,
    ) -> tuple[Float[jax.Array, "T U"], Float[jax.Array, "T U N"]]:
        """Return the soft ζ of each term: one, or without each ring or sensor that may be lost; and
        the degrees to which points count as covered."""
        wide = jax.lax.stop_gradient(jnp.asarray(width, jnp.float32))
        rings, seat, hidden = self._placed(arrays, values, wide)
        sensors, detection = arrays.turn.shape[0], self.aim.detection

        def term(here: Any, hidden: Any, points: Any, ball: Any, chosen: Any, seat: Any) -> Any:
            if detection is not None and here.detectors is not None:
                missed = log_undetected(here, points, detection.extent, chosen, hidden, seat)
                return detected(missed, detection.at_least)
            free = log_uncovered(here, points, wide, chosen, hidden, seat, ball)
            return covered(free, chosen.near.sensor, sensors, self.aim.seen, self.aim.losing)

        seats = None if seat is None else seat[self.mounting]
        degrees = self._each_term(term, rings, hidden, sample.points, self.ball, chosen, seats)
        return sample.rest + (sample.share * degrees).mean(axis=-1), degrees

    def _placed(
        self, arrays: RingArrays, values: Any, width: Any
    ) -> tuple[RingsAt, Any, Occluding | None]:
        """Return rings and seats in all mountings at all poses, and what occludes at all poses;
        without the first returns if no ``width`` of the sigmoid is given."""
        arrays = jax.tree.map(
            lambda a: jnp.asarray(a, jnp.float32 if jnp.result_type(a).kind == "f" else None),
            arrays,
        )
        values = jnp.asarray(values, jnp.float32)
        values = jnp.pad(values, ((0, 0), (0, arrays.length.shape[0] - values.shape[1])))
        rings, seat = rings_at(arrays, values, self.frames, self._drawn(arrays))
        if seat is not None:
            seat = jnp.where(self._of_cell(arrays)[None, :, None], _STRAIGHT, seat)
        return rings, seat, self._occluding(arrays, values, width)

    def _each_term(self, function: Any, rings: Any, occluders: Any, *each: Any) -> Any:
        """Return the results of a function of the rings, the occluders and ``each`` for all
        terms; the first of ``each`` are the points."""

        def term(one: Any) -> Any:
            pose, mounting, *more = one
            here = jax.tree.map(lambda a: a[mounting, pose], rings)
            hidden = jax.tree.map(lambda a: a[mounting, pose], occluders)
            return function(here, hidden, *more)

        terms = (self.pose, self.mounting, *each)
        if len(self.pose) == 1:  # without an axis of terms it takes a third of the time
            one = term(jax.tree.map(lambda a: a[0], terms))
            return jax.tree.map(lambda a: a[None], one)
        points, *_ = each  # (T, N, 3)
        together = max(1, AT_ONCE // (points.shape[1] * rings.count.shape[-1] or 1))
        return jax.lax.map(term, terms, batch_size=together)

    def _occluding(self, arrays: RingArrays, values: Any, width: Any) -> Occluding | None:
        """Return what occludes the sensors at all poses; None if nothing does."""
        if self.bodies is None and not self.obstacles:
            return None
        bodies, mountings = self.bodies, self.aim.mountings
        if bodies is not None:
            radius = jnp.broadcast_to(bodies.radius, bodies.start.shape[:-1])
            bodies = Capsules(jnp.asarray(bodies.start), jnp.asarray(bodies.end), radius)
        if self.occlusion not in REPORTING and not self.obstacles:
            return Occluding(jax.tree.map(lambda a: jnp.stack([a] * mountings), bodies))
        frames = jnp.asarray(self.frames)
        seats = seen_from(arrays, self._mounted(arrays, values), frames, bool(arrays.beams.which))

        def at_pose(bodies: Any, solids: Any, seats: Any) -> Occluding:
            cones, obstacles = arrays.beams.solids(*seats), [Polyhedron(*one) for one in solids]
            return occluding(cones, bodies, obstacles, self.occlusion, width)

        axes = (0, [(0, 0, 0, None)] * len(self.obstacles), 0)
        everywhere = jax.vmap(jax.vmap(at_pose, axes), (None, None, 0))
        occluders: Occluding = everywhere(bodies, self.obstacles, seats)
        return occluders

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
        stays: Array = arrays.ring >= len(arrays.length) - self.still
        return stays

    def _may_be_lost(self, arrays: RingArrays) -> Bool[Array, " U"]:
        """Return which rings or sensors there are that may be lost."""
        seeing: Array = jnp.asarray(arrays.beams.range_m) > -jnp.inf
        seeing = seeing & ~self._of_cell(arrays)
        if self.aim.losing == "sensor":
            return seeing
        some = arrays.ring[None] == jnp.arange(self.units(arrays))[:, None]
        return (some & seeing[None]).any(axis=1)

    def units(self, arrays: RingArrays) -> int:
        """Return the number U of rings or sensors that may be lost; 1 if none may."""
        if not self.aim.losing:
            return 1
        each = arrays.length if self.aim.losing == "ring" else arrays.turn
        return each.shape[0]

    def _drawn(self, arrays: RingArrays) -> Misplaced | None:
        """Return the drawn errors of all rings but the cell's sensors, and of all sensors; None
        without errors."""
        still = self.still
        drawn = self.aim.drawn(arrays.length.shape[0] - still, arrays.turn.shape[0])
        return None if drawn is None else replace(drawn.beside(still), seat=drawn.seat)


def _stacked(each: Sequence[Polyhedron]) -> tuple[Any, Any, Any, Any]:
    """Return a solid at P poses; see ``SoftTerms.obstacles``."""
    keys = "normal", "offset", "edges"
    normal, offset, edges = (
        np.stack([np.asarray(getattr(b, key), np.float32) for b in each]) for key in keys
    )
    return normal, offset, edges, np.asarray(each[0].faces)
