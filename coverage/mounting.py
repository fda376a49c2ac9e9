"""Errors of mounting: rings that sit a little beside where they were meant to, and sensors that look a little astray.

A ring errs as a rigid body: it slips along the mount axis, and about its centre it is rocked about the two axes across the
mount axis and turned about that axis. Each sensor errs in its seat besides: its axis is turned about the two axes across it.
All are fixed to the link, so that one mounted setup has the same errors in every pose.
"""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from .arrays import Array, dot, namespace
from .chain import forward
from .rings import RingValues, Setup, in_base, ring_values, seats, sensor_optics
from .robots import Robot
from .solids import Cones

Law = Literal["uniform", "normal"]


@dataclass(frozen=True)
class MountingErrors:
    """How large errors are: ``position`` m along the mount axis; ``direction`` rad, of each of a ring's three rotations and
    of each of a sensor's two.

    law: ``uniform``: up to these limits either way. ``normal``: with half of these as standard deviations, so that 95 in 100
    stay within them.

    Raises:
        ValueError: if an error is negative, not finite, or as large as no mount.
    """

    position: float = 0.005
    direction: float = math.radians(2.0)
    law: Law = "uniform"

    def __post_init__(self) -> None:
        for key, value, most in (("position", self.position, 1.0), ("direction", self.direction, math.pi / 4)):
            if not 0 <= value <= most:
                raise ValueError(f"{key} error {value:g}: allowed are 0 to {most:.3g}")


@dataclass(frozen=True)
class Misplaced:
    """D drawn errors of a setup of R rings and K sensors.

    slip (D, R) m along the mount axis; turn (D, R, 3) rad: rotation vector of each ring by its mount's zero, side and axis;
    seat (D, K, 2) rad: how far each sensor looks astray, out of its ring's plane towards distal, and along its ring.
    """

    slip: Float[Array, "D R"]
    turn: Float[Array, "D R 3"]
    seat: Float[Array, "D K 2"]

    def __len__(self) -> int:
        return self.slip.shape[0]


def draw_errors(setup: Setup, errors: MountingErrors, draws: int, seed: int) -> Misplaced:
    """Draw the errors of ``draws`` mountings.

    The numbers are common: a ring's depend on the seed and on which ring it is alone, and more draws begin with the same
    ones, so that setups, sizes of error and numbers of draws are compared by equal luck.
    """
    slip, turn, seat = [], [], []
    for i, ring in enumerate(setup.rings):
        rng, shape = np.random.default_rng((seed, i)), (draws, 4 + 2 * ring.count)
        one = rng.uniform(-1, 1, shape) if errors.law == "uniform" else rng.normal(0, 0.5, shape)
        slip.append(errors.position * one[:, 0])
        turn.append(errors.direction * one[:, 1:4])
        seat.append(errors.direction * one[:, 4:].reshape(draws, -1, 2))
    return Misplaced(np.stack(slip, axis=1), np.stack(turn, axis=1), np.concatenate(seat, axis=1))


def _cross(a: Any, b: Any) -> Any:
    a1, a2, a3 = (a[..., i] for i in range(3))
    b1, b2, b3 = (b[..., i] for i in range(3))
    return namespace(a).stack([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1], axis=-1)


def _change(v: Any, by: Any) -> Any:
    """What a rotation by the constant rotation vectors ``by`` (NumPy) adds to ``v`` (Rodrigues): exactly 0 without one."""
    square = dot(by, by)[..., None]
    some = np.where(square > 0, square, 1.0)  # at angle 0 the products vanish, whatever stands before them
    angle = np.sqrt(some)
    sine, cosine, by = (_like(v, a) for a in (np.sin(angle) / angle, (1 - np.cos(angle)) / some, by))
    across = _cross(by, v)
    return sine * across + cosine * _cross(by, across)


def _like(v: Any, constant: Any) -> Any:
    return namespace(v).asarray(constant, dtype=v.dtype)


def misplaced_axes(
    robot: Robot, setup: Setup, values: RingValues, frames: Float[Array, "P F 4 4"], errors: Misplaced
) -> tuple[Float[Array, "D P K 3"], Float[Array, "D P K 3"]]:
    """Apexes m and unit axes of all sensors in the base frame, for each drawn mounting and each pose.

    Args:
        robot, setup, values: see ``sensor_axes``; differentiable by the values where these are JAX arrays.
        frames: T_base_frame of P poses.
        errors: the drawn errors, NumPy.
    """
    ring, mounts = setup.ring_of_sensor, [robot.mount(r.link) for r in setup.rings]
    apex, look, centre, along, radial = (v[None] for v in seats(robot, setup, values))
    astray = np.hypot(errors.seat[..., 0], errors.seat[..., 1])
    tangent = _cross(along, radial)
    up, sideways = (_like(look, np.sinc(astray / np.pi) * errors.seat[..., i])[..., None] for i in range(2))
    look = _like(look, np.cos(astray))[..., None] * look + up * _cross(look, tangent) + sideways * tangent

    basis = np.stack([[m.zero, m.side, m.axis] for m in mounts])
    turn = (errors.turn[..., None] * basis).sum(axis=2)[:, ring]
    apex = apex + _like(apex, errors.slip[:, ring, None]) * along + _change(apex - centre, turn)
    look = look + _change(look, turn)
    return in_base(robot, setup, apex[:, None], look[:, None], frames[None])


def misplaced_cones(robot: Robot, setup: Setup, q: Float[np.ndarray, " J"], errors: Misplaced) -> list[Cones]:
    """V_FOV at pose ``q`` (J,) rad for each drawn mounting, in the base frame (64-bit NumPy)."""
    apexes, looks = misplaced_axes(robot, setup, ring_values(setup), forward(robot.chain, q)[None], errors)
    return [Cones(a, x, *sensor_optics(setup)) for a, x in zip(apexes[:, 0], looks[:, 0], strict=True)]
