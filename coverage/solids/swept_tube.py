"""The tube that a disc sweeps along the pose curve: V_S's outer solid and V_R."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import Array, Index, dot, namespace, root, rows
from ..pytrees import tree
from .base import CubePairs, Decision, Part, Parts, Points
from .segments import Feet, feet, from_segment
from .tangent_bounds import distance_tangent, first_of, plane_share, union_bounds
from .volume_fraction import VolumeFraction


@tree
@dataclass(frozen=True)
class Tube(Parts):
    """A union of slabs between neighbouring discs.

    A slab contains the points where the two plane functions differ in sign, within ``radius`` of
    the segment between the discs' centres. Where the discs of a tight bend intersect, both sides
    of the intersection belong to the tube.

    Each plane function ``s = (p - centre) . normal`` has a gradient of length 1, as has the
    distance from a segment. The rest is min and max, so a slab is 1-Lipschitz.
    """

    centre: Float[Array, "D 3"]
    """Centres of the discs, m."""
    normal: Float[Array, "D 3"]
    """Unit normals of the discs: the curve's tangents."""
    radius: Any
    """Radius of the discs, m."""
    first: Int[Array, " S"]
    """Slab k lies between the discs first[k] and first[k] + 1."""

    def __len__(self) -> int:
        return len(self.first)

    def _slab(self, points: Array, index: Index) -> tuple[Any, Any, Any]:
        """Return the signed distances from both planes of slab ``index``, and the offset vector.

        The distances of ``points`` are in m. The vector (..., 3) m leads from the nearest point of
        the segment between the discs' centres.
        """
        i = self.first[index]
        start, end = rows(self.centre, i), rows(self.centre, i + 1)
        before = dot(points - start, rows(self.normal, i))
        after = dot(points - end, rows(self.normal, i + 1))
        return before, after, from_segment(points, start, end)

    def part(self, points: Array, index: Index) -> Any:
        before, after, across = self._slab(points, index)
        distance, xp = root(dot(across, across)), namespace(points)
        crossing = xp.minimum(xp.maximum(-before, after), xp.maximum(before, -after))
        return xp.maximum(crossing, distance - self.radius)

    def holds(self, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """See ``Parts.holds``.

        Distances are computed only where the signs of a slab's two planes differ, which is rare.
        """
        height = self.normal @ points.T - dot(self.centre, self.normal)[:, None]
        positive, negative, i = height >= 0, height <= 0, self.first
        differ = np.flatnonzero((positive[i] & negative[i + 1]) | (negative[i] & positive[i + 1]))
        slab, point = np.divmod(differ, len(points))
        held = np.zeros(len(points), bool)
        held[point[self.part(points[point], slab) <= 0]] = True
        return held

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        centre = np.asarray(self.centre)
        return np.stack([centre.min(axis=0) - self.radius, centre.max(axis=0) + self.radius])

    def decide(self, points: Points, cell: Part, index: Part, reach: float) -> Decision:
        """See ``Parts.decide``; a ball may lie wholly inside the tube but in no single slab.

        On the face between two neighbouring slabs the minimum over slabs is 0, deep inside the
        tube. The test therefore examines runs of consecutive slabs whose segments are all nearer
        to the centre than ``radius - reach``. Suppose that one disc of the run has the whole ball
        on its positive side and another has it on its negative side. Then along the run every
        point of the ball changes sign between some two neighbours, and lies within ``radius`` of
        the segment between them. An absent slab has both discs on the same side of the ball, or is
        too far away; neither can complete a run.
        """
        before, after, across = self._slab(points, index)
        distance = root(dot(across, across))
        crossing = np.minimum(np.maximum(-before, after), np.maximum(before, -after))
        near = distance < self.radius - reach
        run = self._runs(cell, index, near)
        positive, negative = np.zeros((2, len(cell) + 1), bool)
        positive[run[near & ((before > reach) | (after > reach))]] = True
        negative[run[near & ((before < -reach) | (after < -reach))]] = True
        matters = np.maximum(crossing, distance - self.radius) <= reach
        return matters, (positive & negative)[run] & near

    def _runs(self, cell: Array, index: Index, near: Array) -> Int[np.ndarray, " P"]:
        """Return the index of each pair's run: consecutive slabs of one cell, all of them near."""
        disc = self.first[index]
        joined = np.zeros(len(cell), bool)
        joined[1:] = (cell[1:] == cell[:-1]) & (disc[1:] == disc[:-1] + 1) & near[1:] & near[:-1]
        return np.cumsum(~joined)

    def shares(self, pairs: CubePairs) -> VolumeFraction:
        """See ``Parts.shares``.

        A slab lies between two planes, on the positive side of one and the negative side of the
        other, and near the segment.

        A cube that intersects the plane between two slabs has a share in both. Suppose that along a
        run of consecutive slabs one disc has the whole cube on its positive side and another has it
        on its negative side (see ``decide``). Then each point of the cube lies between the planes
        of some slab of the run, and the points near all its segments are inside.
        """
        points, cell, index, _, side, slack, curved = pairs
        before, after, across = self._slab(points, index)
        start, end = (rows(self.centre, self.first[index] + more) for more in (0, 1))
        near = feet(points, start, end, side)
        round_ = distance_tangent(across, self.radius, side, near, curved)
        below = [
            plane_share(value, rows(self.normal, self.first[index] + more), side, slack)
            for more, value in enumerate((before, after))
        ]
        between = -(-(-below[0] & below[1]) & -(below[0] & -below[1]))
        inside = round_.share(side, slack)
        union = union_bounds(pairs, inside & between, round_.value, round_.normal)
        run = self._runs(cell, index, np.ones(len(cell), bool))
        positive, negative = np.zeros((2, len(cell) + 1), bool)
        for share in below:
            positive[run[share.high == 0]] = True
            negative[run[share.low == 1]] = True
        held = (positive & negative)[run]
        if curved:
            self._about_one_disc(pairs, near, inside, held, union)
        if held.any():
            first = first_of(run[held])
            value, normal, where = (
                round_.value[held],
                rows(round_.normal, np.flatnonzero(held)),
                cell[held][first],
            )
            head = np.repeat(first, np.diff(first, append=len(value)))
            depth = (
                value
                + round_.rise(side)[held]
                + np.abs(normal - normal[head]).sum(axis=1) * side / 2
            )
            depth = (np.maximum.reduceat(depth, first) + 2 * slack) / side
            np.maximum.at(union.low, where, plane_share(depth, normal[first], 1.0, 0.0).low)
        return union

    def _about_one_disc(
        self,
        pairs: CubePairs,
        near: Feet,
        inside: VolumeFraction,
        held: Bool[np.ndarray, " P"],
        union: VolumeFraction,
    ) -> None:
        """Tighten the shares of cubes to all of whose slabs the centre of one disc is nearest.

        The slabs are then parts of one ball, and all of it where they are ``held`` together.
        """
        disc = self.first[pairs.part] + near.beyond
        known = near.before | near.beyond
        first = first_of(pairs.cell)
        one = np.minimum.reduceat(np.where(known, disc, -1), first)
        one = first[(one >= 0) & (one == np.maximum.reduceat(disc, first))]
        cubes = pairs.cell[one]
        union.high[cubes] = np.minimum(union.high[cubes], inside.high[one])
        one = one[held[one]]
        cubes = pairs.cell[one]
        union.low[cubes] = np.maximum(union.low[cubes], inside.low[one])
