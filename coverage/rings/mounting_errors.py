"""Errors of mounting: rings that sit a little beside where they were meant to, and sensors that
look a little astray.

A ring errs as a rigid body: it slips along the mount axis, and about its centre it is rocked about
the two axes across the mount axis and turned about that axis. Each sensor errs in its seat besides:
its axis is turned about the two axes across it. All are fixed to the link, so that one mounted
setup has the same errors in every pose.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from ..arrays import Array, cross, dot, namespace
from ..choices import Law
from ..robots.kinematics import forward
from ..robots.robot import Robot
from ..solids.cones import Cones
from .ring import Setup, ring_values
from .ring_kinematics import RingArrays, SensorPoses, ring_arrays, seen_from, sensor_poses


@dataclass(frozen=True)
class MountingErrors:
    """How large errors are: ``position`` m along the mount axis; ``direction`` rad, of each of a
    ring's three rotations and of each of a sensor's two.

    law: ``uniform``: up to these limits either way. ``normal``: with half of these as standard
    deviations, so that 95 in 100 stay within them.

    Raises:
        ValueError: if an error is negative, not finite, or as large as no mount.
    """

    position: float = 0.005
    direction: float = math.radians(2.0)
    law: Law = "uniform"

    def __post_init__(self) -> None:
        for key, value, most in (
            ("position", self.position, 1.0),
            ("direction", self.direction, math.pi / 4),
        ):
            if not 0 <= value <= most:
                raise ValueError(f"{key} error {value:g}: allowed are 0 to {most:.3g}")


@dataclass(frozen=True)
class Misplaced:
    """D drawn errors of a setup of R rings and K sensors.

    slip (D, R) m along the mount axis; turn (D, R, 3) rad: rotation vector of each ring by its
    mount's zero, side and axis; seat (D, K, 2) rad: how far each sensor looks astray, out of its
    ring's plane towards distal, and along its ring.
    """

    slip: Float[Array, "D R"]
    turn: Float[Array, "D R 3"]
    seat: Float[Array, "D K 2"]

    def __len__(self) -> int:
        return self.slip.shape[0]


def draw_errors(
    rings: int, sensors: int, errors: MountingErrors, draws: int, seed: int
) -> Misplaced:
    """Draw the errors of ``draws`` mountings of so many rings and sensors.

    The numbers are common: those of a ring and of a sensor depend on the seed and on which one it
    is, and more draws begin with the same ones, so that setups, sizes of error and numbers of draws
    are compared by equal luck.
    """

    def numbers(kind: int, which: int, columns: int) -> Float[np.ndarray, "draws columns"]:
        rng = np.random.default_rng((seed, kind, which))
        return (
            rng.uniform(-1, 1, (draws, columns))
            if errors.law == "uniform"
            else rng.normal(0, 0.5, (draws, columns))
        )

    ring = np.stack([numbers(0, i, 4) for i in range(rings)], axis=1)
    seat = np.stack([numbers(1, k, 2) for k in range(sensors)], axis=1)
    return Misplaced(
        errors.position * ring[..., 0], errors.direction * ring[..., 1:], errors.direction * seat
    )


def misplaced(arrays: RingArrays, meant: SensorPoses, errors: Misplaced) -> SensorPoses:
    """Where sensors really sit that are ``meant`` to sit there: all (D, K, 3), for each drawn
    mounting.
    """
    apex, look, centre, along, radial = (v[None] for v in meant)
    xp, dtype, ring = namespace(look), look.dtype, arrays.ring

    def like(values: Array) -> Any:
        return xp.asarray(values, dtype=dtype)

    astray = np.hypot(errors.seat[..., 0], errors.seat[..., 1])
    tangent = cross(along, radial)
    up, sideways = (
        like(np.sinc(astray / np.pi) * errors.seat[..., i])[..., None] for i in range(2)
    )
    look = like(np.cos(astray))[..., None] * look + up * cross(look, tangent) + sideways * tangent

    square = dot(errors.turn, errors.turn)[..., None]
    # at angle 0 the products vanish, whatever stands before them
    angle = np.sqrt(np.where(square > 0, square, 1.0))
    sine, cosine = (
        like(a)[:, ring] for a in (np.sin(angle) / angle, (1 - np.cos(angle)) / angle**2)
    )
    turn = sum(
        like(errors.turn[..., i : i + 1]) * like(e)[None]
        for i, e in enumerate((arrays.zero, arrays.side, arrays.axis))
    )
    turn = turn[:, ring]

    def turned(v: Array) -> Any:
        """``v`` by the rings' rotations (Rodrigues): exactly itself without one."""
        across = cross(turn, v)
        return v + (sine * across + cosine * cross(turn, across))

    slipped = centre + like(errors.slip)[:, ring, None] * along
    return SensorPoses(
        slipped + turned(apex - centre), turned(look), slipped, turned(along), turned(radial)
    )


def misplaced_cones(
    robot: Robot, setup: Setup, q: Float[np.ndarray, " J"], errors: Misplaced
) -> list[Cones]:
    """V_FOV at pose ``q`` (J,) rad for each drawn mounting, in the base frame (64-bit NumPy)."""
    v = ring_values(setup)
    here = ring_arrays(robot, setup.rings)
    there = misplaced(here, sensor_poses(here, v.position, v.tilt, v.phase), errors)
    each = zip(*seen_from(here, there, forward(robot.chain, q), up=True), strict=True)
    return [here.beams.solids(*seats) for seats in each]
