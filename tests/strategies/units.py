"""Numbers, points and directions in millimetres and degrees, and random samples of points."""

import numpy as np
from hypothesis import strategies as st

GENERATORS = st.integers(0, 2**32 - 1).map(np.random.default_rng)
"""For points and directions that a law compares in bulk; printed as ``default_rng(0)``."""

FACINGS = st.tuples(st.integers(-180, 180), st.integers(-90, 90))
"""Azimuth and elevation of a direction, degrees; (0, 0) is +x."""

TURNS = st.tuples(*[st.integers(-180, 180)] * 3)
"""Angles about x, y and z, degrees."""


def points_mm(extent: int) -> st.SearchStrategy[tuple[int, int, int]]:
    """Points of a cube about the origin; ``extent`` is half its side, mm."""
    return st.tuples(*[st.integers(-extent, extent)] * 3)


def metres(mm: object) -> np.ndarray:
    """Millimetres in metres, in an array."""
    return np.asarray(mm, float) / 1000


def directions(facing_deg: object) -> np.ndarray:
    """Unit vectors (..., 3) of azimuths and elevations (..., 2), degrees."""
    azimuth, elevation = np.moveaxis(np.radians(np.asarray(facing_deg, float)), -1, 0)
    flat = np.cos(elevation)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=-1)


def ups(facing_deg: object, roll_deg: object) -> np.ndarray:
    """Unit vectors (..., 3) across ``directions``: towards +z, rolled about the direction."""
    facing = np.asarray(facing_deg, float)
    ahead = directions(facing)
    up = directions(facing + np.array([0.0, 90.0]))
    roll = np.radians(np.asarray(roll_deg, float))[..., None]
    return np.cos(roll) * up + np.sin(roll) * np.cross(ahead, up)


def uniform_directions(rng: np.random.Generator, n: int) -> np.ndarray:
    """Unit vectors (n, 3), uniform on the sphere."""
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def failures(points: np.ndarray, holds: np.ndarray) -> list[str]:
    """The first three of the points (N, 3), m, at which a law does not hold (N,).

    ``assert failures(points, holds) == []`` names the places.
    """
    where = np.flatnonzero(~np.asarray(holds))
    each = ["({:.6g}, {:.6g}, {:.6g}) mm".format(*1000 * points[i]) for i in where[:3]]
    return each if len(where) <= 3 else [*each, f"{len(where)} of {len(points)} points"]
