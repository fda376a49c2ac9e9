"""Angles of many points, by polynomials: XLA's own functions take ten times as long on CPUs, as
they are not vectorized.

Each polynomial interpolates an even function at Chebyshev points, in the square of its argument;
errors are below 4e-6 rad for azimuths and below 1e-6 for directions.
"""

import math
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float


def _interpolated(even: Callable[[Any], Any], degree: int) -> Float[np.ndarray, " D"]:
    """Return coefficients, highest first, of a polynomial in t² for a function of t in [0, 1]."""
    fit = np.polynomial.Chebyshev.interpolate(lambda s: even(np.sqrt(s)), degree, domain=(0, 1))
    highest_first: np.ndarray = fit.convert(kind=np.polynomial.Polynomial).coef[::-1]
    return highest_first


_ARCTAN = _interpolated(lambda t: np.arctan(t) / t, 5)
_COS = _interpolated(lambda t: np.cos(np.pi / 2 * t), 5)
_SIN = _interpolated(lambda t: np.sin(np.pi / 2 * t) / t, 5)
_NIL = 1e-30  # least divisor


def azimuth(x: Any, y: Any) -> Any:
    """Return atan2(y, x), rad."""
    low, high = jnp.minimum(abs(x), abs(y)), jnp.maximum(abs(x), abs(y))
    t = low / jnp.maximum(high, _NIL)
    angle = t * jnp.polyval(_ARCTAN, t * t)
    angle = jnp.where(abs(y) > abs(x), math.pi / 2 - angle, angle)
    return jnp.copysign(jnp.where(x < 0, math.pi - angle, angle), y)


def direction(turns: Any) -> tuple[Any, Any]:
    """Return cosine and sine of angles in full turns."""
    t = 2 * (turns - jnp.round(turns))  # half angle in quarter turns, -1 to 1
    cos, sin = jnp.polyval(_COS, t * t), t * jnp.polyval(_SIN, t * t)
    return 1 - 2 * sin * sin, 2 * sin * cos
