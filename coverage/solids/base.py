"""Solids as implicit functions: negative inside, positive outside, 1-Lipschitz, in metres.

A leaf of the tree is a union of many *parts* of one kind (``Cones``, ``Spheres``, a ``Tube``). The
octree passes to each cell only the parts that still matter to it. Inner nodes combine solids: union
is min, intersection is max, ``A minus B`` is ``max(a, -b)``. Each of these keeps the Lipschitz
constant 1.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import and_, neg, or_
from typing import Any, Generic, NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from ..arrays import Array, Index, namespace, rows
from ..pytrees import tree
from .volume_fraction import VolumeFraction


@runtime_checkable
class Solid(Protocol):
    """A solid with an implicit function and a bounding box."""

    def __call__(self, points: Float[Array, "N 3"]) -> Float[Array, " N"]:
        """Return the implicit function at ``points`` (N, 3) m: (N,) m, at most 0 inside,
        1-Lipschitz.
        """

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Return the lower and upper corner (2, 3) m of an axis-aligned bounding box."""


Points = Float[np.ndarray, "P 3"]
Part = Int[np.ndarray, " P"]
Decision = tuple[Bool[np.ndarray, " P"], Bool[np.ndarray, " P"]]
Quadrics = Iterator[tuple[slice | Int[np.ndarray, " M"], Any]]
"""Some of several pairs, and quadrics (10, M) of them, or None."""


class CubePairs(NamedTuple):
    """P pairs of a cube of a lattice and a part of a solid."""

    points: Float[np.ndarray, "P 3"]
    """Centre of each pair's cube, m."""
    cell: Int[np.ndarray, " P"]
    """Index of the cube, ascending."""
    part: Int[np.ndarray, " P"]
    """Index of the part, ascending within a cube."""
    cubes: int
    """Number of cubes."""
    side: float
    """Side of the cubes, m."""
    slack: float
    """Rounding error of an implicit function, m."""
    curved: bool = True
    """Whether bounds may follow the curvature of surfaces, instead of tangent planes only."""

    def only(self, k: Int[np.ndarray, " M"]) -> "CubePairs":
        """Return the pairs with these indices."""
        return self._replace(points=rows(self.points, k), cell=self.cell[k], part=self.part[k])


class Parts(ABC):
    """A union of ``len(self)`` parts of one kind: a leaf of a solid's tree."""

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def part(self, points: Array, index: Index) -> Any:
        """Return the implicit function of part ``index[k]`` at ``points[k]``: (P, 3), (P,) -> (P,).

        Shapes broadcast.
        """

    @abstractmethod
    def bounds(self) -> Float[np.ndarray, "2 3"]: ...

    def __call__(self, points: Float[Array, "N 3"]) -> Float[Array, " N"]:
        """Return the minimum over the parts.

        NumPy evaluates one part at a time, so that memory stays (N,); JAX fuses all parts.
        """
        xp = namespace(points)
        least: Array
        if len(self) == 0:
            least = xp.full(points.shape[:1], float("inf"), dtype=points.dtype)
        elif xp is not np:
            least = self.part(points[:, None, :], np.arange(len(self))[None]).min(axis=1)
        else:
            least = reduce(np.minimum, (self.part(points, i) for i in range(len(self))))
        return least

    def holds(self, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """Return which points lie in the union."""
        return np.asarray(self(points) <= 0)

    def decide(self, points: Points, cell: Part, index: Part, reach: float) -> Decision:
        """Return, for pairs of a ball and a part, whether the part matters and the ball is inside.

        A part matters if its surface or interior may reach the ball. The second result states
        whether the ball lies wholly inside the union.

        Args:
            points: centre of each pair's ball, m.
            cell: index of the ball, ascending.
            index: part of each pair, ascending within a ball; parts known not to matter may be
                absent.
            reach: radius of every ball, m.
        """
        value = self.part(points, index)
        return value <= reach, value < -reach

    @abstractmethod
    def shares(self, pairs: CubePairs) -> VolumeFraction:
        """Return bounds of each cube's volume fraction in the union; parts that miss a cube may be
        absent from the pairs.

        Where one smooth surface intersects a cube, their difference falls with the side of the
        cube; with its square, where ``curved`` and the surface is round.
        """

    def quadrics(self, points: Points, index: Part, reach: float) -> Quadrics:
        """Yield quadrics that are all at least 0 in part ``index`` (P,), and at no point outside.

        Each comes with the pairs for which it is stated. It may be omitted for a pair that it does
        not exclude within ``reach`` m of its point. None leaves pairs undecided, as here.

        Args:
            points: centres of the quadrics' offsets, m.
            index: part of each point.
            reach: m.
        """
        yield slice(None), None


V = TypeVar("V")


@dataclass(frozen=True)
class Algebra(Generic[V]):
    """How values of two solids combine to that of their combination.

    Values are implicit functions, truth values or bounds of volumes.
    """

    union: Callable[[V, V], V]
    """Value of the union."""
    intersection: Callable[[V, V], V]
    """Value of the intersection."""
    complement: Callable[[V], V]
    """Value of the complement."""


def _least(a: Array, b: Array) -> Array:
    least: Array = namespace(a).minimum(a, b)
    return least


def _largest(a: Array, b: Array) -> Array:
    largest: Array = namespace(a).maximum(a, b)
    return largest


VALUES: Algebra[Any] = Algebra(_least, _largest, neg)
"""The algebra of arrays: implicit functions, and verdicts (-1 inside, 0 undecided, 1 outside)."""
LOGIC: Algebra[Any] = Algebra(or_, and_, neg)
"""The algebra of types with the operators ``|``, ``&`` and ``-``."""


@tree
@dataclass(frozen=True)
class _Combination:
    """Two solids combined by a rule on their values; subclasses define the rule and the box."""

    a: Solid
    b: Solid

    def combine(self, a: V, b: V, algebra: Algebra[V]) -> V:
        """Return the value of the combination from those of ``a`` and ``b``."""
        raise TypeError(f"{type(self).__name__} has no rule of combination")

    def __call__(self, points: Float[Array, "N 3"]) -> Float[Array, " N"]:
        value: Array = self.combine(self.a(points), self.b(points), VALUES)
        return value


@tree
@dataclass(frozen=True)
class Union(_Combination):
    """Points in ``a`` or in ``b``: min."""

    def combine(self, a: V, b: V, algebra: Algebra[V]) -> V:
        return algebra.union(a, b)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        a, b = self.a.bounds(), self.b.bounds()
        return np.stack([np.minimum(a[0], b[0]), np.maximum(a[1], b[1])])


@tree
@dataclass(frozen=True)
class Intersection(_Combination):
    """Points in ``a`` and in ``b``: max."""

    def combine(self, a: V, b: V, algebra: Algebra[V]) -> V:
        return algebra.intersection(a, b)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        a, b = self.a.bounds(), self.b.bounds()
        lower = np.maximum(a[0], b[0])
        return np.stack([lower, np.maximum(lower, np.minimum(a[1], b[1]))])


@tree
@dataclass(frozen=True)
class Difference(_Combination):
    """Points in ``a`` and not inside ``b``: max(a, -b).

    The surface of ``b`` belongs to the difference.
    """

    def combine(self, a: V, b: V, algebra: Algebra[V]) -> V:
        return algebra.intersection(a, algebra.complement(b))

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        return self.a.bounds()


def leaves(solid: Solid) -> list[Parts]:
    """Return the unions of parts at the leaves of the solid's tree, left to right.

    ``fold`` expects values in this order, and cells keep their pairs in it.

    Raises:
        TypeError: if the solid is neither a union of parts nor a combination of solids.
    """
    if isinstance(solid, _Combination):
        return leaves(solid.a) + leaves(solid.b)
    if isinstance(solid, Parts):
        return [solid]
    raise TypeError(
        f"{type(solid).__name__} is neither a union of parts nor a combination of solids"
    )


def fold(solid: Solid, values: Sequence[V], algebra: Algebra[V]) -> V:
    """Return the value of a solid from the values of its ``leaves``, one each and in their order.

    Raises:
        ValueError: if the numbers of values and leaves differ.
    """
    rest = iter(values)

    def value_of(branch: Solid) -> V:
        if isinstance(branch, _Combination):
            a = value_of(branch.a)
            return branch.combine(a, value_of(branch.b), algebra)
        return next(rest)

    if len(values) != len(leaves(solid)):
        raise ValueError(f"{len(values)} values for {len(leaves(solid))} leaves")
    return value_of(solid)
