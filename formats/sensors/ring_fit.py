"""Least-squares fit of rings to sensors with given apexes and axes.

A ring is fitted to each link of the robot; the link with the best fit carries it. What forms no
ring becomes single sensors.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from ...coverage.rings.mounted_sensor import MountedSensor
from ...coverage.rings.ring import Ring, Setup
from ...coverage.rings.ring_kinematics import up_of
from ...coverage.robots.robot import Mount
from ...coverage.sensors.sensor import Sensor
from ...objectives.scene import CoreScene
from ..errors import UserError
from ..schema.ring_models import ConeRow, SpecialConeRow, SquareConeRow
from .sensor_frames import SensorFrame
from .single_fit import single_at, single_on_link

TOLERANCE_MM, TOLERANCE_DEG = 2.0, 1.0  # largest deviation of a sensor from its ring
_UNIT = 1e-3  # tolerance of the length of an axis
_DIGITS = 9  # decimals of lengths
_TURN = 1e-6  # rad, a phase this close to a full turn counts as 0
# decimals of a misfit, in tolerances: between links that fit equally, the ring's radius decides
_TIE = 3


@dataclass(frozen=True)
class SetupFit:
    """A ring on a link, and the largest deviation of its sensors."""

    ring: Ring
    """The ring."""
    mm: float
    """Largest deviation of an apex, mm."""
    deg: float
    """Largest deviation of an axis, degrees."""

    @property
    def misfit(self) -> float:
        """The larger deviation in tolerances; up to 1 is acceptable."""
        return max(self.mm / TOLERANCE_MM, self.deg / TOLERANCE_DEG)


def fitted_setup(
    name: str,
    rows: Sequence[ConeRow],
    frames: Sequence[Float[np.ndarray, "F 4 4"]],
    scene: CoreScene,
    links: Mapping[int, str] | None = None,
    known: Mapping[tuple[int, int], SensorFrame] | None = None,
) -> Setup:
    """Return the setup whose sensors ``rows`` list; sensors that form no ring become single ones.

    Args:
        name: name of the file, for messages.
        rows: one sensor at one pose each, in the base frame.
        frames: link frames at each pose that rows name, T_base_frame.
        scene: gives the robot, and the ring radius that decides between links with equal fits.
        links: links of rings by number, where known.
        known: poses on links by the numbers of ring and sensor, where known.

    Raises:
        UserError: if the numbers are not consecutive, a sensor is stated twice or as two kinds, or
            a vector is not of length 1.
    """
    by_ring: dict[int, dict[int, list[ConeRow]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        by_ring[row.ring][row.pose].append(row)
    missing = sorted(set(range(max(by_ring) + 1)) - set(by_ring))
    if missing:
        raise UserError(
            f"{name}: ring {missing[0]}: found no sensor, allowed: consecutive numbers of rings"
            " from 0"
        )
    rings, singles = list[Ring](), list[MountedSensor]()
    for n in sorted(by_ring):
        match _ring_or_singles(name, n, by_ring[n], frames, scene, (links or {}).get(n)):
            case Ring() as ring:
                rings.append(ring if known is None else replace(ring, sensor=known[n, 0].unit))
            case each if known is None:
                singles += each
            case each:
                some = [known[n, k] for k in range(len(each))]
                singles += [
                    single_at(scene.robot, s.frame, s.T_frame_sensor, s.unit, s.label) for s in some
                ]
    return Setup(tuple(rings), tuple(singles))


def _ring_or_singles(
    name: str,
    number: int,
    poses: dict[int, list[ConeRow]],
    frames: Sequence[Any],
    scene: CoreScene,
    link: str | None,
) -> Ring | list[MountedSensor]:
    """Return ring ``number`` from its rows at each pose, on ``link`` if known; if its sensors form
    no ring there, these as single ones."""
    some = [sorted(rows, key=lambda row: row.sensor) for rows in poses.values()]
    count = 1 + max(row.sensor for rows in some for row in rows)
    for pose, rows in zip(poses, some, strict=True):
        times = Counter(row.sensor for row in rows)
        for k in range(count):
            if times[k] != 1:
                raise UserError(
                    f"{name}: ring {number}: sensor {k}: found {times[k]} rows at pose {pose},"
                    " allowed: 1"
                )
    kinds = {_sensor(name, number, row) for rows in some for row in rows}
    if len(kinds) > 1:
        allowed = "one fov_deg, range_m and fov_up_deg per ring"
        raise UserError(
            f"{name}: ring {number}: found {len(kinds)} kinds of sensors, allowed: {allowed}"
        )
    (sensor,) = kinds

    def part(key: str) -> Any:
        return np.array(
            [[[getattr(row, f"{key}_{x}") for x in "xyz"] for row in rows] for rows in some]
        )

    def unit(key: str) -> Any:
        vectors = part(key)
        length = np.linalg.norm(vectors, axis=-1, keepdims=True)
        if np.any(np.abs(length - 1) > _UNIT):
            worst = f"{float(length.ravel()[np.argmax(np.abs(length - 1))]):g}"
            raise UserError(
                f"{name}: ring {number}: found a vector {key} of length {worst}, allowed: 1"
            )
        return vectors / length

    T, up = np.array([frames[pose] for pose in poses]), unit("up") if sensor.oriented else None
    apex, axis = part("apex"), unit("axis")
    mounts = scene.robot.mounts if link is None else (scene.robot.mount(link),)
    fits = [_fit(mount, T[:, mount.frame], apex, axis, up, sensor) for mount in mounts]
    good = [f for f in fits if f.misfit <= 1 and f.ring.radius > 0]
    if not good:
        ups = [None if up is None else up[:, k] for k in range(count)]
        return [
            single_on_link(scene.robot, T, apex[:, k], axis[:, k], ups[k], sensor)
            for k in range(count)
        ]
    return min(
        good, key=lambda f: (round(f.misfit, _TIE), abs(f.ring.radius - scene.ring_radius))
    ).ring


def _sensor(name: str, number: int, row: ConeRow) -> Sensor:
    """Return the sensor of a row; raise a UserError for a beam that cannot be."""
    up = row.fov_up_deg if isinstance(row, SquareConeRow) else 0.0
    shaped = row if isinstance(row, SpecialConeRow) else None
    try:
        return Sensor(
            math.radians(row.fov_deg),
            row.range_m,
            fov_up=math.radians(up) if up > 0 else None,
            shape=shaped.shape if shaped else "beam",
            thickness=(shaped.thickness_m or None) if shaped else None,
            near_m=shaped.near_m if shaped else 0.0,
        )
    except ValueError as error:
        raise UserError(f"{name}: ring {number}: {error}") from error


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
) -> SetupFit:
    """Return the least-squares ring on a mount for K sensors at P poses.

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
    return SetupFit(ring, 1000 * float(off), math.degrees(float(angle)))
