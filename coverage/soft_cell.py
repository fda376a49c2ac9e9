"""Beams past the obstacles of a cell, as the soft estimator sees them: convex polyhedra throw shadows with plane sides.

What an obstacle hides is counted, and points that it hides pull nothing; that its shadow moves with the apex is left out of
the slopes, as the exact count does not miss it.
"""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from .polyhedra import Polyhedron, largest, polyhedron_shadow
from .soft_beams import Near, SoftBeams
from .soft_hidden import Hidden
from .soft_square import soft_beams
from .solids import Cones


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class InCell:
    """Cones, or beams of both shapes, past bodies or not, among obstacles."""

    seen: Cones | Hidden
    obstacles: tuple[Polyhedron, ...]


class CellBeams(SoftBeams):
    """See ``SoftBeams``: those of what is seen, less the obstacles' shadows."""

    def __init__(self, cell: InCell) -> None:
        self._inner = soft_beams(cell.seen)
        self.cones, self.count, self.columns = self._inner.cones, self._inner.count, self._inner.columns
        apex = self.cones.apex
        shadows = [[a.astype(apex.dtype) for a in polyhedron_shadow(apex, body)] for body in cell.obstacles]
        # The stand-in for no cone sees nothing in any case: its planes have normals of 0.
        self._planes = [
            (jnp.pad(normal, ((0, 1), (0, 0), (0, 0))), jnp.pad(offset, ((0, 1), (0, 0)), constant_values=-1.0))
            for normal, offset in shadows
        ]

    def near(self, blocks: Any, width: Any, cut: Any) -> Near:
        """See ``SoftBeams``."""
        inner = self._inner.near(blocks, width, cut)

        def beams_of(j: Any) -> tuple[Any, tuple[Any, ...]]:
            chosen, some = inner.beams_of(j)
            return chosen, (*some[:1], tuple((n[chosen], o[chosen]) for n, o in self._planes), some)

        return Near(inner.pieces, inner.most, beams_of)

    def pairs(self, points: Any, some: Any, width: Any) -> tuple[Any, ...]:
        """As of ``SoftBeams``, and where an obstacle hides a point."""
        _, planes, inner = some
        t, *geometry = self._inner.pairs(points, inner, width)
        hidden = jnp.full_like(t, -jnp.inf)
        for normal, offset in planes:
            hidden = jnp.maximum(hidden, -largest(points[:, None], normal[:, :, None], offset[:, :, None]) / width)
        return jnp.maximum(t, hidden), *geometry, hidden > t

    def slopes(self, points: Any, some: Any, pull: Any, *geometry: Any) -> Any:
        """See ``SoftBeams``."""
        *of_inner, hidden = geometry
        return self._inner.slopes(points, some[2], jnp.where(hidden, 0, pull), *of_inner)

    def pulled_back(self, slope: Any) -> tuple[Any, ...]:
        """See ``SoftBeams``."""
        return self._inner.pulled_back(slope)


@soft_beams.register
def _(seen: InCell) -> SoftBeams:
    return CellBeams(seen)
