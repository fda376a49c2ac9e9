"""Geometry of lines and circles for fitting capsules and finding tubes."""

import numpy as np
from jaxtyping import Float

_STEPS = 40


def across(axis: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "2 3"]:
    """Return two unit vectors (2, 3) that complete a unit vector (3,) to a right-handed frame."""
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u = u / np.linalg.norm(u)
    return np.stack([u, np.cross(axis, u)])


def circle_centre(xy: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, " 2"]:
    """Return the approximate centre (2,) m of the smallest circle around points (N, 2) m, by steps
    towards the farthest point (Bădoiu and Clarkson, 2003)."""
    centre: np.ndarray = (xy.min(axis=0) + xy.max(axis=0)) / 2
    for i in range(1, _STEPS):
        far = xy[np.argmax(((xy - centre) ** 2).sum(axis=1))]
        centre = centre + (far - centre) / (2 * i + 2)
    return centre
