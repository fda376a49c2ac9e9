"""What a link carries beside its own body: tools and payloads."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from ..solids.capsules import Capsules
from ..solids.polyhedra import Polyhedron, placed
from ..solids.segments import point_to_segment

_SHORTER = 9  # lengths of an enclosing capsule's axis of which the best is taken


@dataclass(frozen=True)
class Attached:
    """A convex solid that a link carries. It belongs to the robot's body."""

    name: str
    """Name in messages and exports."""
    link: str
    """Link whose frame carries it: a link with a mount, a joint (the link that it moves), ``tcp``
    or ``base``."""
    solid: Capsules | Polyhedron
    """A single capsule, or a convex polyhedron, in that frame."""
    keys: dict[str, Any] = field(default_factory=dict)
    """The keys of the scene file that define it."""
    hulled: bool = False
    """Whether it is the convex hull of a non-convex shape."""

    def moved(self, T: Float[np.ndarray, "4 4"]) -> Capsules | Polyhedron:
        """Return the solid in the frame in which its own frame has the pose ``T`` (4, 4) m."""
        if isinstance(self.solid, Polyhedron):
            return placed(self.solid, T)
        start, end = (
            T[:3, :3] @ np.asarray(v) + T[:3, 3] for v in (self.solid.start, self.solid.end)
        )
        return Capsules(start, end, self.solid.radius)


@dataclass(frozen=True)
class CarriedPolyhedron:
    """A convex polyhedron that a joint or the base carries."""

    name: str
    """Name in messages and exports."""
    frame: int
    """Index into ``forward``'s frames, or ``BASE`` for the base frame."""
    body: Polyhedron
    """The polyhedron in that frame."""
    hulled: bool = False
    """Whether it is the convex hull of a non-convex shape."""

    @cached_property
    def enclosing(self) -> Capsules:
        """A capsule, in the same frame, that contains the polyhedron."""
        return enclosing_capsule(np.asarray(self.body.edges).reshape(-1, 3))


def enclosing_capsule(points: Float[np.ndarray, "N 3"]) -> Capsules:
    """Return a capsule that contains points (N, 3) m.

    Its axis lies along their principal axis; of several lengths, the one of the least volume is
    taken.
    """
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle)[2]  # (3, 3), the longest first
    along = (points - middle) @ axes.T
    low, high = along.min(axis=0), along.max(axis=0)
    centre, half = middle + ((low + high) / 2) @ axes, (high[0] - low[0]) / 2
    best = None
    for length in np.linspace(0, half, _SHORTER):
        start, end = centre - length * axes[0], centre + length * axes[0]
        radius = float(point_to_segment(points, start, end).max())
        capsule = Capsules(start, end, radius)
        if best is None or capsule.volume < best.volume:
            best = capsule
    assert best is not None
    return best
