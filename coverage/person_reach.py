"""The part of space that a standing person can touch past the obstacles, in cubes of a lattice.

A person is a family of upright capsules, one for each stature up to the stated one, at each place
of the walkable area where the capsule is clear of obstacles. Arms lead from the capsule's surface,
at any height between the lowest and the highest shoulder, along any path past the obstacles that is
no longer than the reach, whatever its number of elbows.

All such paths are followed at once. At the centre of a cube with a free line to the nearest
shoulder the path is that line. From these a wave runs on over the other centres, along steps over
at most two cubes in each direction that no obstacle cuts. Wherever the lattice rounds, it errs
towards a larger region:

* Such steps lengthen a path by 5 % at most, by which the wave goes on beyond the reach.
* A path is two cubes longer than the reach, for the places of its ends in their cubes.
* A person may stand where the next column of the lattice, less half a diagonal, is clear.
* A cube counts as a whole, as does one whose centre lies in an obstacle and that touches another.

Only what an arm reaches through passages narrower than 0.1 m may be missing.
"""

import itertools
import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from .cube_region import CubeRegion
from .definitions.definition import definition, refuse
from .definitions.field_types import Coordinate, Items
from .floor_areas import Polygon, in_areas
from .solids.polyhedra import Polyhedron, crossed, largest
from .solids.segments import point_to_segment

SIDE = 0.05  # m, of a cube
STEP = 0.2  # m, height of obstacles on which a person steps
SHOULDER = 0.818  # height of the shoulders as a share of stature, as in simulation.human
_MOST = 1e6  # cubes; of a larger box the cubes are larger
_GRAIN = 0.5  # m, to which boxes are enlarged, so that poses share a region
_ROUNDING = 2  # cubes
_FAR = 2  # cubes of a step in each direction
_STEPS = [
    np.array(step)
    for step in itertools.product(range(-_FAR, _FAR + 1), repeat=3)
    if math.gcd(*step) == 1
]
LONGER = 1.0495  # the longest path along steps as a share of the straight distance


@definition
class Person:
    """Where people walk and how far they reach: what a target that is ``reachable = "person"`` is
    cut to, and where blind spots are sought.

    Example:
        >>> import place_rings as pr
        >>> front = [(-1, -2), (2, -2), (2, -0.6), (-1, -0.6)]
        >>> pr.Person(floor=-0.75, areas=[front]).reach
        0.85
    """

    floor: Coordinate | None = None
    """Height of the floor on which people stand, m; default: the highest floor of the obstacles."""
    areas: Annotated[Items[Polygon], Field(max_length=100)] = ()
    """Walkable areas, polygons of corners (x, y) m; the whole floor if there are none."""
    height: Annotated[float, Field(ge=0.5, le=2.5)] = 1.95
    """Stature of the tallest person, m."""
    shoulder: Annotated[float, Field(ge=0.1, le=SHOULDER * 2.5)] = 1.2
    """Height of the shoulders of the smallest person above the floor, m; lower, where people bend
    or kneel."""
    radius: Annotated[float, Field(ge=0.05, le=0.5)] = 0.15
    """Radius of the body, m."""
    reach: Annotated[float, Field(ge=0, le=2)] = 0.85
    """Length of an arm from the body's surface, m; ISO 13855 has 0.85 m from the shoulder."""

    def __post_init__(self) -> None:
        most = SHOULDER * self.height
        if self.shoulder > most:
            refuse(
                [(("shoulder",), self.shoulder, f"at most {most:.4g} m, {SHOULDER:g} of height")]
            )

    def stands_on(self, obstacles: tuple[Polyhedron, ...]) -> float:
        """Return the height of the floor, m: the stated one or the obstacles', whichever is higher.

        Raises:
            ValueError: if neither states one.
        """
        floors = [float(body.offset[0]) for body in obstacles if not len(body.edges)]
        floors += [] if self.floor is None else [self.floor]
        if not floors:
            raise ValueError("person.floor: found none, allowed: a height, m, or a floor obstacle")
        return max(floors)


def person_region(
    obstacles: tuple[Polyhedron, ...], person: Person, floor: float, box: Float[np.ndarray, "2 3"]
) -> CubeRegion:
    """Return the part of a box that a person can touch.

    Args:
        obstacles: convex bodies, base frame.
        person: where people walk and how far they reach.
        floor: height of the floor, m.
        box: lower and upper corner (2, 3) m of the box.
    """
    keys = tuple(
        (
            *(np.ascontiguousarray(a, float).tobytes() for a in (b.normal, b.offset, b.edges)),
            np.ascontiguousarray(b.faces, np.int64).tobytes(),
        )
        for b in obstacles
    )
    grown = np.stack([np.floor(box[0] / _GRAIN), np.ceil(box[1] / _GRAIN)]) * _GRAIN
    return _region(keys, person, floor, grown.astype(float).tobytes())


@lru_cache(16)
def _region(
    keys: tuple[tuple[bytes, ...], ...], person: Person, floor: float, corners: bytes
) -> CubeRegion:
    bodies = [
        Polyhedron(
            np.frombuffer(n).reshape(-1, 3),
            np.frombuffer(o),
            np.frombuffer(e).reshape(-1, 2, 3),
            np.frombuffer(f, np.int64).reshape(-1, 2),
        )
        for n, o, e, f in keys
    ]
    box = np.frombuffer(corners).reshape(2, 3)
    return _Wave(bodies, person, floor, box).region()


class _Wave:
    """The wave of arms from all bodies; the lattice is larger than needed by a step."""

    def __init__(
        self, bodies: list[Polyhedron], person: Person, floor: float, box: Float[np.ndarray, "2 3"]
    ) -> None:
        self.bodies, self.person, self.floor = bodies, person, floor
        around = person.reach + person.radius + 4 * SIDE
        tallest = floor + person.height
        tops = [body.edges[..., 2].max() + 4 * SIDE for body in bodies if len(body.edges)]
        top = min(max(box[1, 2], tallest, *tops), tallest + around)  # arms lead over obstacles
        low = np.array([*(box[0, :2] - around), floor])
        high = np.array([*(box[1, :2] + around), top])
        self.side = max(SIDE, float(((high - low).prod() / _MOST) ** (1 / 3)))
        self.lowest = np.floor(low / self.side).astype(np.int64) - _FAR
        self.shape = np.ceil(high / self.side).astype(np.int64) + _FAR - self.lowest
        self.axes = [
            (np.arange(n) + a + 0.5) * self.side
            for n, a in zip(self.shape, self.lowest, strict=True)
        ]
        x, y, z = self.shape.tolist()
        self.stride = np.array([y * z, z, 1])
        self.blocked = np.zeros((x, y, z), bool)
        self.blocked[:, :, self.axes[2] < floor] = True
        self.cut = {tuple(step): np.zeros(x * y * z, bool) for step in _STEPS}
        for body in bodies:
            self._obstruct(body)

    def _obstruct(self, body: Polyhedron) -> None:
        """Mark the cubes whose centre lies in an obstacle, and the steps that it cuts."""
        first, last = np.zeros(3, np.int64), self.shape
        if len(body.edges):
            corners = body.edges.reshape(-1, 3)
            ends = np.stack([corners.min(axis=0), corners.max(axis=0)]) / self.side - self.lowest
            most = self.shape - _FAR
            first = np.clip(np.floor(ends[0]).astype(np.int64) - _FAR, _FAR, most)
            last = np.clip(np.ceil(ends[1]).astype(np.int64) + _FAR, first, most)
        here = tuple(slice(a, b) for a, b in zip(first, last, strict=True))
        index = np.stack(
            np.meshgrid(*(np.arange(s.start, s.stop) for s in here), indexing="ij"), axis=-1
        ).reshape(-1, 3)
        centre = (index + self.lowest + 0.5) * self.side
        within = largest(centre, body.normal, body.offset) <= 0
        self.blocked[here] |= within.reshape(tuple(last - first))
        if not len(body.edges):
            return  # a plane separates no two centres above it
        number, normal, offset = index @ self.stride, body.normal[None], body.offset[None]
        for step in _STEPS:
            if tuple(step) > (0, 0, 0):
                cut = np.asarray(crossed(centre, centre + step * self.side, normal, offset))
                self.cut[tuple(step)][number[cut]] = True
                self.cut[tuple(-step)][number[cut] + step @ self.stride] = True

    def region(self) -> CubeRegion:
        """Return the cubes that are reached."""
        from scipy.ndimage import binary_dilation

        person, side = self.person, self.side
        stature = self._statures()[:, :, None]
        above = self.axes[2] - self.floor
        body = (stature > 0) & (above <= stature + side / 2) & ~self.blocked
        arms = body & (above >= person.shoulder - side / 2)
        arms &= above <= SHOULDER * stature + side / 2
        limit = person.radius + person.reach + _ROUNDING * side
        straight = self._straight(arms, limit)
        spent = LONGER * np.minimum(straight, self._straight(body, limit) + person.reach)
        final = np.isfinite(straight)  # no path is shorter
        for axis in range(3):  # no path leads out of the lattice
            ends = np.moveaxis(final, axis, 0)
            ends[:_FAR], ends[-_FAR:] = True, True
        inside = self._spread(spent, final | self.blocked, LONGER * limit)
        inside |= self.blocked & binary_dilation(inside, np.ones((3, 3, 3), bool))
        return CubeRegion(inside, self.lowest, side)

    def _straight(
        self, some: Bool[np.ndarray, "X Y Z"], limit: float
    ) -> Float[np.ndarray, "X Y Z"]:
        """Return the distance of each centre from the nearest of ``some``, m; infinite beyond
        ``limit`` m, in an obstacle, and where an obstacle cuts the line."""
        from scipy.ndimage import distance_transform_edt

        if not some.any():
            return np.full(some.shape, np.inf)
        distance, nearest = distance_transform_edt(~some, return_indices=True)
        distance = np.where(self.blocked, np.inf, distance * self.side)
        distance[distance > limit] = np.inf
        at = np.flatnonzero(np.isfinite(distance) & (distance > 0))
        a, b = (
            (np.stack(index, axis=1) + self.lowest + 0.5) * self.side
            for index in (
                np.unravel_index(at, some.shape),
                [axis.reshape(-1)[at] for axis in nearest],
            )
        )
        low, high, cut = np.minimum(a, b), np.maximum(a, b), np.zeros(len(at), bool)
        for body in self.bodies:
            if len(body.edges):
                corners = body.edges.reshape(-1, 3)
                meets = (low <= corners.max(axis=0)) & (high >= corners.min(axis=0))
                near = np.flatnonzero(meets.all(axis=1) & ~cut)
                cut[near] = crossed(a[near], b[near], body.normal[None], body.offset[None])
        distance.reshape(-1)[at[cut]] = np.inf
        return distance

    def _spread(
        self, spent: Float[np.ndarray, "X Y Z"], final: Bool[np.ndarray, "X Y Z"], limit: float
    ) -> Bool[np.ndarray, "X Y Z"]:
        """Return the cubes that paths reach within ``limit`` m, from the length ``spent`` at each;
        that of ``final`` ones stays."""
        from scipy.ndimage import binary_dilation

        inner = (slice(_FAR, -_FAR),) * 3
        begins = np.zeros(spent.shape, bool)
        begins[inner] = binary_dilation(~final, np.ones((2 * _FAR + 1,) * 3, bool))[inner]
        flat, final = spent.reshape(-1), final.reshape(-1)
        active = np.flatnonzero(begins.reshape(-1) & np.isfinite(flat))
        while len(active):
            improved = np.zeros(len(flat), bool)
            for step in _STEPS:
                there = active + step @ self.stride
                open_ = ~final[there]
                near, there = active[open_], there[open_]
                new = flat[near] + self.side * math.sqrt(step @ step)
                some = (new < flat[there]) & (new <= limit) & ~self.cut[tuple(step)][near]
                flat[there[some]] = new[some]
                improved[there[some]] = True
            active = np.flatnonzero(improved)
        return spent <= limit

    def _statures(self) -> Float[np.ndarray, "X Y"]:
        """Return the stature of the tallest person who has room at each place, m; 0: none has."""
        x, y = (a.ravel() for a in np.meshgrid(*self.axes[:2], indexing="ij"))
        tall = statures(self.bodies, self.person, self.floor, x, y, self.side)
        return tall.reshape(self.shape[:2])


def statures(
    bodies: Sequence[Polyhedron],
    person: Person,
    floor: float,
    x: Float[np.ndarray, " N"],
    y: Float[np.ndarray, " N"],
    side: float,
) -> Float[np.ndarray, " N"]:
    """Return the stature of the tallest person who has room at each place, m; 0: none has.

    Args:
        bodies: obstacles.
        person: where people walk, and their size.
        floor: height of the floor, m.
        x, y: places, m.
        side: side of the squares that the places stand for, m; room half a diagonal away suffices.
    """
    half = side / 2**0.5
    walked = in_areas(x, y, person.areas, half) if person.areas else np.ones(len(x), bool)
    tall = np.where(walked, person.height, 0.0)
    lowest = floor + min(STEP + person.radius, person.height - person.radius)
    top = floor + person.height - person.radius
    for z in np.linspace(lowest, top, 2 + int((top - lowest) / side)):
        some = np.flatnonzero(tall >= z - floor + person.radius - 1e-9)
        points = np.stack([x[some], y[some], np.full(len(some), z)], axis=1)
        stop = np.zeros(len(some), bool)
        for body in bodies:
            stop |= _nearer(body, points, person.radius - half)
        tall[some[stop]] = z - floor + person.radius
    tall[tall < person.shoulder / SHOULDER] = 0.0
    return tall


def _nearer(
    body: Polyhedron, points: Float[np.ndarray, "N 3"], least: float
) -> Bool[np.ndarray, " N"]:
    """Return which points are nearer to a convex body than ``least`` m; none is to a floor.

    Below 0: which lie deeper in it, by the function of its faces.
    """
    result = np.zeros(len(points), bool)
    if not len(body.edges):
        return result
    value = points @ body.normal.T - body.offset  # (N, M)
    close = np.flatnonzero(value.max(axis=1) < least)
    p, value = points[close], value[close]
    near = value.max(axis=1) <= min(least, 0.0)
    for i, normal in enumerate(body.normal):  # the foot of the perpendicular lies in the face
        foot = p - value[:, [i]] * normal
        near |= (value[:, i] > 0) & (largest(foot, body.normal, body.offset) <= 1e-9)
    for a, b in body.edges:
        near |= point_to_segment(p, a, b) < least
    result[close] = near
    return result
