"""Quadrics: polynomials of degree 2 of the offset from a centre, by their coefficients of 1, x, y,
z, x^2, y^2, z^2, xy, xz, yz; of degree 1 by the first four. A solid states quadrics that are all at
least 0 inside it, and at no point outside.
"""

import numpy as np
from jaxtyping import Float

from ..arrays import Array, Numbers, dot


def product(a: Array, along_a: Array, b: Array, along_b: Array) -> Float[np.ndarray, "10 P"]:
    """Return the quadric (a + along_a . o)(b + along_b . o) of the offset o from a centre.

    a, b are (P,) and along_a, along_b (P, 3).
    """
    m, n = along_a.T, along_b.T
    q = np.empty((10, m.shape[1]))
    q[0] = a * b
    q[1:4] = a * n + b * m
    q[4:7] = m * n
    for k, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
        q[7 + k] = m[i] * n[j] + m[j] * n[i]
    return q


def plane(value: Array, normal: Array) -> Float[np.ndarray, "4 P"]:
    """Return the polynomial value + normal . o of the offset o from a centre, ``normal`` (P, 3)."""
    return np.concatenate([value[None], normal.T])


def within(radius: Numbers, v: Array, share: Numbers = 1.0) -> Float[np.ndarray, "10 P"]:
    """Return the quadric radius^2 - share |v + o|^2 of the offset o from a centre.

    ``radius`` and ``share`` are (P,) or scalar, ``v`` is (P, 3).
    """
    q = np.zeros((10, len(v)))
    q[0] = radius * radius - share * dot(v, v)
    q[1:4] = -2 * share * v.T
    q[4:7] = -share
    return q
