"""Geometry of lines and circles for fitting capsules and finding tubes."""

import numpy as np
from jaxtyping import Float

_STEPS = 40


def across(axis: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "2 3"]:
    """Return two unit vectors (2, 3) that complete a unit vector (3,) to a right-handed frame."""
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u = u / np.linalg.norm(u)
    return np.stack([u, np.cross(axis, u)])


def circle_centre(xy: Float[np.ndarray, "*batch N 2"]) -> Float[np.ndarray, "*batch 2"]:
    """Return the approximate centres (..., 2) m of the smallest circles around sets of points
    (..., N, 2) m, by steps towards the farthest point (Bădoiu and Clarkson, 2003)."""
    centre: np.ndarray = (xy.min(axis=-2) + xy.max(axis=-2)) / 2
    for i in range(1, _STEPS):
        farthest = ((xy - centre[..., None, :]) ** 2).sum(axis=-1).argmax(axis=-1)
        far = np.take_along_axis(xy, farthest[..., None, None], axis=-2)[..., 0, :]
        centre = centre + (far - centre) / (2 * i + 2)
    return centre
