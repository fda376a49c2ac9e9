"""Numbers and polygons of mesh files, within limits that hold before any work."""

import warnings
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ...coverage.definitions.errors import shown

MOST_TRIANGLES = 1_000_000  # of a file
MOST_CORNERS = 10_000  # of a polygon
MOST_PARTS = 20_000  # nodes, or surfaces that nodes place
_MOST_NUMBERS = 20 * MOST_TRIANGLES  # of one text
Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # to z-up
AGAIN = "export the mesh again"


class MeshError(ValueError):
    """Raised for a mesh that cannot be used; the message completes "allowed: ..."."""


def numbers(text: str | bytes, dtype: type, what: str) -> Any:
    """Return the numbers (N,) in a text.

    Args:
        text: numbers with blanks or line ends between them.
        dtype: type of the numbers.
        what: what they are, for messages.

    Raises:
        MeshError: if the text has anything else, or too many numbers.
    """
    blank, line = (" ", "\n") if isinstance(text, str) else (b" ", b"\n")
    bounded(text.count(blank) + text.count(line), _MOST_NUMBERS, "numbers")  # type: ignore[arg-type]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, dtype, sep=" ")
        except (ValueError, OverflowError, Warning) as error:
            raise MeshError(f"numbers only as {what}; {AGAIN}") from error


def bounded(found: int, most: int, what: str) -> None:
    """Refuse a mesh of more than ``most``.

    Raises:
        MeshError: if ``found`` is larger.
    """
    if found > most:
        raise MeshError(f"at most {most} {what} (it has {shown(found)})")


def fans(corners: Int[np.ndarray, " P"]) -> Int[np.ndarray, "T 3"]:
    """Return the triangles (T, 3) of polygons, as numbers of corners, each from a polygon's first.

    Args:
        corners: number (P,) of corners of each polygon.

    Raises:
        MeshError: for a polygon of fewer than 3 or too many corners, or too many triangles.
    """
    if not len(corners):
        return np.zeros((0, 3), np.int64)
    if (least := int(corners.min())) < 3:
        raise MeshError(f"polygons of 3 corners or more (one has {least}); {AGAIN}")
    bounded(int(corners.max()), MOST_CORNERS, "corners of a polygon")
    bounded(int(corners.sum()) - 2 * len(corners), MOST_TRIANGLES, "triangles")
    first, step = _steps(corners)
    triangles: np.ndarray = np.stack([first, first + step + 1, first + step + 2], axis=1)
    return triangles


def strips(corners: Int[np.ndarray, " P"]) -> Int[np.ndarray, "T 3"]:
    """Return the triangles (T, 3) of strips, as numbers of corners. Every second one of a strip is
    turned, so that all face one way.

    Args:
        corners: number (P,) of corners of each strip; fewer than 3 make no triangle.
    """
    first, step = _steps(corners)
    first, odd = first + step, step % 2
    triangles: np.ndarray = np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)
    return triangles


def _steps(corners: Int[np.ndarray, " P"]) -> tuple[Int[np.ndarray, " T"], Int[np.ndarray, " T"]]:
    """Return the first corner of the fan or strip of each triangle, and its number there."""
    count = np.maximum(corners - 2, 0)
    first = np.repeat(np.cumsum(corners) - corners, count)
    return first, np.arange(len(first)) - np.repeat(np.cumsum(count) - count, count)


def picked(
    points: Float[np.ndarray, "V 3"], index: Int[np.ndarray, "T 3"]
) -> Float[np.ndarray, "T 3 3"]:
    """Return the triangles (T, 3, 3) of the points with these numbers, from 0.

    Raises:
        MeshError: for a number that no point has, or a coordinate that is not finite.
    """
    if len(index) and not (index.min() >= 0 and index.max() < len(points)):
        odd = index[(index < 0) | (index >= len(points))][0]
        raise MeshError(
            f"corners among the {len(points)} points of the mesh (one is number {odd}, from 0);"
            f" {AGAIN}"
        )
    triangles: np.ndarray = points[index]
    if not np.isfinite(triangles).all():
        bad = int((~np.isfinite(triangles)).any(axis=(1, 2)).sum())
        raise MeshError(
            f"triangles of finite numbers ({bad} of {len(triangles)} have others); {AGAIN}"
        )
    return triangles


def placed(
    triangles: Float[np.ndarray, "T 3 3"], T: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "T 3 3"]:
    """Return triangles (T, 3, 3) transformed by T (4, 4), which may scale and mirror: the order of
    corners turns with a mirror, so that faces stay outward."""
    with np.errstate(over="ignore", invalid="ignore"):
        moved: np.ndarray = triangles @ T[:3, :3].T + T[:3, 3]
        mirrored = float(np.linalg.det(T[:3, :3])) < 0
    return moved[:, ::-1] if mirrored else moved
