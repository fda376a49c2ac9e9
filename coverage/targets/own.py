"""Targets of one's own: boxes, cylinders, capsules, spheres, half-spaces, meshes and functions.

All exclude the robot's own volume V_R and the scene's obstacles, as the named targets do; with V_N
among their parts they exclude the robot's bodies in place of V_R. All coordinates are in the base
frame.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from jaxtyping import Float
from pydantic import Field, WithJsonSchema

from ..arrays import Array, Index
from ..definitions.definition import definition, refuse
from ..definitions.field_types import (
    FARTHEST,
    ORIGIN,
    Angles,
    Items,
    Metres,
    Pair,
    PartNames,
    Point,
    Triple,
)
from ..robots.base_frame import HALF_TURN, turned, turned_rpy
from ..robots.kinematics import transform
from ..solids.base import CubePairs, Difference, Intersection, Parts, Solid, Union
from ..solids.capsules import Capsules
from ..solids.closed_mesh import ClosedMesh
from ..solids.frustums import Frustums
from ..solids.polyhedra import Polyhedra, Polyhedron, box, polyhedra
from ..solids.spheres import sphere
from ..solids.volume_fraction import VolumeFraction
from .posed_robot import PosedRobot
from .target import Target

MOST_FACES = 50_000  # triangles of a mesh
_Component = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, description="component")]
_Corners = Triple[Annotated[int, Field(ge=0)]]
_EVERYWHERE = np.array([[-np.inf] * 3, [np.inf] * 3])


class _Placed:
    """Part of targets with a frame of their own, which ``centre`` and ``rpy_deg`` place."""

    centre: tuple[float, float, float]
    rpy_deg: tuple[float, float, float]

    @property
    def _frame(self) -> Float[np.ndarray, "4 4"]:
        """Pose of its frame in the base frame."""
        return transform(self.centre, np.radians(self.rpy_deg))

    def _turned(self) -> dict[str, Any]:
        return {"centre": turned(self.centre), "rpy_deg": turned_rpy(self.rpy_deg)}

    def _round(self, height: float, low: float, high: float) -> Solid:
        """Return the frustum of a cone about the z axis by its height and the radii of its ends."""
        axis = (1.0 if high >= low else -1.0) * self._frame[:3, 2]  # from the narrow end
        angle, narrow = math.atan2(abs(high - low), height), min(low, high)
        start = np.array(self.centre) - height / 2 * axis
        sizes = (np.array([angle]), np.array([height]), None, np.array([narrow]))
        return Frustums(start[None], axis[None], *sizes)


@definition
class Box(_Placed, Target):
    """A box.

    Example:
        >>> import place_rings as pr
        >>> str(pr.Box((1, 2, 1.5), centre=(0.9, 0, 0.5), name="walkway"))
        'walkway'
    """

    kind = "box"

    size: Triple[Metres]
    """Sides (x, y, z) along its own axes, m."""
    centre: Point = ORIGIN
    """Centre (x, y, z) in the base frame (``base`` of ``Scene``), m."""
    rpy_deg: Angles = ORIGIN
    """Rotations about the fixed x, then y, then z axis of the base frame, degrees."""

    def solid(self, place: PosedRobot) -> Solid:
        turn = self._frame[:3, :3]
        half = np.abs(turn) @ np.array(self.size) / 2
        corners = np.array(self.centre) + np.array([[-1.0], [1.0]]) * half
        return polyhedra((box(self.centre, self.size, turn),), corners)

    def described(self) -> str:
        return f"a box of {' by '.join(f'{side:g}' for side in self.size)} m"


@definition
class Cylinder(_Placed, Target):
    """A cylinder with flat ends about the z axis of its own frame.

    Example:
        >>> import place_rings as pr
        >>> pr.Cylinder(0.5, 2.0, centre=(1, 0, 1)).height
        2.0
    """

    kind = "cylinder"

    radius: Metres
    """Radius, m."""
    height: Metres
    """Height, m."""
    centre: Point = ORIGIN
    """Middle of its axis (x, y, z) in the base frame (``base`` of ``Scene``), m."""
    rpy_deg: Angles = ORIGIN
    """Rotations about the fixed x, then y, then z axis of the base frame, degrees."""

    def solid(self, place: PosedRobot) -> Solid:
        return self._round(self.height, self.radius, self.radius)

    def described(self) -> str:
        return f"a cylinder of radius {self.radius:g} m and height {self.height:g} m"


@definition
class Cone(_Placed, Target):
    """A cone, or a frustum of one, with flat ends about the z axis of its own frame.

    Example:
        >>> import place_rings as pr
        >>> pr.Cone(0.5, 0.2, 1.0, centre=(1, 0, 0.5)).top_radius
        0.2
    """

    kind = "cone"

    radius: Metres
    """Radius of the lower end, m."""
    top_radius: Annotated[float, Field(ge=0, le=100)]
    """Radius of the upper end, m; 0 for a pointed cone."""
    height: Metres
    """Height, m."""
    centre: Point = ORIGIN
    """Middle of its axis (x, y, z) in the base frame (``base`` of ``Scene``), m."""
    rpy_deg: Angles = ORIGIN
    """Rotations about the fixed x, then y, then z axis of the base frame, degrees."""

    def solid(self, place: PosedRobot) -> Solid:
        return self._round(self.height, self.radius, self.top_radius)

    def described(self) -> str:
        radii = f"{self.radius:g} and {self.top_radius:g} m"
        return f"a cone of radii {radii} and height {self.height:g} m"


@definition
class Capsule(Target):
    """A capsule: all points within a radius of a segment.

    Example:
        >>> import place_rings as pr
        >>> str(pr.Capsule((1, 0, 0.2), (1, 0, 1.6), 0.3, name="a person"))
        'a person'
    """

    kind = "capsule"

    start: Point
    """Start of the segment (x, y, z) in the base frame (``base`` of ``Scene``), m."""
    end: Point
    """End of the segment (x, y, z) in the base frame, m; a ball if it is the start."""
    radius: Metres
    """Radius, m."""

    def solid(self, place: PosedRobot) -> Solid:
        start, end = np.array([self.start]), np.array([self.end])
        return Capsules(start, end, np.array([self.radius]))

    def _turned(self) -> dict[str, Any]:
        return {"start": turned(self.start), "end": turned(self.end)}

    def described(self) -> str:
        length = math.dist(self.start, self.end)
        return f"a capsule of radius {self.radius:g} m about a segment of {length:g} m"


@definition
class Sphere(Target):
    """A sphere.

    Example:
        >>> import place_rings as pr
        >>> pr.Sphere(0.4, centre=(0.5, 0, 0.2)).radius
        0.4
    """

    kind = "sphere"

    radius: Metres
    """Radius, m."""
    centre: Point = ORIGIN
    """Centre (x, y, z) in the base frame (``base`` of ``Scene``), m."""

    def solid(self, place: PosedRobot) -> Solid:
        return sphere(self.centre, self.radius)

    def _turned(self) -> dict[str, Any]:
        return {"centre": turned(self.centre)}

    def described(self) -> str:
        return f"a sphere of radius {self.radius:g} m"


@definition
class HalfSpace(Target):
    """The half-space behind a plane: the points p with ``normal . (p - point) <= 0``. It has no
    end, so it can only be a part of another target.

    Example:
        >>> import place_rings as pr
        >>> above = pr.HalfSpace((0, 0, -1), point=(0, 0, 0.8))  # all above 0.8 m
        >>> pr.IntersectionOf([pr.Shell(0.5), above], name="above the table").name
        'above the table'
    """

    kind = "half_space"

    normal: Triple[_Component]
    """Direction (x, y, z) that leads out of the half-space, of any length."""
    point: Point = ORIGIN
    """A point (x, y, z) of the plane in the base frame (``base`` of ``Scene``), m."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not math.hypot(*self.normal) > 1e-9:
            refuse([(("normal",), self.normal, "a direction of a length above 0")])

    @property
    def bounded(self) -> bool:
        return False

    def solid(self, place: PosedRobot) -> Solid:
        return _behind(np.array(self.normal) / np.linalg.norm(self.normal), np.array(self.point))

    def _turned(self) -> dict[str, Any]:
        return {"normal": turned(self.normal), "point": turned(self.point)}

    def described(self) -> str:
        return "a half-space"


def _behind(normal: Float[np.ndarray, "3"], point: Float[np.ndarray, "3"]) -> Solid:
    """Return the half-space behind the plane through a point, by its unit normal."""
    edges = (np.zeros((0, 2, 3)), np.zeros((0, 2), int))
    plane = Polyhedron(normal[None], np.array([normal @ point]), *edges)
    return polyhedra((plane,), _EVERYWHERE)


@definition
class Mesh(Target):
    """The inside of a closed mesh. Each of its edges belongs to an even number of triangles.

    Example:
        >>> import place_rings as pr
        >>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        >>> wedge = pr.Mesh(corners, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], name="wedge")
    """

    kind = "mesh"

    vertices: Annotated[Items[Point], Field(min_length=4, max_length=3 * MOST_FACES)] = field(
        repr=False
    )
    """Corners (V, 3) in the base frame, m."""
    faces: Annotated[Items[_Corners], Field(min_length=4, max_length=MOST_FACES)] = field(
        repr=False
    )
    """Corners of each triangle (T, 3), counted from 0."""

    def __post_init__(self) -> None:
        super().__post_init__()
        faces, corners = np.array(self.faces), len(self.vertices)
        if faces.max() >= corners:
            refuse([(("faces",), int(faces.max()), f"corners below {corners}, counted from 0")])
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), 1)
        _, count = np.unique(edges, axis=0, return_counts=True)
        if (odd := int((count % 2).sum())) > 0:
            allowed = f"0 of {len(count)} edges in an odd number of triangles; close its holes"
            refuse([(("faces",), odd, allowed)])

    load: ClassVar[Callable[..., Any]]
    """Returns the closed mesh in a file; set by the front, as nothing here reads files."""

    @cached_property
    def _solid(self) -> ClosedMesh:
        return ClosedMesh(np.array(self.vertices), np.array(self.faces, np.int64))

    def solid(self, place: PosedRobot) -> Solid:
        return self._solid

    def _turned(self) -> dict[str, Any]:
        return {"vertices": np.array(self.vertices) * HALF_TURN + 0.0}

    def described(self) -> str:
        return f"a closed mesh of {len(self.faces)} triangles"


@definition
class MeshFile:
    """A closed mesh as a table that names a file, which the reader of files puts in its place."""

    file: Annotated[str, Field(min_length=1, max_length=1000)]
    """File of a closed mesh (.stl, .ply, .off, .obj, .glb, .gltf, .usd, .usda, .usdc) in the file's
    folder or below."""
    parts: PartNames = ()
    """Parts of a glTF or OpenUSD file that are taken, as in obstacles. Default: all."""
    scale: Annotated[float, Field(gt=0, le=1000)] = 1.0
    """Length of one unit of the mesh in the file, m."""
    centre: Point = ORIGIN
    """Origin of the mesh (x, y, z) in the base frame (``base`` of ``Scene``), m."""
    rpy_deg: Angles = ORIGIN
    """Rotations about the fixed x, then y, then z axis of the base frame, degrees."""


@definition
class Implicit(Target):
    """The points in a box at which a function of your own is at most 0.

    The function must be 1-Lipschitz: it must never change faster than distance. Signed distances
    are, and so are their minima, maxima and negatives; divide any other function by its largest
    slope. Counts and certificates are wrong otherwise. A certified interval shrinks slowly, because
    nothing else is known about the surface. No file can hold a function.

    Example:
        >>> import numpy as np
        >>> import place_rings as pr
        >>> def torus(p):
        ...     around = np.hypot(p[:, 0], p[:, 1]) - 0.8
        ...     return np.hypot(around, p[:, 2] - 0.5) - 0.2
        >>> walk = pr.Implicit(torus, ((-1, -1, 0.3), (1, 1, 0.7)), name="walk around")
    """

    kind = "implicit"
    in_files = False

    function: Annotated[Callable[[np.ndarray], np.ndarray], WithJsonSchema({"type": "function"})]
    """Maps points (N, 3) m in the base frame to values (N,) m, at most 0 inside."""
    box: Pair[Point]
    """Lower and upper corner (2, 3) of an axis-aligned box that contains the target, m."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not all(a < b for a, b in zip(*self.box, strict=True)):
            refuse([(("box",), self.box, "the lower corner first, and a box that is not empty")])

    def solid(self, place: PosedRobot) -> Solid:
        return FunctionSolid(self.function, np.array(self.box))

    def _turned(self) -> dict[str, Any]:
        (a, b, low), (c, d, high) = self.box
        corners = turned((c, d, low)), turned((a, b, high))
        return {"function": TurnedFunction(self.function), "box": corners}

    def described(self) -> str:
        return "a volume by a function"


@dataclass(frozen=True)
class TurnedFunction:
    """A function of points that are turned by 180° about z first."""

    function: Callable[[np.ndarray], np.ndarray]

    def __call__(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        return self.function(points * HALF_TURN)


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
