"""Geometry of lines and circles for fitting capsules and finding tubes."""

import math

import numpy as np
from jaxtyping import Float

_STEPS = 40


def across(axis: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "2 3"]:
    """Return two unit vectors (2, 3) that complete a unit vector (3,) to a right-handed frame."""
    x, y, z = (float(v) for v in axis)
    least = min((abs(x), 0), (abs(y), 1), (abs(z), 2))[1]
    a, b, c = ((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0))[least]  # the axis times that unit vector
    n = math.sqrt(a * a + b * b + c * c)
    a, b, c = a / n, b / n, c / n
    return np.array([[a, b, c], [y * c - z * b, z * a - x * c, x * b - y * a]])


def circle_centre(xy: Float[np.ndarray, "*batch N 2"]) -> Float[np.ndarray, "*batch 2"]:
    """Return the approximate centres (..., 2) m of the smallest circles around sets of points
    (..., N, 2) m, by steps towards the farthest point (Bădoiu and Clarkson, 2003)."""
    centre: np.ndarray = (xy.min(axis=-2) + xy.max(axis=-2)) / 2
    xy = xy - centre[..., None, :]  # small numbers, for the difference of squares below
    middle: np.ndarray = centre
    centre = np.zeros_like(middle)
    x, y = np.ascontiguousarray(xy[..., 0]), np.ascontiguousarray(xy[..., 1])
    square = x * x + y * y
    for i in range(1, _STEPS):
        # the square of the distance, less that of the centre, which is the same for all
        away = square - (2 * centre[..., :1]) * x - (2 * centre[..., 1:]) * y
        farthest = away.argmax(axis=-1)
        far = np.take_along_axis(xy, farthest[..., None, None], axis=-2)[..., 0, :]
        centre = centre + (far - centre) / (2 * i + 2)
    centred: np.ndarray = middle + centre
    return centred
