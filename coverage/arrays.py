"""Array types, and the rule by which NumPy and JAX share code: each array supplies its namespace.

This module does not load JAX: unless another module has loaded it, no array can be a JAX array.
"""

import sys
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    import jax

    Array: TypeAlias = np.ndarray | jax.Array
elif "jax" in sys.modules:
    # NumPy turns 0-dimensional arrays into its scalar types, which np.ndarray does not cover.
    Array: TypeAlias = np.ndarray | np.generic | sys.modules["jax"].Array
else:
    Array: TypeAlias = np.ndarray | np.generic

Numbers: TypeAlias = Array | float
"""An array of any shape that broadcasts, or a single number."""
Index: TypeAlias = Array | int
"""An index of array rows: an integer, an integer array or a Boolean array."""
Vector: TypeAlias = Array | tuple[float, ...] | list[float]
"""Coordinates as a user or a file states them."""


def namespace(array: Numbers) -> Any:
    """Return the array API namespace of ``array``.

    It is ``numpy`` for a NumPy array or scalar and ``jax.numpy`` for a JAX array, traced or not.
    """
    some: Any = array
    return some.__array_namespace__()


def dot(a: Array, b: Array) -> Any:
    """Return the inner product over the last axis (3), written out term by term.

    A matrix product may round differently for other batch shapes. This product does not, so a
    point has the same value wherever it is computed. The exact count relies on that.
    """
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def cross(a: Array, b: Array) -> Any:
    """Return the cross product over the last axis (3), NumPy or JAX, written out as in ``dot``."""
    a1, a2, a3 = (a[..., i] for i in range(3))
    b1, b2, b3 = (b[..., i] for i in range(3))
    return namespace(a).stack([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1], axis=-1)


def root(square: Numbers) -> Any:
    """Return the square root, with value 0 and gradient 0 at and below 0.

    JAX inputs at or below 0 are replaced before the root is taken, so gradients stay finite.
    """
    xp = namespace(square)
    if xp is np:
        return np.sqrt(np.maximum(square, 0.0))
    positive = square > 0
    return xp.where(positive, xp.sqrt(xp.where(positive, square, 1.0)), 0.0)


def rows(array: Array, index: Index) -> Any:
    """Return ``array[..., index, :]`` of ``array`` (..., K, 3), with contiguous components.

    Arithmetic on single components then reads memory sequentially; it takes most of the octree's
    time.
    """
    if np.ndim(index) == 0:
        return array[..., index, :]
    xp = namespace(array)
    taken = xp.take(array.transpose(array.ndim - 1, *range(array.ndim - 1)), index, axis=-1)
    return taken.transpose(*range(1, taken.ndim), 0)
