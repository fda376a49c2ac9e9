"""Mounting errors of a ring, and the derivatives of the distances to the cell with
respect to them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from ...coverage.rings.ring import Ring, Setup
from ...objectives.scene import Scene
from ..sensing.expected import beams_at, only, to_body

# m along the link towards distal, rad, rad, m that its sensors read too much
NAMES = ("slip", "tilt", "phase", "offset")
# errors of careful mounting and good sensors
LIMITS = np.array([0.02, np.radians(5.0), np.radians(5.0), 0.02])
_STEP = 1e-6  # m and rad, of finite differences
_STEEP = 6.0  # m per m or rad


def free(scene: Scene, ring: Ring) -> Int[np.ndarray, " p"]:
    """Return the indices of ``NAMES`` that apply to a ring: a ring with a fixed position along the
    axis cannot slip.
    """
    return np.arange(4) if scene.robot.mount(ring.link).length > 0 else np.arange(1, 4)


def moved(scene: Scene, ring: Ring, values: Float[np.ndarray, " 4"]) -> Ring:
    """Return the ring with errors ``values`` (4,) of ``NAMES``; the offset does not move it."""
    length = scene.robot.mount(ring.link).length
    slip = values[0] / length if length > 0 else 0.0
    return replace(
        ring,
        position=ring.position + slip,
        tilt=ring.tilt + values[1],
        phase=ring.phase + values[2],
    )


def both_ways(rings: Sequence[Ring]) -> tuple[Setup, Setup]:
    """Return the rings as they are, and each mounted the other way round."""
    return Setup(tuple(rings)), Setup(tuple(replace(r, tilt=-r.tilt) for r in rings))


def slopes(
    scene: Scene, ring: Ring, joints: Float[np.ndarray, "P J"], which: Bool[np.ndarray, "P n"]
) -> tuple[Float[np.ndarray, " M"], Float[np.ndarray, "M 4"]]:
    """Return the distances (M,) m of the nearest surface of the cell in the beams of a ring of n
    sensors, and their derivatives (M, 4) by ``NAMES``, for the M pairs of joint vector and sensor
    in ``which``.

    Without a surface, the distance is the sensor's range. Where a distance jumps, a derivative is
    very large. The derivatives assume that the nearest body stays the same one under a small
    displacement.
    """
    rings = [ring, *(moved(scene, ring, _STEP * unit) for unit in np.eye(4)[:3])]
    beams, bodies = beams_at(scene, Setup(tuple(rings)), joints), [o.body for o in scene.obstacles]
    index = np.arange(len(beams)).reshape(len(joints), 4, ring.count).transpose(1, 0, 2)[:, which]
    here = only(beams, index[0])
    gaps = np.array([to_body(here, body) for body in bodies])
    nearest, most = gaps.argmin(axis=0), here.range_m / np.cos(here.half_angle)
    distance, by = np.minimum(gaps.min(axis=0), most), np.ones((len(most), 4))
    for i, body in enumerate(bodies):
        near = np.flatnonzero((nearest == i) & (distance < most))
        beside = to_body(only(beams, index[1:, near].ravel()), body).reshape(3, -1)
        by[near, :3] = ((beside - distance[near]) / _STEP).T
    by[distance >= most, :3] = 0.0
    return distance, by


def grazing(by: Float[np.ndarray, "M 4"]) -> Bool[np.ndarray, " M"]:
    """Return which distances change by more than six times the displacement: where the side of a
    beam grazes a surface or an edge. Such a reading would outweigh all others, and it is not even
    nearly linear.
    """
    return ~np.asarray((np.abs(by[:, :3]) <= _STEEP).all(axis=1))
