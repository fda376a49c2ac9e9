"""Mounting errors of one ring, for points that are drawn separately for each mounting."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ...coverage.rings.mounting_errors import Misplaced


class RingErrors(NamedTuple):
    """Errors of one ring of at most J sensors in D mountings, as in ``Misplaced``."""

    slip: Float[np.ndarray, " D"]
    """Displacement along the mount's axis, m."""
    rotation: Float[np.ndarray, "D 3 3"]
    """Rotation of the ring about its centre, in the mount's coordinates."""
    seat: Float[np.ndarray, "D J 3"]
    """Direction in which each sensor looks: its parts along the intended axis, along the beam's
    intended ``up``, and along the ring."""

    @property
    def widest(self) -> float:
        """Largest angle between a sensor's axis and the intended one, rad."""
        return float(np.arccos(np.clip(self.seat[..., 0].min(initial=1.0), -1.0, 1.0)))


def ring_errors(errors: Misplaced, ring: int, sensors: Sequence[int]) -> RingErrors:
    """Return the errors of ring ``ring`` and of its sensors, which have the numbers ``sensors``."""
    seat = np.asarray(errors.seat)[:, sensors]  # (D, J, 2)
    astray = np.hypot(seat[..., 0], seat[..., 1])  # (D, J)
    aside = np.sinc(astray / np.pi)[..., None] * seat
    looks = np.concatenate([np.cos(astray)[..., None], aside], axis=-1)
    turn = Rotation.from_rotvec(np.asarray(errors.turn)[:, ring]).as_matrix()
    slip = np.asarray(errors.slip)[:, ring]
    return RingErrors(*(a.astype(np.float32) for a in (slip, turn, looks)))
