"""Detection in time: is a person who walks towards the moving robot reported before the separation
distance is broken?

The person (simulation/human.py, 1.75 m) walks straight towards the base's axis at v_h, from a
random direction and from beyond every sensor's range. A sensor sees the person as soon as any part
of the body is in its beam, within its effective range, and, except under ``ignore``, not occluded
by the robot or an obstacle. Under ``blind``, a one-zone sensor sees nothing beyond the first of
these in its beam; for a square beam this is the cone around it. A sighting that lasts for one
period is reported at the latest one period plus the latency after it began. A shorter one may fall
between two readings and does not count. The approach is detected in time if the first report
precedes the first moment at which any part of the robot is nearer to the person than that part's
S_p. Period and latency are excluded from the reaction time T_r in S_p, because the simulation
accounts for them.

A square beam counts by its inscribed cone. The robot does not slow down and the person does not
stop.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import stats

from ..coverage.definitions.definition import definition
from ..coverage.definitions.equality import equal_fields
from ..coverage.definitions.units import Covered
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.occlusion.ranging import slabs
from ..coverage.rings.ring import Setup, sensor_optics
from ..coverage.robots.robot import Robot
from ..coverage.solids.segments import segment_to_segment
from ..objectives.scene import Scene
from ..objectives.verified import High, Low
from .human import PEDESTAL, Bones, Posture, ball_counts, balls_along, bones
from .motion_samples import STEP, Moments
from .sightings import seen_by

STATURE = 1.75  # m
STRIDE = 0.83  # share of stature, length of one gait cycle
_ERROR = 0.01  # m, by which the body may protrude from the balls that sensors see
# m, from the largest range or separation distance to the start: a foot is up to half of it ahead
_BEYOND = 1.0
_AT_ONCE = 16  # approaches in memory
_SLAB = 1 << 9


@dataclass(frozen=True)
class Timing:
    """Timing of K sensors, s."""

    period: Float[np.ndarray, " K"]
    """Period of the readings."""
    latency: float
    """Latency of a report."""

    __eq__ = equal_fields

    @property
    def spent(self) -> Float[np.ndarray, " K"]:
        """Longest time (K,) from sighting to report."""
        return self.period + self.latency


@definition
class ApproachShare:
    """A share of approaches with its 95 % interval (Wilson)."""

    share: Annotated[float, Covered("percent")]
    """Share."""
    low: Low
    """Lower end of the interval."""
    high: High
    """Upper end of the interval."""


@dataclass(frozen=True)
class Approaches:
    """Results of A approaches.

    Distances are those between person and robot, in m.
    """

    azimuth: Float[np.ndarray, " A"]
    """Direction from which the person comes, rad."""
    moment: np.ndarray
    """Number of the motion's moment at the end of the walk, (A,)."""
    sight: Float[np.ndarray, " A"]
    """Distance at the first sighting."""
    report: Float[np.ndarray, " A"]
    """Distance at the first report; NaN without a report before contact."""
    due: Float[np.ndarray, " A"]
    """Distance when S_p was first broken."""
    broken_step: np.ndarray
    """Step of the walk at which S_p was first broken, (A,)."""
    in_time: Bool[np.ndarray, " A"]
    """Whether the report came in time."""
    walk: int
    """Number of steps of a walk."""

    __eq__ = equal_fields

    def share(self, chosen: slice | Bool[np.ndarray, " A"] = slice(None)) -> "ApproachShare":
        """Return the share of approaches in time."""
        in_time = self.in_time[chosen]
        ends = stats.binomtest(int(in_time.sum()), len(in_time)).proportion_ci(0.95, "wilson")
        return ApproachShare(in_time.mean(), *ends)


def floor_of(scene: Scene) -> float:
    """Return the height of the floor on which the person walks, m: the highest of the scene's
    floors, or ``PEDESTAL`` below the base."""
    floors = [float(o.body.offset[0]) for o in scene.obstacles if len(o.body.offset) == 1]
    return max(floors, default=-PEDESTAL)


def walker(speed: float, start: float, floor: float = -PEDESTAL) -> Bones:
    """Return a person who walks along -x from ``start`` m to the base's axis, sampled every
    ``STEP`` s on a floor of height ``floor`` m."""
    at = np.arange(start, 0, -speed * STEP)
    n, zero = len(at), np.zeros(len(at))
    phase = 2 * np.pi * (start - at) / (STRIDE * STATURE)
    place = np.stack([at, zero], axis=1)
    posture = Posture(
        place, np.full(n, np.pi), phase, zero + 1, zero, np.zeros((n, 2)), np.zeros((n, 2, 3))
    )
    return bones(STATURE, posture, floor)


@jax.jit
def _clearances(rows: tuple[jax.Array, ...], fixed: tuple[jax.Array, ...]) -> jax.Array:
    """Return, for R moments, the least distance between person and robot, and the least after S_p
    is subtracted, (R, 2) m."""
    a, b, start, end, required = rows
    thick, radius = fixed
    gap = segment_to_segment(a[:, :, None], b[:, :, None], start[:, None], end[:, None])
    gap = gap - thick[None, :, None] - radius[None, None]
    return jnp.stack([gap.min(axis=(1, 2)), (gap - required[:, None]).min(axis=(1, 2))], axis=1)


def turned(points: Float[np.ndarray, "*any 3"], angle: float) -> Float[np.ndarray, "*any 3"]:
    """Rotate points about the base's axis, z, by ``angle`` rad."""
    c, s = math.cos(angle), math.sin(angle)
    new: np.ndarray = points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return new


def start_of(robot: Robot, setup: Setup, moments: Moments) -> float:
    """Return the distance from the base's axis at which walks begin, m, beyond every range and
    separation distance."""
    half, range_m = sensor_optics(setup)
    far = max(float(np.hypot(*ends.T[:2]).max()) for ends in (moments.start, moments.end)) + float(
        moments.radius.max()
    )
    return (
        max(robot.reach, far)
        + max(float((range_m / np.cos(half)).max()), float(moments.required.max()))
        + _BEYOND
    )


def approach(
    scene: Scene,
    setup: Setup,
    moments: Moments,
    timing: Timing,
    azimuths: Float[np.ndarray, " A"],
    seed: int,
    occlusion: Occlusion = "shadow",
    start: float | None = None,
    tell: Callable[[int], object] = lambda done: None,
) -> Approaches:
    """Simulate a walk from each of ``azimuths`` that ends at a random moment of the motion.

    Args:
        scene: the robot, the person's speed and floor, and the obstacles, which occlude but do not
            stop the person.
        setup: the setup whose sensors observe.
        moments: moments of the motion; their separation distances exclude period and latency.
        timing: timing of the sensors.
        azimuths: directions (A,), rad.
        seed: random seed of the moments.
        occlusion: occlusion model.
        start: distance at which walks begin, m; by default ``start_of``.
        tell: receives the number of finished approaches.
    """
    rng, robot, obstacles = np.random.default_rng(seed), scene.robot, scene.obstacles
    start = start_of(robot, setup, moments) if start is None else start
    body = walker(scene.safety.human, start, floor_of(scene))
    steps = len(body.start)
    counts = ball_counts(np.linalg.norm(body.end[0] - body.start[0], axis=1), body.radius, _ERROR)
    which = np.stack([moments.drawn(rng, steps) for _ in azimuths])
    held, late = (np.ceil(s / STEP - 1e-9).astype(int) for s in (timing.period, timing.spent))
    columns = []
    for first in range(0, len(azimuths), _AT_ONCE):
        batch = slice(first, first + _AT_ONCE)
        a, b = (
            np.concatenate([turned(p, phi) for phi in azimuths[batch]])
            for p in (body.start, body.end)
        )
        at = which[batch].ravel()
        rows = (a, b, moments.start[at], moments.end[at], moments.required[at])
        clear = slabs(
            _clearances, rows, (jnp.asarray(body.radius), jnp.asarray(moments.radius)), _SLAB
        )
        balls, bodies = balls_along(a, b, body.radius, counts), tuple(o.body for o in obstacles)
        seen = seen_by(robot, setup, moments, at, balls, occlusion, bodies)
        shape = (len(which[batch]), steps)
        columns.append(_judged(clear.reshape(*shape, 2), seen.reshape(*shape, -1), held, late))
        tell(min(first + _AT_ONCE, len(azimuths)))
    sight, report, at_break, broken, in_time = (
        np.concatenate(c) for c in zip(*columns, strict=True)
    )
    return Approaches(azimuths, which[:, -1], sight, report, at_break, broken, in_time, steps)


def lasting(
    seen: Bool[np.ndarray, "A T K"], steps: Int[np.ndarray, " K"]
) -> Bool[np.ndarray, "A T K"]:
    """Return the steps from which on each sensor sees continuously for ``steps`` (K,) more
    steps."""
    total = np.cumsum(np.pad(seen, ((0, 0), (1, 0), (0, 0))), axis=1)
    end = np.arange(seen.shape[1])[:, None] + steps + 1
    count = np.take_along_axis(total, np.minimum(end, seen.shape[1])[None], axis=1) - total[:, :-1]
    all_of_them: np.ndarray = count == steps + 1
    return all_of_them


def _judged(
    clear: Float[np.ndarray, "A T 2"],
    seen: Bool[np.ndarray, "A T K"],
    held: Int[np.ndarray, " K"],
    late: Int[np.ndarray, " K"],
) -> tuple[np.ndarray, ...]:
    """Evaluate approaches.

    A sighting is detected up to one step late, and a report must precede the step at which S_p is
    broken; both err on the safe side.

    Args:
        clear: distance, and distance less S_p, m.
        seen: whether each sensor sees the person at each step.
        held: steps for which a sighting must last.
        late: steps from sighting to report.

    Returns:
        Distances at the first sighting, the first report and the first break of S_p, the step of
            the break, and whether the report came in time.
    """
    a, steps = clear.shape[:2]
    gap, margin = clear[..., 0], clear[..., 1]
    touched = np.where((gap <= 0).any(axis=1), (gap <= 0).argmax(axis=1), steps)
    broken = np.where((margin < 0).any(axis=1), (margin < 0).argmax(axis=1), steps)
    sight, start = (
        np.where(s.any(axis=1), s.argmax(axis=1), 2 * steps) for s in (seen, lasting(seen, held))
    )
    sight, report = sight.min(axis=1), (start + late).min(axis=1)

    def distance(step: Int[np.ndarray, " A"]) -> Float[np.ndarray, " A"]:
        ok = step < touched
        return np.where(ok, gap[np.arange(a), np.minimum(step, steps - 1)], np.nan)

    return (
        distance(sight),
        distance(report),
        distance(np.minimum(broken, steps - 1)),
        broken,
        report < broken,
    )


def seeing_as_far(setup: Setup, range_m: float) -> Setup:
    """Return the setup with every sensor's range raised to at least ``range_m`` m, with unchanged
    beams."""
    return setup.with_sensors(lambda own: replace(own, range_m=max(own.range_m, range_m)))
