"""Balls about points that beams are to meet: which of them a sensor sees a part of.

A ball meets a convex beam where the point of the beam nearest to its centre lies in it. A body may
hide that point, but not the whole of what the beam and the ball share. Then points of the beam
nearest to eight places on the ball's rim, across the axis, are looked at as well: shadows run along
the beam. What is found is there; a narrower gap between two shadows may be missed.
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ..sensors.sensor import Sensor
from ..solids.beams import InBeam

_RIM = [(math.cos(a), math.sin(a)) for a in np.arange(8) * (math.pi / 4)]
STEPS = np.array([(0.0, 0.0), *_RIM], np.float32)
"""Places in a ball, across the axis and along ``up``, in radii: the centre, then its rim."""
_ROUND = np.float32(1 + 1e-5)  # by which places on the rim may lie outside the ball by rounding


class MetBalls(NamedTuple):
    """T balls at a sensor."""

    met: Bool[np.ndarray, " T"]
    """Whether the place lies in the ball."""
    moved: Float[np.ndarray, "T 3"]
    """Way from the ball's centre to the place, m: along the axis, across, and along ``up``."""


def met_balls(
    sensor: Sensor, at: InBeam, ball: Float[np.ndarray, " T"], step: Float[np.ndarray, " 2"]
) -> MetBalls:
    """Return the places of a beam nearest to a place in each of T balls, without occlusion.

    Args:
        sensor: the sensor.
        at: centres of the balls in the frame of its beam.
        ball: their radii, m.
        step: the place in the ball, one of ``STEPS``.
    """
    across, up = (v + ball * s for v, s in zip((at.across, at.up), step, strict=True))
    near = sensor.nearest(InBeam(at.along, across, up))
    ways = near.along - at.along, near.across - at.across, near.up - at.up
    moved = np.stack(ways, axis=1)
    return MetBalls(np.square(moved).sum(axis=1) <= np.square(ball * _ROUND), moved)
