"""Least-squares fit of rings to sensors with given apexes and axes.

A ring is fitted to each link of the robot; the link with the best fit carries it. What forms no
ring becomes single sensors.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import UserError
from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.rings.ring import Ring, Setup
from ...coverage.rings.ring_kinematics import up_of
from ...coverage.robots.kinematics import forward
from ...coverage.robots.robot import Mount
from ...coverage.sensors.sensor import Sensor
from ...objectives.scene import Scene
from .sensor_frames import SensorFrame
from .single_fit import single_at, single_on_link

TOLERANCE_MM, TOLERANCE_DEG = 2.0, 1.0  # largest deviation of a sensor from its ring
_POSES = 3  # arbitrary poses of sensors whose places on their links are known
_UNIT = 1e-3  # tolerance of the length of an axis
_DIGITS = 9  # decimals of lengths
_TURN = 1e-6  # rad, a phase this close to a full turn counts as 0
# decimals of a misfit, in tolerances: between links that fit equally, the ring's radius decides
_TIE = 3


class SensorAtPose(NamedTuple):
    """A sensor at one pose of the robot, in the base frame."""

    pose: int
    """Number of the pose."""
    ring: int
    """Number of the ring."""
    sensor: int
    """Number of the sensor on its ring."""
    T: Float[np.ndarray, "3 3"]
    """Columns: the direction up of a beam that is not round, its axis, and the apex, m."""
    unit: Sensor
    """The sensor."""


def setup_of_frames(
    name: str,
    sensors: Sequence[SensorFrame],
    scene: Scene,
    links: Mapping[int, str] | None = None,
) -> Setup:
    """Return the setup of sensors whose poses on their links are known; see ``fitted_setup``.

    A few arbitrary poses of the robot decide: only on its own link do a ring's sensors form a ring
    in all of them.
    """
    if not sensors:
        return Setup()
    chain = scene.robot.chain
    q = np.random.default_rng(0).uniform(-2.5, 2.5, (_POSES, len(chain)))
    poses = list(np.asarray(forward(chain, q)))
    readings = [
        SensorAtPose(p, s.ring, s.sensor, (frames[s.frame] @ s.T_frame_sensor)[:3, 1:], s.unit)
        for p, frames in enumerate(poses)
        for s in sensors
    ]
    known = {(s.ring, s.sensor): s for s in sensors}
    return fitted_setup(name, readings, poses, scene, links, known)


def fitted_setup(
    name: str,
    readings: Sequence[SensorAtPose],
    frames: Sequence[Float[np.ndarray, "F 4 4"]],
    scene: Scene,
    links: Mapping[int, str] | None = None,
    known: Mapping[tuple[int, int], SensorFrame] | None = None,
) -> Setup:
    """Return the setup whose sensors ``readings`` list; sensors that form no ring become single
    ones.

    Args:
        name: name of the file, for messages.
        readings: one sensor at one pose each.
        frames: link frames at each pose that readings name, T_base_frame.
        scene: gives the robot, and the ring radius that decides between links with equal fits.
        links: links of rings by number, where known.
        known: poses on links by the numbers of ring and sensor, where known.

    Raises:
        UserError: if the numbers are not consecutive, a sensor is stated twice or as two kinds, or
            a vector is not of length 1.
    """
    by_ring: dict[int, dict[int, list[SensorAtPose]]] = defaultdict(lambda: defaultdict(list))
    for reading in readings:
        by_ring[reading.ring][reading.pose].append(reading)
    missing = sorted(set(range(max(by_ring) + 1)) - set(by_ring))
    if missing:
        raise UserError(
            f"{name}: ring {missing[0]}: found no sensor, allowed: consecutive numbers of rings"
            " from 0"
        )
    rings, singles = list[Ring](), list[MountedSensor]()
    for n in sorted(by_ring):
        where = f"{name}: ring {n}"
        match _ring_or_singles(where, by_ring[n], frames, scene, (links or {}).get(n)):
            case Ring() as ring:
                rings.append(ring if known is None else replace(ring, sensor=known[n, 0].unit))
            case loose if known is None:
                singles += loose
            case loose:
                seats = [known[n, k] for k in range(len(loose))]
                singles += [
                    single_at(scene.robot, s.frame, s.T_frame_sensor, s.unit, s.label)
                    for s in seats
                ]
    return Setup(tuple(rings), tuple(singles))


def _ring_or_singles(
    where: str,
    poses: dict[int, list[SensorAtPose]],
    frames: Sequence[Any],
    scene: Scene,
    link: str | None,
) -> Ring | list[MountedSensor]:
    """Return a ring from its readings at each pose, on ``link`` if known; if its sensors form no
    ring there, these as single ones."""
    table = [sorted(readings, key=lambda r: r.sensor) for readings in poses.values()]
    count = 1 + max(readings[-1].sensor for readings in table)
    for pose, readings in zip(poses, table, strict=True):
        times = Counter(reading.sensor for reading in readings)
        for k in range(count):
            if times[k] != 1:
                raise UserError(
                    f"{where}: sensor {k}: found {times[k]} rows at pose {pose}, allowed: 1"
                )
    kinds = {reading.unit for readings in table for reading in readings}
    if len(kinds) > 1:
        allowed = "one fov_deg, range_m and fov_up_deg per ring"
        raise UserError(f"{where}: found {len(kinds)} kinds of sensors, allowed: {allowed}")
    (sensor,) = kinds
    columns = np.array([[reading.T for reading in readings] for readings in table])
    apex, axis = columns[..., 2], _unit(where, "axis", columns[..., 1])
    up = _unit(where, "up", columns[..., 0]) if sensor.oriented else None
    T = np.array([frames[pose] for pose in poses])
    mounts = scene.robot.mounts if link is None else (scene.robot.mount(link),)
    fits = [_fit(mount, T[:, mount.frame], apex, axis, up, sensor) for mount in mounts]
    good = [(misfit, ring) for misfit, ring in fits if misfit <= 1 and ring.radius > 0]
    if not good:
        ups = [None if up is None else up[:, k] for k in range(count)]
        return [
            single_on_link(scene.robot, T, apex[:, k], axis[:, k], ups[k], sensor)
            for k in range(count)
        ]
    radius = scene.default_radius
    return min(good, key=lambda fit: (round(fit[0], _TIE), abs(fit[1].radius - radius)))[1]


def _unit(where: str, key: str, vectors: Float[np.ndarray, "P K 3"]) -> Float[np.ndarray, "P K 3"]:
    """Return vectors of length 1, which those of a file are up to rounding."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    if np.any(np.abs(length - 1) > _UNIT):
        worst = float(length.ravel()[np.argmax(np.abs(length - 1))])
        raise UserError(f"{where}: found a vector {key} of length {worst:g}, allowed: 1")
    unit: np.ndarray = vectors / length
    return unit


def _turned(
    T: Float[np.ndarray, "P 4 4"], v: Float[np.ndarray, "P K 3"]
) -> Float[np.ndarray, "P K 3"]:
    """Rotate vectors from the base frame to the frames T_base_frame."""
    turned: np.ndarray = np.einsum("pji,pkj->pki", T[:, :3, :3], v)
    return turned


def _fit(
    mount: Mount,
    T: Float[np.ndarray, "P 4 4"],
    apex: Float[np.ndarray, "P K 3"],
    axis: Float[np.ndarray, "P K 3"],
    up: Float[np.ndarray, "P K 3"] | None,
    sensor: Sensor,
) -> tuple[float, Ring]:
    """Return the least-squares ring on a mount for K sensors at P poses, after its misfit: the
    larger deviation in tolerances, of which up to 1 is acceptable.

    In the mount's frame (zero, side, axis), sensor k turned back by its share of the circle lies at
    the ring's radius and phase, written as one complex number; the mean of these numbers is the
    least-squares fit. The same holds for the mean position along the axis and, for the tilt, for
    the mean of the axes' components along the radius and along the mount. ``up`` of square beams
    follows from these, up to its sign.

    Args:
        mount: the mount.
        T: frame of the mount's link at each pose, T_base_frame.
        apex: apexes in the base frame, m.
        axis: unit axes in the base frame.
        up: unit vectors up of square beams; None for round ones.
        sensor: sensor of the ring.
    """
    basis = np.stack([mount.zero, mount.side, mount.axis])
    at = (_turned(T, apex - T[:, None, :3, 3]) - mount.start) @ basis.T
    look = _turned(T, axis) @ basis.T
    count = apex.shape[1]
    turn = 2 * np.pi / count * np.arange(count)
    middle = ((at[..., 0] + 1j * at[..., 1]) * np.exp(-1j * turn)).mean()
    radius, phase = round(float(abs(middle)), _DIGITS), float(np.angle(middle))
    radial = np.stack([np.cos(phase + turn), np.sin(phase + turn), np.zeros(count)], axis=1)
    along = np.array([0.0, 0.0, 1.0])
    tilt = math.atan2(float(look[..., 2].mean()), float((look * radial).sum(axis=-1).mean()))
    place = float(np.clip(at[..., 2].mean() / mount.length, 0.0, 1.0)) if mount.length > 0 else 0.0
    off = np.linalg.norm(at - (radius * radial + place * mount.length * along), axis=-1).max()
    wanted = math.cos(tilt) * radial + math.sin(tilt) * along
    angle = np.arctan2(
        np.linalg.norm(np.cross(look, wanted), axis=-1), (look * wanted).sum(axis=-1)
    ).max()
    if up is not None:
        seen, across = _turned(T, up) @ basis.T, up_of(wanted, along, radial)
        cosine = np.abs((seen * across).sum(axis=-1))
        angle = max(
            angle, np.arctan2(np.linalg.norm(np.cross(seen, across), axis=-1), cosine).max()
        )
    if abs(tilt) >= math.pi / 2:
        angle = max(angle, math.pi / 2)  # inward-looking sensors form no ring
    ring = Ring(mount.link, place, count, tilt, (phase + _TURN) % math.tau - _TURN, radius, sensor)
    return max(1000 * float(off) / TOLERANCE_MM, math.degrees(float(angle)) / TOLERANCE_DEG), ring
