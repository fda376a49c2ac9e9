"""Rings and their sensors as plain arrays, and the cones they see.

As arrays, setups with other links and counts share one compilation.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array, cross, dot, namespace, root
from ..robots.kinematics import forward
from ..robots.robot import Robot
from ..solids.cones import Cones
from ..solids.sensor_beams import BeamShapes
from ..trees import tree
from .ring import Ring, Setup, ring_values


@tree
@dataclass(frozen=True)
class RingArrays:
    """R rings and K sensors; a sensor beyond those of the rings has the range minus infinity and
    sees nothing.

    Of rings: frame (R,), index into ``forward``'s frames; start (R, 3) m, axis, zero and side (R,
    3) of the mount; length (R,) m of the mount; radius (R,) m. Of sensors: ring (K,) each belongs
    to; turn (K,) rad from the first of its ring; beams: their shapes (K,).
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
    beams: BeamShapes


def any_square(rings: Iterable[Ring]) -> bool:
    """Has a ring sensors with a square beam?"""
    return any(r.sensor.square for r in rings)


def ring_arrays(
    robot: Robot, rings: tuple[Ring, ...], sensors: int | None = None, square: bool = False
) -> RingArrays:
    """The rings of a setup, and their sensors filled up to ``sensors``; ``square``: there may be
    square beams among setups that are stacked with this one.

    Raises:
        ValueError: if a ring sits on a link that the robot has not, or there are more sensors than
            that.
    """
    mounts = [robot.mount(r.link) for r in rings]
    counts = np.array([r.count for r in rings])
    spare = (counts.sum() if sensors is None else sensors) - counts.sum()
    if spare < 0:
        raise ValueError(f"{counts.sum()} sensors do not fit in {sensors}")

    def each(values: list[float] | np.ndarray, nothing: float) -> Any:
        return np.concatenate(
            [np.repeat(np.asarray(values, float), counts), np.full(spare, nothing)]
        )

    start, axis, zero, side = (
        np.array([getattr(m, key) for m in mounts]) for key in ("start", "axis", "zero", "side")
    )
    turn = np.concatenate(
        [np.arange(n) * (2 * np.pi / max(n, 1)) for n in counts] + [np.zeros(spare)]
    )
    some_square = square or any_square(rings)
    return RingArrays(
        np.array([m.frame for m in mounts]),
        start,
        axis,
        zero,
        side,
        np.array([m.length for m in mounts]),
        np.array([r.radius for r in rings]),
        each(np.arange(len(rings)), 0).astype(int),
        turn,
        BeamShapes(
            each([r.sensor.half_angle for r in rings], np.pi / 4),
            each([r.sensor.range_m for r in rings], -np.inf),
            each([r.sensor.half_angle_up for r in rings], 0.0) if some_square else None,
            each([r.sensor.zoned for r in rings], 0.0) > 0 if some_square else None,
        ),
    )


class SensorPoses(NamedTuple):
    """Where K sensors sit, each in the frame of its link, all (K, 3).

    apex m; look: unit, where the sensor looks; centre m of its ring; along: unit, mount axis;
    radial: unit, from the centre to the sensor.
    """

    apex: Any
    look: Any
    centre: Any
    along: Any
    radial: Any


def sensor_poses(
    arrays: RingArrays,
    position: Float[Array, " R"],
    tilt: Float[Array, " R"],
    phase: Float[Array, " R"],
) -> SensorPoses:
    """The poses of all sensors; for the arguments see ``ring_axes``."""
    xp, ring = namespace(position), arrays.ring

    def of_sensor(values: Array) -> Any:
        return xp.asarray(values, dtype=position.dtype)[ring]

    start, axis, zero, side = (
        of_sensor(v) for v in (arrays.start, arrays.axis, arrays.zero, arrays.side)
    )
    angle = phase[ring] + xp.asarray(arrays.turn, dtype=position.dtype)
    radial = xp.cos(angle)[:, None] * zero + xp.sin(angle)[:, None] * side
    lean = tilt[ring][:, None]
    centre = start + (position[ring] * of_sensor(arrays.length))[:, None] * axis
    apex = centre + of_sensor(arrays.radius)[:, None] * radial
    return SensorPoses(apex, xp.cos(lean) * radial + xp.sin(lean) * axis, centre, axis, radial)


def in_base(arrays: RingArrays, apex: Array, look: Array, frames: Array) -> tuple[Any, Any]:
    """Apexes (..., K, 3) m and unit axes (..., K, 3) from the frames of their links to the base
    frame, where the robot's frames are ``frames``, T_base_frame (..., F, 4, 4); leading axes
    broadcast, and are as many."""
    T = frames[..., arrays.frame[arrays.ring], :, :]
    rotation, origin = T[..., :3, :3], T[..., :3, 3]
    apex, look = (v[..., None, :] for v in (apex, look))
    return origin + dot(rotation, apex), dot(rotation, look)


def in_links(arrays: RingArrays, vectors: Array, frames: Array) -> Any:
    """Vectors (..., K, 3) of the sensors from the base frame to those of their links; for the
    others see ``in_base``.
    """
    rotation = frames[..., arrays.frame[arrays.ring], :3, :3]
    return dot(rotation.swapaxes(-1, -2), vectors[..., None, :])


def up_of(look: Array, along: Array, radial: Array) -> Any:
    """Unit ``up`` of square beams (..., 3): across the sensor's axis ``look`` and the ring's
    tangent. For a sensor in its seat the two are across each other; one that looks astray is not
    turned about its own axis."""
    up = cross(look, cross(along, radial))
    return up / root(dot(up, up))[..., None]


def ring_slopes(
    arrays: RingArrays,
    here: SensorPoses,
    by_apex: Array,
    by_look: Array,
    by_up: Array | None = None,
) -> tuple[Float[np.ndarray, " R"], Float[np.ndarray, " R"], Float[np.ndarray, " R"]]:
    """How fast a value grows by the rings' positions, tilts and phases, where it grows by
    ``by_apex`` (..., K, 3), 1/m, by ``by_look`` and by ``by_up`` with what the sensors in their
    seats are made of, all in the frames of their links.

    A position moves a sensor along the mount; a tilt turns it about its ring's tangent, backwards,
    and a phase about the ring's axis: so the last two are the moments of the three vectors about
    these axes.
    """
    moment = cross(here.look, by_look)
    if by_up is not None:
        moment = moment + cross(up_of(here.look, here.along, here.radial), by_up)
    moved = dot(by_apex, arrays.axis[arrays.ring])
    tilted = -dot(moment, cross(here.along, here.radial))
    turned = dot(moment + cross(here.apex - here.centre, by_apex), here.along)
    each = (v.reshape(-1, v.shape[-1]).sum(axis=0) for v in (moved, tilted, turned))
    position, tilt, phase = (np.bincount(arrays.ring, v, len(arrays.length)) for v in each)
    return position * arrays.length, tilt, phase


def ring_beams(
    arrays: RingArrays,
    position: Float[Array, " R"],
    tilt: Float[Array, " R"],
    phase: Float[Array, " R"],
    frames: Array,
) -> tuple[Any, ...]:
    """As ``ring_axes``, and the unit vectors ``up`` (..., K, 3) of square beams."""
    return seen_from(arrays, sensor_poses(arrays, position, tilt, phase), frames, up=True)


def seen_from(arrays: RingArrays, here: SensorPoses, frames: Array, up: bool) -> tuple[Any, ...]:
    """Apexes m and unit axes of sensors in their seats, and with ``up`` the vectors of square
    beams, in the base frame, each with the leading axes of the seats, then those of ``frames``,
    then (K, 3)."""
    batch, frames = (
        (1,) * (frames.ndim - 3),
        frames.reshape((1,) * (here.apex.ndim - 2) + frames.shape),
    )

    def beside(v: Array) -> Any:
        return v.reshape(*v.shape[:-2], *batch, *v.shape[-2:])

    apex, look = beside(here.apex), beside(here.look)
    found = in_base(arrays, apex, look, frames)
    return (
        (
            *found,
            in_base(arrays, apex, beside(up_of(here.look, here.along, here.radial)), frames)[1],
        )
        if up
        else found
    )


def ring_axes(
    arrays: RingArrays,
    position: Float[Array, " R"],
    tilt: Float[Array, " R"],
    phase: Float[Array, " R"],
    frames: Array,
) -> tuple[Float[Array, "*batch K 3"], Float[Array, "*batch K 3"]]:
    """Apexes (..., K, 3) m and unit axes (..., K, 3) of all sensors in the base frame.

    Args:
        slots: rings and sensors.
        position, tilt, phase: of each ring, NumPy or JAX, differentiable in the latter.
        frames: T_base_frame (..., F, 4, 4) from ``forward``.
    """
    apex, axis = seen_from(arrays, sensor_poses(arrays, position, tilt, phase), frames, up=False)
    return apex, axis


def sensor_axes(
    robot: Robot, setup: Setup, frames: Float[Array, "*batch F 4 4"]
) -> tuple[Float[Array, "*batch K 3"], Float[Array, "*batch K 3"]]:
    """Apexes (..., K, 3) m and unit axes (..., K, 3) of a setup's sensors, ring by ring, where the
    robot's frames are ``frames``, T_base_frame (..., F, 4, 4) from ``forward``."""
    values = ring_values(setup)
    return ring_axes(
        ring_arrays(robot, setup.rings), values.position, values.tilt, values.phase, frames
    )


def sensor_cones(robot: Robot, setup: Setup, q: Float[np.ndarray, " J"]) -> Cones:
    """V_FOV at pose ``q`` (J,) rad: one beam for each sensor, ring by ring, in the base frame
    (64-bit NumPy).
    """
    here, v, frames = ring_arrays(robot, setup.rings), ring_values(setup), forward(robot.chain, q)
    seats = sensor_poses(here, v.position, v.tilt, v.phase)
    return here.beams.solids(*seen_from(here, seats, frames, here.beams.square))
