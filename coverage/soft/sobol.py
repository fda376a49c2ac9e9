"""The Sobol sequence in three dimensions with Owen's linear matrix scrambling and a digital shift.

Point n is the exclusive or of the direction numbers v_b over the bits b of n's Gray code, with the
direction numbers of Joe and Kuo (2008). A random lower triangular matrix and a random shift over
GF(2) scramble them (Matousek 1998). The points are bit for bit those of
``scipy.stats.qmc.Sobol(3, seed=seed)``, whose import takes longer than a count.
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, UInt32

_BITS = 30
_VALUE = 2 ** np.arange(_BITS - 1, -1, -1, dtype=np.uint32)  # value of each bit, highest first


def _directions() -> UInt32[np.ndarray, "3 b"]:
    """Return the unscrambled direction numbers of the three dimensions, as integers."""
    second, third = [1], [1, 3]
    for _ in range(1, _BITS):
        second.append(second[-1] << 1 ^ second[-1])
    for _ in range(2, _BITS):
        third.append(third[-1] << 1 ^ third[-2] << 2 ^ third[-2])
    return np.array([[1] * _BITS, second, third], np.uint32) * _VALUE


def _scrambled(seed: int) -> tuple[UInt32[np.ndarray, "3 b"], UInt32[np.ndarray, " 3"]]:
    """Return the scrambled direction numbers and the shift of a seed."""
    rng = np.random.default_rng(seed)
    shift = rng.integers(2, size=(3, _BITS), dtype=np.uint32) @ _VALUE[::-1]
    matrix = np.tril(rng.integers(2, size=(3, _BITS, _BITS), dtype=np.uint32), -1)
    matrix += np.eye(_BITS, dtype=np.uint32)
    bits = (_directions()[:, None] // _VALUE[:, None]) & 1  # (3, bit, number)
    return np.einsum("dpj,p->dj", matrix @ bits & 1, _VALUE), shift


def _combined(directions: UInt32[np.ndarray, "3 b"], number: int) -> UInt32[np.ndarray, " 3"]:
    """Return the exclusive or of the direction numbers over the bits of a number's Gray code."""
    gray = number ^ number >> 1
    bits = [b for b in range(_BITS) if gray >> b & 1]
    combined: np.ndarray = np.bitwise_xor.reduce(directions[:, bits], axis=1)
    return combined


def sobol(size: int, seed: int) -> Iterator[Float[np.ndarray, "{size} 3"]]:
    """Yield the scrambled sequence in [0, 1)^3, ``size`` points at a time, a power of two."""
    directions, shift = _scrambled(seed)
    first = np.array([_combined(directions, n) for n in range(size)]) ^ shift
    for start in range(0, 2**_BITS, size):
        # the Gray code of start + n combines those of start and of n, whose bits do not overlap
        yield (first ^ _combined(directions, start)) * 2.0**-_BITS
