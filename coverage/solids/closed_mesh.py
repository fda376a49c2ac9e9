"""The inside of a closed triangle mesh, by its distance and by the parity of a ray."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import Array, Index, dot
from .base import CubePairs, Decision, Part, Parts, Points
from .segments import from_segment
from .tangent_bounds import share_under
from .volume_fraction import VolumeFraction

_FINENESS = 48  # pieces of a triangle are smaller than the mesh's diagonal over this, if few enough
_PIECES = 100_000  # at most, unless the mesh has more triangles
_FIRST = 16  # nearest pieces that a distance looks at first
_CHUNK = 1 << 17  # pairs of a point and a triangle processed at once
_LEAST = 1e-15  # m, of the function on the surface
_NEAR = 4  # radii of a piece beyond which a cube's share is not computed


@dataclass(frozen=True, eq=False)
class ClosedMesh(Parts):
    """The points inside a closed mesh, as one part.

    With D the distance from the surface, R the largest radius of a piece of it and d the distance
    from the nearest middle of a piece, d - R <= D <= d. The function is the larger of d - R and
    min(D, 2 R), negative inside. Both terms are 1-Lipschitz, at most D, and the first is negative
    where D is 0, so that the function changes sign continuously.
    """

    vertices: Float[np.ndarray, "V 3"]
    """Corners, m."""
    faces: Int[np.ndarray, "T 3"]
    """Corners of each triangle."""

    def __len__(self) -> int:
        return 1

    @cached_property
    def _pieces(self) -> Float[np.ndarray, "N 3 3"]:
        """Triangles, halved at their longest edge until they are small."""
        todo = self.vertices[self.faces]
        limit = float(np.linalg.norm(np.ptp(self.vertices, axis=0))) / _FINENESS
        done: list[np.ndarray] = []
        while len(todo):
            edges = np.linalg.norm(todo[:, [1, 2, 0]] - todo, axis=2)
            longest = edges.argmax(axis=1)
            split = edges.max(axis=1) > limit
            if sum(map(len, done)) + len(todo) + split.sum() > max(_PIECES, len(self.faces)):
                split[:] = False
            done.append(todo[~split])
            turn = (longest[split, None] + np.arange(3)) % 3
            a, b, c = np.take_along_axis(todo[split], turn[..., None], axis=1).transpose(1, 0, 2)
            middle = (a + b) / 2
            todo = np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])
        return np.concatenate(done)

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self._pieces.mean(axis=1))

    @cached_property
    def _radius(self) -> float:
        middle = self._pieces.mean(axis=1, keepdims=True)
        return float(np.linalg.norm(self._pieces - middle, axis=2).max()) * (1 + 1e-9)

    @cached_property
    def _rays(self) -> "_Columns":
        return _Columns.of(self.vertices[self.faces])

    def holds(self, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """See ``Parts.holds``: a ray upwards crosses the surface an odd number of times."""
        return self._rays.odd(points)

    def _distance(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Return the distance (N,) m from the surface.

        The nearest k pieces by their middles suffice once the k-th middle is further than the
        distance found and the radius of a piece together.
        """
        best, todo = np.full(len(points), np.inf), np.arange(len(points))
        most, k = len(self._pieces), _FIRST
        while len(todo):
            k = min(k, most)
            left = []
            for some in np.array_split(todo, max(len(todo) * k // _CHUNK, 1)):
                away, index = self._tree.query(points[some], k=k)
                away, index = away.reshape(len(some), k), index.reshape(len(some), k)
                each, pieces = np.repeat(points[some], k, axis=0), self._pieces[index.ravel()]
                best[some] = _to_triangles(each, pieces).reshape(len(some), k).min(axis=1)
                left.append(some[(best[some] > away[:, -1] - self._radius) & (k < most)])
            todo, k = np.concatenate(left), 4 * k
        return best

    def part(self, points: Array, index: Index) -> Any:
        flat = np.asarray(points).reshape(-1, 3)
        value = self._tree.query(flat)[0] - self._radius
        near = np.flatnonzero(value < 2 * self._radius)
        exact = np.minimum(self._distance(flat[near]), 2 * self._radius)
        value[near] = np.maximum(value[near], exact)
        value = np.maximum(value, _LEAST)  # a ray decides even on the surface
        return np.where(self.holds(flat), -value, value).reshape(np.shape(points)[:-1])

    def decide(self, points: Points, cell: Part, index: Part, reach: float) -> Decision:
        """See ``Parts.decide``; the exact distance is needed only where its bounds do not tell."""
        away = self._tree.query(points)[0]
        clear = away - self._radius > reach
        open_ = np.flatnonzero(~clear & (away > reach))
        clear[open_] = self._distance(points[open_]) > reach
        inside = np.zeros(len(points), bool)
        inside[clear] = self.holds(points[clear])
        return ~clear | inside, inside

    def shares(self, pairs: CubePairs) -> VolumeFraction:
        """See ``Parts.shares``.

        In a small cube all triangles that it meets lie between two planes across the normal of the
        nearest one. Beyond each plane the cube is convex and free of surface, hence wholly inside
        or wholly outside, as the corner there is.
        """
        points, side, slack = pairs.points, pairs.side, pairs.slack
        low, high = np.zeros(len(points)), np.ones(len(points))
        reach = 3**0.5 / 2 * side + slack
        small = np.arange(len(points) if reach < _NEAR * self._radius else 0)
        for some in np.array_split(small, max(len(small) // 2000, 1)):
            if len(some):
                low[some], high[some] = self._between(points[some], side, reach, slack)
        both = np.zeros((2, pairs.cubes))
        both[0][pairs.cell], both[1][pairs.cell] = low, high
        return VolumeFraction(both[0], both[1])

    def _between(
        self, points: Float[np.ndarray, "P 3"], side: float, reach: float, slack: float
    ) -> tuple[Float[np.ndarray, " P"], Float[np.ndarray, " P"]]:
        """Return bounds of the share of each small cube inside the mesh."""
        near = self._tree.query_ball_point(points, reach + self._radius)
        count = np.array([len(some) for some in near])
        cube = np.repeat(np.arange(len(points)), count)
        piece = np.concatenate([np.array(some, int) for some in near]).astype(int)
        away = _to_triangles(points[cube], self._pieces[piece])
        met = away <= reach
        cube, piece, away = cube[met], piece[met], away[met]
        none = np.setdiff1d(np.arange(len(points)), cube)
        low, high = np.zeros(len(points)), np.ones(len(points))
        high[none] = low[none] = self.holds(points[none])
        if len(cube) == 0:
            return low, high
        order = np.lexsort((away, cube))
        cube, piece = cube[order], piece[order]
        first = np.flatnonzero(np.diff(cube, prepend=-1))
        here, corners = cube[first], self._pieces[piece]
        nearest = corners[first]
        normal = np.cross(nearest[:, 1] - nearest[:, 0], nearest[:, 2] - nearest[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        run = np.repeat(np.arange(len(first)), np.diff(first, append=len(cube)))
        height = dot(corners - points[cube][:, None], normal[run][:, None])  # (M, 3)
        least = np.minimum.reduceat(height.min(axis=1), first) - slack
        most = np.maximum.reduceat(height.max(axis=1), first) + slack
        tip = np.where(normal >= 0, 0.5, -0.5) * side
        under = share_under((slack - least) / side, (slack - least) / side, normal).low
        over = share_under((slack + most) / side, (slack + most) / side, -normal).low
        under = np.where(-np.abs(dot(tip, normal)) < least - slack, under, 0.0)
        over = np.where(np.abs(dot(tip, normal)) > most + slack, over, 0.0)
        below, above = (self.holds(points[here] + s * tip) for s in (-1, 1))
        low[here] = below * under + above * over
        high[here] = 1 - ~below * under - ~above * over
        return np.maximum(low - 1e-9, 0.0), np.minimum(high + 1e-9, 1.0)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])


def _to_triangles(
    points: Float[np.ndarray, "N 3"], triangles: Float[np.ndarray, "N 3 3"]
) -> Float[np.ndarray, " N"]:
    """Return the distance (N,) m of each point from its triangle.

    It is the distance from the plane where the point lies above the triangle, and else the
    smallest distance from its edges.
    """
    a, b, c = triangles.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    square = dot(normal, normal)
    inside, nearest = square > 0, np.full(len(points), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        off = from_segment(points, start, end)
        nearest = np.minimum(nearest, dot(off, off))
        inside &= dot(np.cross(end - start, points - start), normal) >= 0
    height = dot(points - a, normal) ** 2 / np.where(square > 0, square, 1.0)
    distance: np.ndarray = np.sqrt(np.where(inside, np.minimum(height, nearest), nearest))
    return distance


@dataclass(frozen=True, eq=False)
class _Columns:
    """Triangles by the columns of a grid along z in which they lie."""

    triangles: Float[np.ndarray, "T 3 3"]
    low: Float[np.ndarray, " 2"]
    size: Float[np.ndarray, " 2"]
    columns: int
    first: Int[np.ndarray, " C"]
    member: Int[np.ndarray, " M"]

    @staticmethod
    def of(triangles: Float[np.ndarray, "T 3 3"]) -> "_Columns":
        """Return the columns of triangles, about as many as there are triangles."""
        columns = int(np.clip(np.sqrt(len(triangles)), 1, 256))
        flat = triangles[..., :2]
        low, high = flat.min(axis=(0, 1)), flat.max(axis=(0, 1))
        size = np.maximum(high - low, 1e-12) / columns
        start, end = (
            np.clip(((corner - low) / size).astype(np.int64) + s, 0, columns - 1)
            for corner, s in ((flat.min(axis=1), -1), (flat.max(axis=1), 1))
        )
        wide = end - start + 1
        each = wide.prod(axis=1)
        of = np.repeat(np.arange(len(triangles)), each)
        place = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
        x, y = start[of, 0] + place // wide[of, 1], start[of, 1] + place % wide[of, 1]
        key = x * columns + y
        order = np.argsort(key, kind="stable")
        first = np.searchsorted(key[order], np.arange(columns**2 + 1))
        return _Columns(triangles, low, size, columns, first, of[order])

    def odd(self, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """Return for which points a ray upwards crosses an odd number of triangles.

        Whether the ray meets a triangle follows from its three edges seen from above, each computed
        in the same way for both triangles that share it. No ray can slip between two triangles or
        meet both.
        """
        inside = np.zeros(len(points), bool)
        place = np.floor((points[:, :2] - self.low) / self.size).astype(np.int64)
        beyond = (place < -1) | (place > self.columns)
        some = np.flatnonzero(~beyond.any(axis=1))
        if len(some) == 0:
            return inside
        place = np.clip(place[some], 0, self.columns - 1)
        key = place[:, 0] * self.columns + place[:, 1]
        count = self.first[key + 1] - self.first[key]
        group = np.cumsum(count) // _CHUNK
        for part in np.split(np.arange(len(some)), np.flatnonzero(np.diff(group)) + 1):
            n = count[part]
            point = np.repeat(part, n)
            offset = np.arange(n.sum()) - np.repeat(np.cumsum(n) - n, n)
            triangle = self.triangles[self.member[self.first[key[point]] + offset]]
            hit = _above(points[some[point]], triangle)
            inside[some[part]] = np.bincount(point[hit] - part[0], minlength=len(part)) % 2 == 1
        return inside


def _above(
    points: Float[np.ndarray, "N 3"], triangles: Float[np.ndarray, "N 3 3"]
) -> Bool[np.ndarray, " N"]:
    """Return whether a ray upwards from each point meets its triangle."""
    x, y = points[:, 0], points[:, 1]
    met = np.zeros(len(points), bool)
    for i in range(3):
        a, b = triangles[:, i, :2], triangles[:, (i + 1) % 3, :2]
        swap = (a[:, 1] > b[:, 1]) | ((a[:, 1] == b[:, 1]) & (a[:, 0] > b[:, 0]))
        a, b = np.where(swap[:, None], b, a), np.where(swap[:, None], a, b)
        across = (a[:, 1] > y) != (b[:, 1] > y)
        rise = np.where(across, b[:, 1] - a[:, 1], 1.0)
        met ^= across & (x < a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / rise)
    corner = triangles[:, 0]
    normal = np.cross(triangles[:, 1] - corner, triangles[:, 2] - corner)
    up = np.where(normal[:, 2] == 0, 1.0, normal[:, 2])
    fall = normal[:, 0] * (x - corner[:, 0]) + normal[:, 1] * (y - corner[:, 1])
    with np.errstate(over="ignore"):
        height = corner[:, 2] - fall / up
    height = np.clip(height, triangles[..., 2].min(axis=1), triangles[..., 2].max(axis=1))
    above: np.ndarray = met & (height > points[:, 2])
    return above
