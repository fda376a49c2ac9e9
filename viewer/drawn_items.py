"""What a drawing consists of: meshes, points and lines of one colour each."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True)
class DrawnMesh:
    """A triangle mesh."""

    vertices: Float[np.ndarray, "V 3"]
    """Vertices, m."""
    faces: Int[np.ndarray, "T 3"]
    """Vertex indices of the triangles."""
    colour: str
    """Colour as ``#rrggbb``."""
    opacity: float = 1.0
    """Opacity in [0, 1]."""
    ring: int | None = None
    """Index of the ring or single sensor that a click on the mesh selects, or None."""


@dataclass(frozen=True)
class Dots:
    """Points of one colour."""

    points: Float[np.ndarray, "N 3"]
    """Positions, m."""
    colour: str
    """Colour as ``#rrggbb``."""
    size: float
    """Size of a point, m."""


@dataclass(frozen=True)
class Edges:
    """Lines of one colour."""

    ends: Float[np.ndarray, "E 2 3"]
    """End points, m."""
    colour: str
    """Colour as ``#rrggbb``."""
    width: float
    """Width on the screen, pixels."""


Item = DrawnMesh | Dots | Edges
