"""The tube swept by a disc along the pose curve: V_S's outer solid and V_R."""

from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from .arrays import Array, dot, namespace, root
from .solids import _least


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Tube:
    """Slabs between neighbouring discs: the points where the two plane functions differ in sign, within ``radius`` of
    the segment between the discs' centres.

    Where the discs of a tight bend cross, both sides of the crossing belong to the tube. Each plane function
    ``s = (p - centre) . normal`` has a gradient of length 1, the distance from a segment too, and the rest is min and
    max: a slab is 1-Lipschitz.

    centre (D, 3) m, normal (D, 3) unit (the curve's tangent), radius m, first (S,): slab k lies between the discs
    first[k] and first[k] + 1.
    """

    centre: Float[np.ndarray, "D 3"]
    normal: Float[np.ndarray, "D 3"]
    radius: Any
    first: Int[np.ndarray, " S"]

    def __len__(self) -> int:
        return len(self.first)

    def planes(self, points: Any, index: Any) -> tuple[Any, Any]:
        """Signed distances (P,), (P,) of ``points`` (P, 3) m from the first and second disc's plane of slab ``index``."""
        i = self.first[index]
        before = dot(points - self.centre[i], self.normal[i])
        after = dot(points - self.centre[i + 1], self.normal[i + 1])
        return before, after

    def distance(self, points: Any, index: Any) -> Any:
        """Distance (P,) m of ``points`` (P, 3) from the segment of slab ``index`` (P,)."""
        xp = namespace(points)
        i = self.first[index]
        start = self.centre[i]
        along = self.centre[i + 1] - start
        length2 = dot(along, along)
        v = points - start
        t = xp.clip(dot(v, along) / xp.where(length2 > 0, length2, 1.0), 0.0, 1.0)
        across = v - t[..., None] * along
        return root(dot(across, across))

    def part(self, points: Any, index: Any) -> Any:
        before, after = self.planes(points, index)
        xp = namespace(points)
        crossing = xp.minimum(xp.maximum(-before, after), xp.maximum(before, -after))
        return xp.maximum(crossing, self.distance(points, index) - self.radius)

    def __call__(self, points: Float[Array, "N 3"]) -> Float[Array, " N"]:
        return _least(self, points)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        return np.stack([self.centre.min(axis=0) - self.radius, self.centre.max(axis=0) + self.radius])

    def swallowed(
        self,
        centres: Float[np.ndarray, "P 3"],
        reach: float,
        cell: Int[np.ndarray, " P"],
        index: Int[np.ndarray, " P"],
    ) -> Bool[np.ndarray, " P"]:
        """Pairs whose cell lies wholly inside the tube, though perhaps in no single slab.

        On the face between two neighbouring slabs the minimum over slabs is 0, deep inside the tube. So look along a run
        of consecutive slabs whose segments are all nearer than ``radius - reach`` to the centre: if one disc of the run
        has the whole cell on its positive side and another has it on its negative side, then along the run every point
        of the cell changes sign between some two neighbours, and is within ``radius`` of the segment between them.

        Args:
            centres: cell centre of each pair, m.
            reach: half-diagonal of a cell (slack included), m.
            cell: cell of each pair, ascending.
            index: slab of each pair, ascending within a cell. Slabs that miss the cell may be absent: they have both
                discs on the same side of it, or lie too far, and neither can complete a run.
        """
        before, after = self.planes(centres, index)
        near = self.distance(centres, index) < self.radius - reach
        joined = np.zeros(len(cell), bool)
        disc = self.first[index]
        joined[1:] = (cell[1:] == cell[:-1]) & (disc[1:] == disc[:-1] + 1) & near[1:] & near[:-1]
        run = np.cumsum(~joined) - 1
        runs = run[-1] + 1 if len(run) else 0
        positive, negative = np.zeros(runs, bool), np.zeros(runs, bool)
        positive[run[near & ((before > reach) | (after > reach))]] = True
        negative[run[near & ((before < -reach) | (after < -reach))]] = True
        return (positive & negative)[run]
