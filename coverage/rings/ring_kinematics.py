"""Ring kinematics on plain arrays: the poses of rings and their sensors, and the sensors' cones.

Because they are arrays, setups on other links and with other counts share one compilation.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..arrays import Array, cross, dot, namespace, root
from ..detection.detection import Detection, detectors
from ..detection.detectors import Detectors
from ..pytrees import mapped, tree
from ..robots.kinematics import forward
from ..robots.robot import Mount, Robot
from ..sensors.sensor import Sensor
from ..solids.beams import Beams
from ..solids.sensor_beams import BeamShapes
from .mounted_sensor import MountedSensor
from .ring import Group, Setup, ring_values


@tree
@dataclass(frozen=True)
class RingArrays:
    """R rings, or single sensors as rings of one, and K sensors as arrays.

    Padding sensors beyond those of the rings have a range of minus infinity and see nothing.
    """

    frame: Int[Array, "*batch R"]
    """Index of each ring's link in ``forward``'s frames, or ``BASE``."""
    start: Float[Array, "*batch R 3"]
    """Proximal end of the mount, m."""
    axis: Float[Array, "*batch R 3"]
    """Unit axis of the mount."""
    zero: Float[Array, "*batch R 3"]
    """Unit vector of the mount's phase 0."""
    side: Float[Array, "*batch R 3"]
    """Unit vector ``axis x zero``."""
    length: Float[Array, "*batch R"]
    """Length of the mount, m."""
    radius: Float[Array, "*batch R"]
    """Radius of each ring, m."""
    ring: Int[Array, "*batch K"]
    """Index of each sensor's ring."""
    turn: Float[Array, "*batch K"]
    """Angle of each sensor from the first one of its ring, rad."""
    beams: BeamShapes
    """Shapes (K,) of the beams."""
    detectors: Detectors | None = None
    """What the sensors (K,) need to detect a test piece; None where none is to be detected."""


def mount_of(robot: Robot, group: Group) -> Mount:
    """Return the mount of a ring; of a single sensor, its own frame as a mount of length 0.

    Raises:
        ValueError: if the robot does not have its link.
    """
    if not isinstance(group, MountedSensor):
        return robot.mount(group.link)
    T = group.T_link_sensor
    frame = robot.frame_of(group.link)
    return Mount(group.link, frame, start=T[:3, 3], axis=T[:3, 1], zero=T[:3, 2], length=0.0)


def ring_arrays(
    robot: Robot,
    rings: tuple[Group, ...],
    sensors: int | None = None,
    possible: Iterable[Sensor] = (),
    detection: Detection | None = None,
) -> RingArrays:
    """Return the rings and single sensors of a setup as arrays.

    Args:
        robot: the robot.
        rings: the rings and single sensors.
        sensors: number of sensors to which the arrays are padded; None: no padding.
        possible: sensors of setups to be stacked with this one; ``None`` in their beams must agree.
        detection: what is to be detected; None: nothing.

    Raises:
        ValueError: if a ring sits on a link that the robot does not have, the rings have more than
            ``sensors`` sensors, or no source states a range in the light of the detection.
    """
    mounts = [mount_of(robot, r) for r in rings]
    counts = np.array([r.count for r in rings], int)
    spare = (counts.sum() if sensors is None else sensors) - counts.sum()
    if spare < 0:
        raise ValueError(f"the rings have {counts.sum()} sensors; the arrays hold {sensors}")

    def each(values: list[float] | np.ndarray, nothing: float) -> Any:
        return np.concatenate(
            [np.repeat(np.asarray(values, float), counts), np.full(spare, nothing)]
        )

    start, axis, zero, side = (
        np.array([getattr(m, key) for m in mounts], float).reshape(-1, 3)
        for key in ("start", "axis", "zero", "side")
    )
    turn = np.concatenate(
        [np.arange(n) * (2 * np.pi / max(n, 1)) for n in counts] + [np.zeros(spare)]
    )
    ring, detecting = each(np.arange(len(rings)), 0).astype(int), None
    if detection is not None and rings:
        detecting = mapped(lambda a: a[ring], detectors([r.sensor for r in rings], detection))
    return RingArrays(
        np.array([m.frame for m in mounts], int),
        start,
        axis,
        zero,
        side,
        np.array([m.length for m in mounts], float),
        np.array([r.radius for r in rings], float),
        ring,
        turn,
        BeamShapes.of(
            [r.sensor for r in rings], [*possible, *(r.sensor for r in rings if r.count)], each
        ),
        detecting,
    )


class SensorPoses(NamedTuple):
    """Poses of K sensors, each in the frame of its link, all (K, 3)."""

    apex: Any
    """Apex of the sensor's beam, m."""
    look: Any
    """Unit vector in which the sensor looks."""
    centre: Any
    """Centre of its ring, m."""
    along: Any
    """Unit vector of the mount axis."""
    radial: Any
    """Unit vector from the centre to the sensor."""


def sensor_poses(
    arrays: RingArrays,
    position: Float[Array, " R"],
    tilt: Float[Array, " R"],
    phase: Float[Array, " R"],
) -> SensorPoses:
    """Return the poses of all sensors.

    Args:
        arrays: rings and sensors.
        position, tilt, phase: values of each ring; NumPy, or JAX, which can differentiate by them.
    """
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


def seats(robot: Robot, groups: tuple[Group, ...]) -> tuple[RingArrays, SensorPoses]:
    """Return rings and single sensors as arrays, and the poses of all sensors on their links."""
    arrays, v = ring_arrays(robot, groups), ring_values(groups)
    return arrays, sensor_poses(arrays, v.position, v.tilt, v.phase)


def link_poses(seat: SensorPoses) -> Float[np.ndarray, "K 4 4"]:
    """Return the poses of sensors as transforms: the beam points along z, and y is ``up``."""
    up = up_of(seat.look, seat.along, seat.radial)
    T = np.tile(np.eye(4), (len(up), 1, 1))
    T[:, :3, :3] = np.stack([cross(up, seat.look), up, seat.look], axis=-1)
    T[:, :3, 3] = seat.apex
    return T


def with_base(frames: Array) -> Any:
    """Return frames (..., F, 4, 4) and the base frame last, where the index ``BASE`` reads it."""
    xp = namespace(frames)
    base = xp.broadcast_to(xp.eye(4, dtype=frames.dtype), (*frames.shape[:-3], 1, 4, 4))
    return xp.concatenate([frames, base], axis=-3)


def in_base(arrays: RingArrays, apex: Array, look: Array, frames: Array) -> tuple[Any, Any]:
    """Transform apexes (..., K, 3) m and unit axes (..., K, 3) from link frames to the base frame.

    Args:
        arrays: rings and sensors.
        apex: apexes in the frames of their links.
        look: axes in the frames of their links.
        frames: T_base_frame (..., F, 4, 4); equally many leading axes, which broadcast.
    """
    T = with_base(frames)[..., arrays.frame[arrays.ring], :, :]
    rotation, origin = T[..., :3, :3], T[..., :3, 3]
    apex, look = (v[..., None, :] for v in (apex, look))
    return origin + dot(rotation, apex), dot(rotation, look)


def up_of(look: Array, along: Array, radial: Array) -> Any:
    """Return the unit ``up`` vectors of square beams (..., 3).

    ``up`` is perpendicular to the sensor's axis ``look`` and to the ring's tangent. These two are
    perpendicular for a sensor without mounting error. A misaligned sensor is not rotated about its
    own axis.
    """
    up = cross(look, cross(along, radial))
    return up / root(dot(up, up))[..., None]


def seen_from(arrays: RingArrays, here: SensorPoses, frames: Array, up: bool) -> tuple[Any, ...]:
    """Return apexes m and unit axes of sensors in the base frame; with ``up`` also the up vectors.

    Each has the leading axes of the sensor poses, then those of ``frames``, then (K, 3).
    """
    batch, frames = (
        (1,) * (frames.ndim - 3),
        frames.reshape((1,) * (here.apex.ndim - 2) + frames.shape),
    )

    def beside(v: Array) -> Any:
        return v.reshape(*v.shape[:-2], *batch, *v.shape[-2:])

    apex, look = beside(here.apex), beside(here.look)
    axes = in_base(arrays, apex, look, frames)
    return (
        (
            *axes,
            in_base(arrays, apex, beside(up_of(here.look, here.along, here.radial)), frames)[1],
        )
        if up
        else axes
    )


def sensor_axes(
    robot: Robot, setup: Setup, frames: Float[Array, "*batch F 4 4"]
) -> tuple[Float[Array, "*batch K 3"], Float[Array, "*batch K 3"]]:
    """Return apexes (..., K, 3) m and unit axes (..., K, 3) of a setup's sensors, group by group.

    ``frames`` are the robot's frames, T_base_frame (..., F, 4, 4) from ``forward``.
    """
    apex, axis = seen_from(*seats(robot, setup.groups), frames, up=False)
    return apex, axis


def sensor_cones(robot: Robot, setup: Setup, q: Float[np.ndarray, " J"]) -> Beams:
    """Return V_FOV at pose ``q`` (J,) rad in the base frame (64-bit NumPy).

    It has one beam for each sensor: ring by ring, then those of the single sensors.
    """
    here, seat = seats(robot, setup.groups)
    frames = forward(robot.chain, q)
    return here.beams.solids(*seen_from(here, seat, frames, bool(here.beams.which)))
