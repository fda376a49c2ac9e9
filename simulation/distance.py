"""The minimum-distance study: the true distance of a person or an object from the robot, and the
distance that the rings measure.

The true distance is the least one between the robot's bodies and the object, 0 in contact. The
measured distance is derived from the sensors' readings. A one-zone sensor gives a range without a
direction, so the system assumes a point at that range on the beam's axis. The *believed* distance
is the least one between such a point and the robot's bodies. Without any reading it is the sensors'
range: nothing is nearer than they see. The *careful* distance is the least one from the robot of
any point at the reading in the beam, sampled on the axis and two circles around it.

Errors are counted while the true distance is below the range. A moment is in the near zone below
0.5 m, in the far zone below 1.1 m (the paper's thresholds), and beyond it up to the range. The
robot does not stop for the person, and the person does not give way. From 10 Hz to 40 Hz the RMSE
changes by 0.5 %, a maximum by up to 1.5 cm; with balls that fall short of the body by 0.25 mm
instead of 1 mm, both change by at most 0.1 mm. This is an engineering aid: none of these numbers is
a safety rating.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float
from scipy import stats

from ..coverage.arrays import dot, root
from ..coverage.occlusion.ranging import least_gap, readings, slabs
from ..coverage.rings.ring import Setup, sensor_optics
from ..coverage.rings.ring_kinematics import sensor_axes
from ..coverage.robots.kinematics import forward
from ..coverage.robots.link_bodies import robot_capsules
from ..coverage.robots.robot import Robot
from ..coverage.solids.capsules import Capsules, gap_to_capsules
from .human import body_balls
from .objects import SHAPES, object_balls
from .walk import walk

NEAR, FAR = 0.5, 1.1  # m
WINDOW = 0.3  # s, over which a closing speed is averaged
THINGS = ("human", *SHAPES)
MODES = ("ignore", "shadow")  # self-occlusion

# samples of a beam's cross-section: circles as shares of the half angle, points on each circle
_CIRCLES, _ON_CIRCLE = (0.55, 1.0), 8
Table = dict[str, float | None]


@jax.jit
def _beliefs(rows: tuple[jax.Array, ...], fixed: tuple[jax.Array, ...]) -> jax.Array:
    """Return the distances (R, 2) m of the believed and the careful point from the robot, for R
    readings."""
    apex, axis, half, reading, start, end = rows
    (thick,) = fixed
    z, x = (jnp.eye(3, dtype=axis.dtype)[i][None] for i in (2, 0))
    u = jnp.cross(axis, jnp.where(jnp.abs(axis[:, 2:]) < 0.9, z, x))
    u = u / root(dot(u, u))[:, None]
    v = jnp.cross(axis, u)
    ways = [axis] + [
        jnp.cos(s * half)[:, None] * axis
        + jnp.sin(s * half)[:, None] * (np.cos(a) * u + np.sin(a) * v)
        for s in _CIRCLES
        for a in 2 * np.pi * np.arange(_ON_CIRCLE) / _ON_CIRCLE
    ]
    points = apex[:, None] + reading[:, None, None] * jnp.stack(ways, axis=1)
    gap = gap_to_capsules(points, start[:, None], end[:, None], thick[None, None])
    return jnp.stack([gap[:, 0], gap.min(axis=1)], axis=1)


def beliefs(
    apex: Float[np.ndarray, "T K 3"],
    axis: Float[np.ndarray, "T K 3"],
    half_angle: Float[np.ndarray, " K"],
    reading: Float[np.ndarray, "T K"],
    bodies: Capsules,
) -> Float[np.ndarray, "T 2"]:
    """Return the believed and the careful distance (T, 2) m; infinite without readings.

    Args:
        apex: apexes of the K sensors, m.
        axis: unit axes of the beams.
        half_angle: half angles, rad.
        reading: readings, m; infinite for none.
        bodies: bodies of the robot at T poses.
    """
    distances = np.full((*reading.shape, 2), np.inf)
    t, k = np.nonzero(np.isfinite(reading))
    if len(t):
        beams = apex[t, k], axis[t, k], half_angle[k], reading[t, k]
        rows = *beams, bodies.start[t], bodies.end[t]
        distances[t, k] = slabs(_beliefs, rows, (jnp.asarray(bodies.radius),))
    least: np.ndarray = distances.min(axis=1)
    return least


class Series(NamedTuple):
    """One run over T times."""

    time: Float[np.ndarray, " T"]
    """Times, s."""
    true: Float[np.ndarray, " T"]
    """True distance, m."""
    believed: Float[np.ndarray, " T"]
    """Believed distance, m."""
    careful: Float[np.ndarray, " T"]
    """Careful distance, m."""
    seen: Bool[np.ndarray, " T"]
    """Whether any sensor has a reading."""
    true_speed: Float[np.ndarray, "T 2"]
    """True closing speeds towards base and TCP, m/s, positive when closing."""
    believed_speed: Float[np.ndarray, "T 2"]
    """Believed closing speeds towards base and TCP, m/s."""


def repeated(
    time_s: Float[np.ndarray, " T"], q: Float[np.ndarray, "T J"], duration_s: float
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, "N J"]]:
    """Repeat a cyclic task for ``duration_s`` s; it is evenly sampled and ends one step before its
    own start."""
    step = float(time_s[1] - time_s[0])
    n = round(duration_s / step) + 1
    return step * np.arange(n), q[np.arange(n) % len(q)]


def thing_balls(
    thing: str, seed: int, time_s: Float[np.ndarray, " T"], bodies: Capsules
) -> tuple[Float[np.ndarray, "T B 3"], Float[np.ndarray, " B"]]:
    """Return balls (T, B, 3) m and radii (B,) m of an object on the path of ``seed``.

    Raises:
        ValueError: for an unknown object; the message lists the known ones.
    """
    if thing not in THINGS:
        raise ValueError(f"unknown object {thing!r}; known: {', '.join(THINGS)}")
    if thing == "human":
        path = walk(seed, time_s)
        return body_balls(path.stature, path.posture)
    return object_balls(thing, seed, time_s, bodies)


def series(
    robot: Robot,
    setup: Setup,
    time_s: Float[np.ndarray, " T"],
    q: Float[np.ndarray, "T J"],
    thing: str,
    seed: int,
    mode: str,
) -> Series:
    """Simulate one run: ``robot`` with ``setup`` moves along ``q``, ``thing`` on the path of
    ``seed``.

    Closing speeds are differences over ``WINDOW`` of the distance of the base's origin and of the
    TCP from the object's nearest point. Both motions count, including the TCP's. An object that was
    not seen at both ends of the window is believed to stand still.

    Args:
        robot: robot with bodies.
        setup: setup whose sensors observe.
        time_s: times (T,), s, evenly spaced from 0.
        q: joint angles (T, J), rad.
        thing: one of ``THINGS``.
        seed: random seed of the object's path, which does not depend on the setup.
        mode: ``ignore`` sees through the robot, ``shadow`` does not (see ``ranging.readings``).

    Raises:
        ValueError: if object or mode is unknown or the robot has no bodies.
    """
    if mode not in MODES:
        raise ValueError(f"unknown mode {mode!r}; known: {', '.join(MODES)}")
    frames = forward(robot.chain, q)
    bodies = robot_capsules(robot.enclosed(), frames)
    centre, radius = thing_balls(thing, seed, time_s, bodies)
    apex, axis = (np.asarray(a) for a in sensor_axes(robot, setup, frames))
    half, range_m = sensor_optics(setup)
    read = readings(
        apex, axis, half, range_m, centre, radius, bodies if mode == "shadow" else None
    ).distance
    seen = np.isfinite(read).any(axis=1)
    believed, careful = np.clip(beliefs(apex, axis, half, read, bodies), 0, range_m.max()).T

    ends = np.stack([np.zeros((len(q), 3)), frames[:, -1, :3, 3]], axis=1)
    to_thing = np.linalg.norm(centre[:, None] - ends[:, :, None], axis=3) - radius
    point = apex + np.where(np.isfinite(read), read, 0)[..., None] * axis
    to_point = np.where(
        np.isfinite(read)[:, None],
        np.linalg.norm(point[:, None] - ends[:, :, None], axis=3),
        np.inf,
    )
    return Series(
        time_s,
        np.maximum(least_gap(centre, radius, bodies), 0),
        believed,
        careful,
        seen,
        _closing(np.maximum(to_thing.min(axis=2), 0), time_s),
        _closing(to_point.min(axis=2), time_s),
    )


def _closing(
    distance: Float[np.ndarray, "T 2"], time_s: Float[np.ndarray, " T"]
) -> Float[np.ndarray, "T 2"]:
    """Return the closing speed over the preceding window; 0 in the first window and where an end is
    infinite."""
    back = max(1, round(WINDOW / float(time_s[1] - time_s[0])))
    speed = np.zeros_like(distance)
    before, now = distance[:-back], distance[back:]
    known = np.isfinite(before) & np.isfinite(now)
    change = np.where(known, before, 0) - np.where(known, now, 0)
    speed[back:] = change / (time_s[back:] - time_s[:-back])[:, None]
    return speed


def measures(run: Series, range_m: float) -> Table:
    """Return the measures of one run as a flat table; None where no moment counts.

    - rmse_m, max_error_m: errors of the believed distance while the true one is below ``range_m``.
    - bias_m: its mean error, positive where the object is nearer than believed; over_m: its largest
      overestimate.
    - ``near_``, ``far_``, ``beyond_``: the same by zone.
    - careful_rmse_m, careful_over_m: errors of the careful distance.
    - rmse_speed_base, rmse_speed_tcp, max_speed_...: errors of closing speeds, m/s.
    - unseen_s, unseen_share, unseen_longest_s, unseen_nearest_m: times and distance without any
      reading while the true distance is below the range.
    - late_near_s, late_far_s: time with the true distance below a zone's threshold and the believed
      one above it.
    - counted_s, contact_s, near_s, far_s, beyond_s: duration of each condition.
    """
    step = float(run.time[1] - run.time[0])
    counts = run.true < range_m
    error = run.believed - run.true
    zones = {
        "near": run.true < NEAR,
        "far": (run.true >= NEAR) & (run.true < FAR),
        "beyond": counts & (run.true >= FAR),
    }
    table = {"counted_s": step * counts.sum(), "contact_s": step * (run.true <= 0).sum()}
    table |= {f"{name}_s": step * zone.sum() for name, zone in zones.items()}
    for prefix, zone in {"": counts, **{f"{name}_": zone for name, zone in zones.items()}}.items():
        table |= {prefix + key: value for key, value in _errors(error[zone]).items()}
    careful = _errors((run.careful - run.true)[counts])
    table |= {"careful_rmse_m": careful["rmse_m"], "careful_over_m": careful["over_m"]}
    for i, end in enumerate(("base", "tcp")):
        speed = _errors((run.believed_speed - run.true_speed)[counts, i])
        table |= {f"rmse_speed_{end}": speed["rmse_m"], f"max_speed_{end}": speed["max_error_m"]}
    unseen = counts & ~run.seen
    table["unseen_s"] = step * unseen.sum()
    table["unseen_share"] = unseen.sum() / counts.sum() if counts.any() else np.nan
    table["unseen_longest_s"] = step * _longest(unseen)
    table["unseen_nearest_m"] = run.true[unseen].min() if unseen.any() else np.nan
    table["late_near_s"] = step * ((run.true < NEAR) & (run.believed >= NEAR)).sum()
    table["late_far_s"] = step * ((run.true < FAR) & (run.believed >= FAR)).sum()
    return {key: float(value) if np.isfinite(value) else None for key, value in table.items()}


def _errors(error: Float[np.ndarray, " N"]) -> dict[str, float]:
    if not error.size:
        return dict.fromkeys(("rmse_m", "max_error_m", "bias_m", "over_m"), np.nan)
    return {
        "rmse_m": np.sqrt(np.mean(error**2)),
        "max_error_m": np.abs(error).max(),
        "bias_m": error.mean(),
        "over_m": max(error.max(), 0.0),
    }


def _longest(flags: Bool[np.ndarray, " T"]) -> int:
    """Return the length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return int(np.diff(edges)[::2].max(initial=0))


def cell(
    robot: Robot,
    setup: Setup,
    time_s: Float[np.ndarray, " T"],
    q: Float[np.ndarray, "T J"],
    thing: str,
    seed: int,
    mode: str,
) -> Table:
    """Run one independent measurement of the study: ``measures`` of ``series``, with the same
    arguments."""
    return measures(
        series(robot, setup, time_s, q, thing, seed, mode), float(sensor_optics(setup)[1].max())
    )


def summary(
    cells: Sequence[Mapping[str, float | None]], confidence: float = 0.95
) -> dict[str, tuple[float, float]]:
    """Return the mean over seeds of each key and the half width of its t-interval.

    Only cells with a number count. The mean is NaN without any, the half width with fewer than two.
    """
    table = {}
    for key in cells[0]:
        values = np.array([value for c in cells if (value := c[key]) is not None])
        n = len(values)
        mean = float(values.mean()) if n else np.nan
        spread = (
            float(stats.t.ppf((1 + confidence) / 2, n - 1) * values.std(ddof=1) / np.sqrt(n))
            if n > 1
            else np.nan
        )
        table[key] = (mean, spread)
    return table
