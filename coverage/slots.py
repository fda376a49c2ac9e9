"""Rings and their sensors as plain arrays, and the cones they see.

As arrays, setups with other links and counts share one compilation.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float, Int

from .arrays import Array, dot, namespace
from .chain import forward
from .rings import Ring, Setup, ring_values, sensor_optics
from .robots import Robot
from .solids import Cones


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Slots:
    """R rings and K sensors; a sensor beyond those of the rings has the range minus infinity and sees nothing.

    Of rings: frame (R,), index into ``forward``'s frames; start (R, 3) m, axis, zero and side (R, 3) of the mount; length
    (R,) m of the mount; radius (R,) m. Of sensors: ring (K,) each belongs to; turn (K,) rad from the first of its ring;
    half_angle (K,) rad; range_m (K,).
    """

    frame: Int[Array, "*batch R"]
    start: Float[Array, "*batch R 3"]
    axis: Float[Array, "*batch R 3"]
    zero: Float[Array, "*batch R 3"]
    side: Float[Array, "*batch R 3"]
    length: Float[Array, "*batch R"]
    radius: Float[Array, "*batch R"]
    ring: Int[Array, "*batch K"]
    turn: Float[Array, "*batch K"]
    half_angle: Float[Array, "*batch K"]
    range_m: Float[Array, "*batch K"]


def slots(robot: Robot, rings: tuple[Ring, ...], sensors: int | None = None) -> Slots:
    """The rings of a setup, and their sensors filled up to ``sensors``.

    Raises:
        ValueError: if a ring sits on a link that the robot has not, or there are more sensors than that.
    """
    mounts = [robot.mount(r.link) for r in rings]
    counts = np.array([r.count for r in rings])
    spare = (counts.sum() if sensors is None else sensors) - counts.sum()
    if spare < 0:
        raise ValueError(f"{counts.sum()} sensors do not fit in {sensors}")

    def each(values: Any, nothing: float) -> Any:
        return np.concatenate([np.repeat(np.asarray(values, float), counts), np.full(spare, nothing)])

    start, axis, zero, side = (np.array([getattr(m, key) for m in mounts]) for key in ("start", "axis", "zero", "side"))
    turn = np.concatenate([np.arange(n) * (2 * np.pi / max(n, 1)) for n in counts] + [np.zeros(spare)])
    return Slots(
        np.array([m.frame for m in mounts]),
        start,
        axis,
        zero,
        side,
        np.array([m.length for m in mounts]),
        np.array([r.radius for r in rings]),
        each(np.arange(len(rings)), 0).astype(int),
        turn,
        each([r.sensor.fov / 2 for r in rings], np.pi / 4),
        each([r.sensor.range_m for r in rings], -np.inf),
    )


class Seats(NamedTuple):
    """Where K sensors sit, each in the frame of its link, all (K, 3).

    apex m; look: unit, where the sensor looks; centre m of its ring; along: unit, mount axis; radial: unit, from the centre
    to the sensor.
    """

    apex: Any
    look: Any
    centre: Any
    along: Any
    radial: Any


def seats(slots: Slots, position: Float[Array, " R"], tilt: Float[Array, " R"], phase: Float[Array, " R"]) -> Seats:
    """The seats of all sensors; for the arguments see ``slot_axes``."""
    xp, ring = namespace(position), slots.ring

    def of_sensor(values: Any) -> Any:
        return xp.asarray(values, dtype=position.dtype)[ring]

    start, axis, zero, side = (of_sensor(v) for v in (slots.start, slots.axis, slots.zero, slots.side))
    angle = phase[ring] + xp.asarray(slots.turn, dtype=position.dtype)
    radial = xp.cos(angle)[:, None] * zero + xp.sin(angle)[:, None] * side
    lean = tilt[ring][:, None]
    centre = start + (position[ring] * of_sensor(slots.length))[:, None] * axis
    apex = centre + of_sensor(slots.radius)[:, None] * radial
    return Seats(apex, xp.cos(lean) * radial + xp.sin(lean) * axis, centre, axis, radial)


def in_base(slots: Slots, apex: Any, look: Any, frames: Any) -> tuple[Any, Any]:
    """Apexes (..., K, 3) m and unit axes (..., K, 3) from the frames of their links to the base frame, where the robot's
    frames are ``frames``, T_base_frame (..., F, 4, 4); leading axes broadcast, and are as many."""
    T = frames[..., slots.frame[slots.ring], :, :]
    rotation, origin = T[..., :3, :3], T[..., :3, 3]
    apex, look = (v[..., None, :] for v in (apex, look))
    return origin + dot(rotation, apex), dot(rotation, look)


def slot_axes(
    slots: Slots, position: Float[Array, " R"], tilt: Float[Array, " R"], phase: Float[Array, " R"], frames: Any
) -> tuple[Float[Array, "*batch K 3"], Float[Array, "*batch K 3"]]:
    """Apexes (..., K, 3) m and unit axes (..., K, 3) of all sensors in the base frame.

    Args:
        slots: rings and sensors.
        position, tilt, phase: of each ring, NumPy or JAX, differentiable in the latter.
        frames: T_base_frame (..., F, 4, 4) from ``forward``.
    """
    here, batch = seats(slots, position, tilt, phase), (1,) * (frames.ndim - 3)
    return in_base(slots, here.apex.reshape(*batch, -1, 3), here.look.reshape(*batch, -1, 3), frames)


def sensor_axes(
    robot: Robot, setup: Setup, frames: Float[Array, "*batch F 4 4"]
) -> tuple[Float[Array, "*batch K 3"], Float[Array, "*batch K 3"]]:
    """Apexes (..., K, 3) m and unit axes (..., K, 3) of a setup's sensors, ring by ring, where the robot's frames are
    ``frames``, T_base_frame (..., F, 4, 4) from ``forward``."""
    values = ring_values(setup)
    return slot_axes(slots(robot, setup.rings), values.position, values.tilt, values.phase, frames)


def sensor_cones(robot: Robot, setup: Setup, q: Float[np.ndarray, " J"]) -> Cones:
    """V_FOV at pose ``q`` (J,) rad: one cone for each sensor, ring by ring, in the base frame (64-bit NumPy)."""
    return Cones(*sensor_axes(robot, setup, forward(robot.chain, q)), *sensor_optics(setup))
