"""Simple solids, by manifold3d. Millimetres."""

import manifold3d as m3
from manifold3d import Manifold

FACETS = 96  # facets of a circle about the link
SMALL = 16  # facets of a hole


def union(parts: list[Manifold]) -> Manifold:
    """Return the union of solids; the empty solid for none."""
    return Manifold.batch_boolean(parts, m3.OpType.Add) if parts else Manifold()


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Manifold:
    """Return the box between two corners."""
    size = tuple(b - a for a, b in zip(low, high, strict=True))
    return Manifold.cube((size[0], size[1], size[2])).translate(low)


def tube(radius: float, low: float, high: float, facets: int = FACETS) -> Manifold:
    """Return the upright cylinder about the z axis between two heights."""
    return Manifold.cylinder(high - low, radius, radius, facets).translate((0.0, 0.0, low))
