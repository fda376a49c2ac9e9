"""The errors of a ring's mounting that a check estimates, and how the distances to the cell depend on them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from ..coverage.rings import Ring, Setup
from ..objectives.scene import Scene
from .expected import beams_at, only, to_cell

NAMES = ("slip", "tilt", "phase", "offset")  # m along the link towards distal, rad, rad, m that its sensors tell too much
LIMITS = np.array([0.02, np.radians(5.0), np.radians(5.0), 0.02])  # what a careful mount and a good sensor keep within
_STEP = 1e-6  # m and rad, of differences
_STEEP = 50.0  # a slope beyond that is a jump from one thing to another


def free(scene: Scene, ring: Ring) -> Int[np.ndarray, " p"]:
    """Which of ``NAMES`` a ring can err by: where its place along the axis is fixed it does not slip."""
    return np.arange(4) if scene.robot.mount(ring.link).length > 0 else np.arange(1, 4)


def moved(scene: Scene, ring: Ring, values: Float[np.ndarray, " 4"]) -> Ring:
    """The ring with errors ``values`` (4,) of ``NAMES``; the offset does not move it."""
    length = scene.robot.mount(ring.link).length
    slip = values[0] / length if length > 0 else 0.0
    return replace(ring, position=ring.position + slip, tilt=ring.tilt + values[1], phase=ring.phase + values[2])


def to_cell_of(
    scene: Scene, rings: Sequence[Ring], joints: Float[np.ndarray, "P J"], which: Bool[np.ndarray, "P n"]
) -> Float[np.ndarray, "V M"]:
    """Distances (V, M) m of the cell's nearest surface in the beams of V variants of a ring of n sensors, for the M pairs of
    joint vector and sensor of ``which``; where there is none the sensor's range."""
    beams, count = beams_at(scene, Setup(tuple(rings)), joints), rings[0].count
    index = np.arange(len(beams)).reshape(len(joints), len(rings), count).transpose(1, 0, 2)[:, which]
    some = only(beams, index.ravel())
    found = to_cell(some, tuple(o.body for o in scene.obstacles))
    return np.minimum(found, some.range_m / np.cos(some.half_angle)).reshape(index.shape)


def slopes(
    scene: Scene,
    ring: Ring,
    joints: Float[np.ndarray, "P J"],
    which: Bool[np.ndarray, "P n"],
) -> tuple[Float[np.ndarray, " M"], Float[np.ndarray, "M 4"]]:
    """The distances (M,) m of ``to_cell_of``, and their derivatives (M, 4) by ``NAMES`` at the ring as it is; 0 where a
    distance jumps."""
    rings = [ring, *(moved(scene, ring, _STEP * one) for one in np.eye(4)[:3])]
    found = to_cell_of(scene, rings, joints, which)
    by = np.ones((found.shape[1], 4))
    by[:, :3] = ((found[1:] - found[0]) / _STEP).T
    by[np.abs(by) > _STEEP] = 0.0
    return found[0], by
