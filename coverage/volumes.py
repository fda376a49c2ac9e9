"""Descriptions of volumes that a target consists of: boxes, cylinders, balls, half-spaces, and
unions, intersections and differences of them and of the named volumes.

A description does not depend on the pose. ``solid`` turns it into a solid at a pose; the caller
supplies the named volumes there. All coordinates are in the base frame.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from jaxtyping import Float, Int

from .arrays import Array, Index
from .robots.kinematics import transform
from .solids.base import CubePairs, Difference, Intersection, Parts, Solid, Union
from .solids.closed_mesh import ClosedMesh
from .solids.cylinders import Cylinders
from .solids.polyhedra import Polyhedra, Polyhedron, box, polyhedra
from .solids.spheres import sphere
from .solids.volume_fraction import VolumeFraction

Coordinates: TypeAlias = tuple[float, float, float]
"""Three coordinates in the base frame, m, or three angles, rad."""
NamedSolid: TypeAlias = Callable[[str, float | None], Solid]
"""Returns a named volume, such as V_S with its radius in m, at a pose."""
Rule = Literal["union", "difference", "intersection"]
RULES: tuple[Rule, ...] = get_args(Rule)
MOST_FACES = 50_000  # triangles of a mesh
OWN = "V_R"
"""Name of the robot's own volume, which may be a part of a volume but is no target."""
_EVERYWHERE = np.array([[-np.inf] * 3, [np.inf] * 3])
_ZERO: Coordinates = (0.0, 0.0, 0.0)


class Volume(ABC):
    """A volume that does not depend on the pose, or is made of named volumes."""

    @abstractmethod
    def solid(self, named: NamedSolid) -> Solid:
        """Return the volume as a solid in the base frame; ``named`` returns the named volumes."""

    def parts(self) -> Iterator["Volume"]:
        """Yield the volume and, depth first, all volumes of which it is made."""
        yield self

    @property
    def bounded(self) -> bool:
        """Whether the volume has an end in every direction."""
        return True


def _positive(kind: str, **lengths: float) -> None:
    for name, length in lengths.items():
        if not (np.isfinite(length) and length > 0):
            raise ValueError(f"{name} {length} of a {kind} is not a positive number of metres")


@dataclass(frozen=True)
class BoxVolume(Volume):
    """A box.

    Raises:
        ValueError: for a side that is not positive.
    """

    size: Coordinates
    """Sides along its own axes, m."""
    centre: Coordinates = _ZERO
    """Centre, m."""
    rpy: Coordinates = _ZERO
    """Rotations about x, then y, then z of the base frame, rad."""

    def __post_init__(self) -> None:
        _positive("box", **dict(zip(("size[0]", "size[1]", "size[2]"), self.size, strict=True)))

    def solid(self, named: NamedSolid) -> Solid:
        turn = transform(np.array(self.centre), np.array(self.rpy))[:3, :3]
        half = np.abs(turn) @ np.array(self.size) / 2
        corners = np.array(self.centre) + np.array([[-1.0], [1.0]]) * half
        return polyhedra((box(self.centre, self.size, turn),), corners)


@dataclass(frozen=True)
class CylinderVolume(Volume):
    """A cylinder about the z axis of its own frame.

    Raises:
        ValueError: for a radius or a height that is not positive.
    """

    radius: float
    """Radius, m."""
    height: float
    """Height, m."""
    centre: Coordinates = _ZERO
    """Middle of its axis, m."""
    rpy: Coordinates = _ZERO
    """Rotations about x, then y, then z of the base frame, rad."""

    def __post_init__(self) -> None:
        _positive("cylinder", radius=self.radius, height=self.height)

    def solid(self, named: NamedSolid) -> Solid:
        axis = transform(np.array(self.centre), np.array(self.rpy))[:3, 2]
        return Cylinders(
            np.array([self.centre], float),
            axis[None],
            np.array([float(self.radius)]),
            np.array([self.height / 2]),
        )


@dataclass(frozen=True)
class BallVolume(Volume):
    """A ball.

    Raises:
        ValueError: for a radius that is not positive.
    """

    radius: float
    """Radius, m."""
    centre: Coordinates = _ZERO
    """Centre, m."""

    def __post_init__(self) -> None:
        _positive("ball", radius=self.radius)

    def solid(self, named: NamedSolid) -> Solid:
        return sphere(self.centre, self.radius)


@dataclass(frozen=True)
class HalfSpaceVolume(Volume):
    """The half-space behind a plane: the points p with ``normal . (p - point) <= 0``.

    It has no end, so it can only be a part that another one bounds.

    Raises:
        ValueError: for a normal without a direction.
    """

    normal: Coordinates
    """Direction that leads out of the half-space, of any length."""
    point: Coordinates = _ZERO
    """A point of the plane, m."""

    def __post_init__(self) -> None:
        if not np.linalg.norm(self.normal) > 1e-9:
            raise ValueError(f"normal {self.normal} of a half-space has no direction")

    def solid(self, named: NamedSolid) -> Solid:
        normal = np.array(self.normal, float) / np.linalg.norm(self.normal)
        edges = (np.zeros((0, 2, 3)), np.zeros((0, 2), int))
        plane = Polyhedron(normal[None], np.array([normal @ np.array(self.point)]), *edges)
        return polyhedra((plane,), _EVERYWHERE)

    @property
    def bounded(self) -> bool:
        return False


@dataclass(frozen=True)
class NamedVolume(Volume):
    """A named volume: V_O, V_T, V_OT, V_P, V_R, or V_S or V_N with a radius."""

    name: str
    """Name of the volume."""
    radius: float | None = None
    """Radius of V_S or V_N, m."""

    def solid(self, named: NamedSolid) -> Solid:
        return named(self.name, self.radius)


@dataclass(frozen=True)
class CombinedVolume(Volume):
    """A union or an intersection of volumes, or the first of them less all others.

    Raises:
        ValueError: for fewer than two volumes or an unknown rule.
    """

    rule: Rule
    """How the volumes combine."""
    of: tuple[Volume, ...]
    """The volumes, at least two."""

    def __post_init__(self) -> None:
        if self.rule not in RULES:
            raise ValueError(f"unknown rule {self.rule!r}; known: {', '.join(RULES)}")
        if len(self.of) < 2:
            raise ValueError(f"a {self.rule} needs two or more volumes, got {len(self.of)}")

    def solid(self, named: NamedSolid) -> Solid:
        join: Any = {"union": Union, "difference": Difference, "intersection": Intersection}
        whole: Solid = reduce(join[self.rule], [volume.solid(named) for volume in self.of])
        return whole

    def parts(self) -> Iterator[Volume]:
        yield self
        for volume in self.of:
            yield from volume.parts()

    @property
    def bounded(self) -> bool:
        ends = [volume.bounded for volume in self.of]
        return {"union": all(ends), "difference": ends[0], "intersection": any(ends)}[self.rule]


@dataclass(frozen=True, eq=False)
class MeshVolume(Volume):
    """The inside of a closed mesh.

    Raises:
        ValueError: if the mesh has too many triangles or none, names a corner that it does not
            have, or is not closed: each edge must belong to an even number of triangles.
    """

    vertices: Float[np.ndarray, "V 3"]
    """Corners in the base frame, m."""
    faces: Int[np.ndarray, "T 3"]
    """Corners of each triangle."""

    def __post_init__(self) -> None:
        faces, corners = self.faces, len(self.vertices)
        if not 4 <= len(faces) <= MOST_FACES:
            raise ValueError(
                f"the mesh has {len(faces)} triangles, allowed: 4 to {MOST_FACES}; simplify it"
            )
        if not (np.isfinite(self.vertices).all() and faces.min() >= 0 and faces.max() < corners):
            raise ValueError(f"the mesh has corners that are not finite or not among its {corners}")
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), 1)
        _, count = np.unique(edges, axis=0, return_counts=True)
        if (odd := int((count % 2).sum())) > 0:
            raise ValueError(
                f"the mesh is not closed: {odd} of its {len(count)} edges belong to an odd number"
                " of triangles; close its holes"
            )

    @cached_property
    def _key(self) -> tuple[bytes, bytes]:
        return self.vertices.tobytes(), self.faces.tobytes()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MeshVolume) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @cached_property
    def _solid(self) -> ClosedMesh:
        return ClosedMesh(self.vertices, self.faces)

    def solid(self, named: NamedSolid) -> Solid:
        return self._solid


@dataclass(frozen=True)
class FunctionVolume(Volume):
    """The points at which a function of the caller's is at most 0.

    The function must be 1-Lipschitz: never change faster than distance. Signed distances are, and
    their minima, maxima and negatives. Counts and certificates are wrong for other functions.
    """

    function: Callable[[Float[np.ndarray, "N 3"]], Float[np.ndarray, " N"]]
    """Maps points (N, 3) m to values (N,) m."""
    box: tuple[Coordinates, Coordinates]
    """Lower and upper corner of an axis-aligned box that contains the volume, m."""

    def solid(self, named: NamedSolid) -> Solid:
        return FunctionSolid(self.function, np.array(self.box, float))


@dataclass(frozen=True)
class FunctionSolid(Parts):
    """A solid by a 1-Lipschitz function that the caller supplies, inside a box."""

    function: Callable[[Float[np.ndarray, "N 3"]], Float[np.ndarray, " N"]]
    """Maps points (N, 3) m to values (N,) m."""
    box: Float[np.ndarray, "2 3"]
    """A box that contains the solid, m."""

    def __len__(self) -> int:
        return 1

    def part(self, points: Array, index: Index) -> Any:
        """See ``Parts.part``: the larger of the function and the distance from the box along an
        axis, so that nothing outside the box counts."""
        flat = np.asarray(points).reshape(-1, 3)
        value = np.asarray(self.function(flat), float)
        if value.shape != (len(flat),):
            raise ValueError(
                f"the function of a target returned shape {value.shape} for {len(flat)} points"
            )
        beyond = np.maximum(self.box[0] - flat, flat - self.box[1]).max(axis=1, initial=-np.inf)
        if np.isnan(value).any():
            raise ValueError("the function of a target returned NaN")
        return np.maximum(value, beyond).reshape(np.shape(points)[:-1])

    def shares(self, pairs: CubePairs) -> VolumeFraction:
        """See ``Parts.shares``: 0 or 1 where the function is far enough from 0, else unknown.

        Nothing is known about the surface inside a cube, so bounds are of first order.
        """
        low, high = np.zeros((2, pairs.cubes))
        value = self.part(pairs.points, pairs.part)
        reach = 3**0.5 / 2 * pairs.side + pairs.slack
        low[pairs.cell[value < -reach]] = 1.0
        high[pairs.cell[value <= reach]] = 1.0
        return VolumeFraction(low, high)

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        return self.box


def within(solid: Solid, room: Float[np.ndarray, "2 3"]) -> Solid:
    """Return a solid whose unbounded parts are evaluated in a box (2, 3) m only."""
    if isinstance(solid, Union | Intersection | Difference):
        return replace(solid, a=within(solid.a, room), b=within(solid.b, room))
    if isinstance(solid, Polyhedra) and not np.isfinite(solid.bounds()).all():
        return replace(solid, box=room)
    return solid
