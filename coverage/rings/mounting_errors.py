"""Mounting errors: rings and sensors that deviate slightly from their design.

A ring errs as a rigid body. It slips along the mount axis, tilts about the two axes across the
mount axis, and turns about the mount axis, all about its centre. A single sensor errs as a ring of
one does: it slips along ``up``. In addition, each sensor's axis is rotated about the two axes
across it. All errors are fixed to the link, so one mounted setup has the
same errors in every pose.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float
from pydantic import Field

from ..arrays import Array, cross, dot, namespace
from ..choices import Law
from ..definitions.definition import definition
from ..definitions.units import Degrees, Millimetres
from ..robots.kinematics import forward
from ..robots.robot import Robot
from ..solids.beams import Beams
from .ring import Setup
from .ring_kinematics import (
    RingArrays,
    SensorPoses,
    seats,
    seen_from,
)


@definition
class MountingErrors:
    """The size of mounting errors."""

    position: Annotated[float, Millimetres("position_mm", 9, ge=0, le=1000)] = 0.005
    """Error along the mount axis, m."""
    direction: Annotated[float, Degrees("direction_deg", ge=0, le=45)] = math.radians(2.0)
    """Error of each of a ring's three rotations and of each of a sensor's two, rad."""
    law: Law = "uniform"
    """``uniform``: up to these limits either way. ``normal``: with half of them as standard
    deviations, so that 95 % stay within them."""


@definition
class Mountings(MountingErrors):
    """Random mountings within errors."""

    draws: Annotated[int, Field(ge=1, le=100_000)] = 100
    """Number of mountings."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Random seed of the mountings."""


@dataclass(frozen=True)
class Misplaced:
    """D drawn errors of a setup of R rings and K sensors."""

    slip: Float[Array, "D R"]
    """Displacement of each ring along the mount axis, m."""
    turn: Float[Array, "D R 3"]
    """Rotation vector of each ring by its mount's zero, side and axis, rad."""
    seat: Float[Array, "D K 2"]
    """Rotation of each sensor's axis, out of its ring's plane towards distal and along its ring,
    rad."""

    def __len__(self) -> int:
        return self.slip.shape[0]

    @property
    def rotations(self) -> Float[np.ndarray, "D R 3 3"]:
        """Rotation of each ring about its centre, in the mount's coordinates."""
        from scipy.spatial.transform import Rotation

        turn = np.asarray(self.turn)
        matrices: np.ndarray = Rotation.from_rotvec(turn.reshape(-1, 3)).as_matrix()
        return matrices.reshape(*turn.shape, 3)

    @property
    def looks(self) -> Float[np.ndarray, "D K 3"]:
        """Direction in which each sensor looks: its parts along the intended axis, along the beam's
        intended ``up``, and along the ring."""
        seat = np.asarray(self.seat)
        astray = np.hypot(seat[..., 0], seat[..., 1])[..., None]
        return np.concatenate([np.cos(astray), np.sinc(astray / np.pi) * seat], axis=-1)

    def beside(self, still: int) -> "Misplaced":
        """Return the errors with ``still`` more single sensors, which have none."""
        more = ((0, 0), (0, still))
        return Misplaced(
            np.pad(self.slip, more),
            np.pad(self.turn, (*more, (0, 0))),
            np.pad(self.seat, (*more, (0, 0))),
        )


def draw_errors(
    rings: int, sensors: int, errors: MountingErrors, draws: int, seed: int
) -> Misplaced:
    """Draw the errors of ``draws`` mountings of a setup.

    The draws are common random numbers. Those of a ring or sensor depend only on the seed and its
    index, and a larger number of draws starts with the same ones. Comparisons between setups, error
    sizes and numbers of draws thus share their Monte Carlo error.

    Args:
        rings: number of rings.
        sensors: number of sensors.
        errors: size and distribution of the errors.
        draws: number of mountings to draw.
        seed: random seed.
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
    """Return the actual poses of sensors, all (D, K, 3), for each drawn mounting.

    ``meant`` holds their poses as designed.
    """
    apex, look, centre, along, radial = (v[None] for v in meant)
    xp, dtype, ring = namespace(look), look.dtype, arrays.ring

    def like(values: Array) -> Any:
        return xp.asarray(values, dtype=dtype)

    tangent = cross(along, radial)
    ahead, up, sideways = (like(errors.looks[..., i : i + 1]) for i in range(3))
    look = ahead * look + up * cross(look, tangent) + sideways * tangent

    square = dot(errors.turn, errors.turn)[..., None]
    # at angle 0 the products vanish for any factor
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
        """Rotate ``v`` by the rings' rotations (Rodrigues); at angle 0 exactly ``v``."""
        across = cross(turn, v)
        return v + (sine * across + cosine * cross(turn, across))

    slipped = centre + like(errors.slip)[:, ring, None] * along
    return SensorPoses(
        slipped + turned(apex - centre), turned(look), slipped, turned(along), turned(radial)
    )


def seated(seat: Array, along: Array, across: Array, up: Array) -> tuple[Any, Any, Any]:
    """Return the coordinates of points along, across and up the axis of a misplaced sensor.

    Args:
        seat: (3, ...), direction in which the sensor looks; see ``Misplaced.looks``.
        along, across, up: (...) m, coordinates about the intended axis.
    """
    straight, raised, aside = seat
    level = namespace(along).sqrt(straight**2 + raised**2)
    ahead = straight * along + raised * up
    return (
        ahead + aside * across,
        level * across - aside / level * ahead,
        (straight * up - raised * along) / level,
    )


def misplaced_cones(
    robot: Robot, setup: Setup, q: Float[np.ndarray, " J"], errors: Misplaced
) -> list[Beams]:
    """Return V_FOV at pose ``q`` (J,) rad for each drawn mounting, base frame (64-bit NumPy)."""
    here, seat = seats(robot, setup.groups)
    there = misplaced(here, seat, errors)
    each = zip(*seen_from(here, there, forward(robot.chain, q), up=True), strict=True)
    return [here.beams.solids(*seats) for seats in each]
