"""Array types and the one rule by which NumPy and JAX share code: ask the array for its
namespace.

JAX is not loaded here: where nothing else has loaded it, no array can be one of its.
"""

import sys
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    import jax

    Array: TypeAlias = np.ndarray | jax.Array
elif "jax" in sys.modules:
    # NumPy turns arrays without axes into its scalars, which its own types overlook.
    Array: TypeAlias = np.ndarray | np.generic | sys.modules["jax"].Array
else:
    Array: TypeAlias = np.ndarray | np.generic

Numbers: TypeAlias = Array | float
"""Numbers of any shape that broadcast: an array, or a single one."""
Index: TypeAlias = Array | int
"""What chooses rows of an array: one number, or an array of numbers or truth values."""
Vector: TypeAlias = Array | tuple[float, ...] | list[float]
"""Coordinates as a person or a file gives them."""


def namespace(array: Numbers) -> Any:
    """The array API namespace of ``array``: ``numpy`` for a NumPy array or scalar, ``jax.numpy``
    for a JAX array (traced or not).
    """
    some: Any = array
    return some.__array_namespace__()


def dot(a: Array, b: Array) -> Any:
    """Inner product over the last axis (3), spelled out.

    A matrix product may round differently for other batch shapes; this does not, so a point has one
    value wherever it is computed. The exact count rests on that.
    """
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def cross(a: Array, b: Array) -> Any:
    """Cross product over the last axis (3), NumPy or JAX, spelled out as ``dot`` is."""
    a1, a2, a3 = (a[..., i] for i in range(3))
    b1, b2, b3 = (b[..., i] for i in range(3))
    return namespace(a).stack([a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1], axis=-1)


def root(square: Numbers) -> Any:
    """Square root with value 0 and gradient 0 at (and below) 0: the dangerous input is replaced
    before the root.
    """
    xp = namespace(square)
    if xp is np:
        return np.sqrt(np.maximum(square, 0.0))
    positive = square > 0
    return xp.where(positive, xp.sqrt(xp.where(positive, square, 1.0)), 0.0)


def rows(array: Array, index: Index) -> Any:
    """``array[..., index, :]`` for ``array`` (..., K, 3), laid out so that each component lies
    contiguous in memory.

    Arithmetic on single components then runs through memory once, which is most of the octree's
    time.
    """
    if np.ndim(index) == 0:
        return array[..., index, :]
    xp = namespace(array)
    taken = xp.take(array.transpose(array.ndim - 1, *range(array.ndim - 1)), index, axis=-1)
    return taken.transpose(*range(1, taken.ndim), 0)
