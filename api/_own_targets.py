"""Targets of one's own: boxes, cylinders, spheres, half-spaces, functions, and their combinations.

All exclude the robot's own volume V_R and the scene's obstacles, as the named targets do.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np

from ._arguments import number
from ._errors import InputError, input_errors
from ._targets import (
    ProtectiveVolume,
    ReachAndToolSpheres,
    ReachSphere,
    RobotVolume,
    Shell,
    TargetVolume,
    ToolSphere,
)
from .coverage.robots.kinematics import transform
from .coverage.targets import Target
from .coverage.volumes import (
    BallVolume,
    BoxVolume,
    CombinedVolume,
    Coordinates,
    CylinderVolume,
    FunctionVolume,
    HalfSpaceVolume,
    MeshVolume,
    NamedVolume,
    Rule,
    Volume,
)
from .coverage.weight_field import WeightField
from .formats.errors import UserError
from .objectives.scene import Goal

_ORIGIN = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class OwnTarget(TargetVolume):
    """Common base of all targets of one's own; use one of its subclasses.

    Raises:
        InputError: for a name that is taken by a named volume, a weight or a minimum coverage out
            of range, or a volume that is empty. A half-space has no end, so only a combination with
            another volume can be a target.
    """

    name: str = ""
    """Name in reports and files; by default the kind of volume, such as ``box``."""

    @property
    def target(self) -> Target:
        """The target volume under its name in files and commands."""
        with input_errors("name" if self.volume.bounded else ""):
            name = self.name or self.symbol
            return Target(name, None, self.volume, self.importance, self.reachable)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.volume.bounded:
            self.target  # noqa: B018  (raises for a bad name)


@dataclass(frozen=True)
class Box(OwnTarget):
    """A box.

    Example:
        >>> import place_rings as pr
        >>> str(pr.Box((1, 2, 1.5), centre=(0.9, 0, 0.5), name="walkway").target)
        'walkway'
    """

    size: Sequence[float]
    """Sides (x, y, z) along its own axes, m."""
    centre: Sequence[float] = _ORIGIN
    """Centre (x, y, z) in the base frame, m."""
    rpy_deg: Sequence[float] = _ORIGIN
    """Rotations about x, y and z of the base frame, in this order, degrees."""
    symbol: str = field(init=False, default="box", repr=False)

    @property
    def volume(self) -> Volume:
        """The box without its weight and name."""
        with input_errors("size"):
            return BoxVolume(
                _three("size", self.size), _three("centre", self.centre), _turn(self.rpy_deg)
            )


@dataclass(frozen=True)
class Cylinder(OwnTarget):
    """A cylinder with flat ends about the z axis of its own frame.

    Example:
        >>> import place_rings as pr
        >>> pr.Cylinder(0.5, 2.0, centre=(1, 0, 1)).height
        2.0
    """

    radius: float
    """Radius, m."""
    height: float
    """Height, m."""
    centre: Sequence[float] = _ORIGIN
    """Middle of its axis (x, y, z) in the base frame, m."""
    rpy_deg: Sequence[float] = _ORIGIN
    """Rotations about x, y and z of the base frame, in this order, degrees."""
    symbol: str = field(init=False, default="cylinder", repr=False)

    @property
    def volume(self) -> Volume:
        """The cylinder without its weight and name."""
        radius, height = _metres("radius", self.radius), _metres("height", self.height)
        return CylinderVolume(radius, height, _three("centre", self.centre), _turn(self.rpy_deg))


@dataclass(frozen=True)
class Sphere(OwnTarget):
    """A sphere.

    Example:
        >>> import place_rings as pr
        >>> pr.Sphere(0.4, centre=(0.5, 0, 0.2)).radius
        0.4
    """

    radius: float
    """Radius, m."""
    centre: Sequence[float] = _ORIGIN
    """Centre (x, y, z) in the base frame, m."""
    symbol: str = field(init=False, default="sphere", repr=False)

    @property
    def volume(self) -> Volume:
        """The sphere without its weight and name."""
        return BallVolume(_metres("radius", self.radius), _three("centre", self.centre))


@dataclass(frozen=True)
class HalfSpace(OwnTarget):
    """The half-space behind a plane. It has no end, so it can only be a part of another target.

    Example:
        >>> import place_rings as pr
        >>> above = pr.HalfSpace((0, 0, -1), point=(0, 0, 0.8))  # all above 0.8 m
        >>> pr.IntersectionOf([pr.Shell(0.5), above], name="above the table").name
        'above the table'
    """

    normal: Sequence[float]
    """Direction (x, y, z) that leads out of the half-space, of any length."""
    point: Sequence[float] = _ORIGIN
    """A point (x, y, z) of the plane in the base frame, m."""
    symbol: str = field(init=False, default="half-space", repr=False)

    @property
    def volume(self) -> Volume:
        """The half-space."""
        with input_errors("normal"):
            return HalfSpaceVolume(_three("normal", self.normal), _three("point", self.point))


@dataclass(frozen=True)
class Mesh(OwnTarget):
    """The inside of a closed mesh.

    Example:
        >>> import place_rings as pr
        >>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        >>> wedge = pr.Mesh(corners, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], name="wedge")
    """

    vertices: Any = field(repr=False)
    """Corners (V, 3) m in the base frame."""
    faces: Any = field(repr=False)
    """Corners of each triangle (T, 3), counted from 0."""
    symbol: str = field(init=False, default="mesh", repr=False)

    @staticmethod
    def load(
        file: str | Path,
        *,
        scale: float = 1.0,
        centre: Sequence[float] = _ORIGIN,
        rpy_deg: Sequence[float] = _ORIGIN,
        **keys: Any,
    ) -> "Mesh":
        """Return the closed mesh in a file (.stl, .ply, .off, .obj).

        Args:
            file: path of the file.
            scale: length of one unit of the mesh, m.
            centre: origin of the mesh (x, y, z) in the base frame, m.
            rpy_deg: rotations about x, y and z of the base frame, in this order, degrees.
            keys: further arguments of a target, such as ``name`` and ``weight``.

        Returns:
            The target.

        Raises:
            InputError: if the file cannot be read or the mesh is not closed.
        """
        from .formats.target_meshes import closed_mesh

        T = transform(np.array(_three("centre", centre)), np.array(_turn(rpy_deg)))
        try:
            mesh = closed_mesh("file", Path(file), Path(file).read_bytes(), float(scale), T)
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", "file", file) from error
        except UserError as error:
            raise InputError(str(error)) from error
        return Mesh(mesh.vertices, mesh.faces, **keys)

    @property
    def volume(self) -> Volume:
        """The mesh without its weight and name."""
        with input_errors("faces"):
            vertices = np.array(self.vertices, float)
            faces = np.array(self.faces, np.int64)
            if vertices.shape[1:] != (3,) or faces.shape[1:] != (3,):
                raise ValueError("found other shapes, allowed: vertices (V, 3) and faces (T, 3)")
            return MeshVolume(vertices, faces)


@dataclass(frozen=True)
class _Combination(OwnTarget):
    """Targets combined by a rule, which is the class's symbol."""

    of: Sequence[TargetVolume]
    """Two or more targets, named ones among them; their own weights, minima and names are not
    used."""

    @property
    def volume(self) -> Volume:
        """The combination without its weight and name."""
        parts = list(self.of) if isinstance(self.of, Iterable) else []
        for part in parts:
            if not isinstance(part, TargetVolume):
                raise InputError(f"found {part!r}, allowed: target volumes", "of")
        with input_errors("of"):
            volumes = tuple(part.volume for part in parts)
            return CombinedVolume(cast(Rule, type(self).symbol), volumes)


@dataclass(frozen=True)
class UnionOf(_Combination):
    """The union of two or more targets.

    Example:
        >>> import place_rings as pr
        >>> len(pr.UnionOf([pr.Box((1, 1, 1)), pr.Shell(0.5)]).of)
        2
    """

    symbol: str = field(init=False, default="union", repr=False)


@dataclass(frozen=True)
class DifferenceOf(_Combination):
    """The first of two or more targets less all others.

    Example:
        >>> import place_rings as pr
        >>> far = pr.DifferenceOf([pr.Shell(1.5), pr.Shell(0.5)], name="far")
    """

    symbol: str = field(init=False, default="difference", repr=False)


@dataclass(frozen=True)
class IntersectionOf(_Combination):
    """The intersection of two or more targets.

    Example:
        >>> import place_rings as pr
        >>> front = pr.IntersectionOf([pr.Shell(0.5), pr.HalfSpace((-1, 0, 0))], name="in front")
    """

    symbol: str = field(init=False, default="intersection", repr=False)


@dataclass(frozen=True)
class Implicit(OwnTarget):
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

    function: Callable[[np.ndarray], np.ndarray]
    """Maps points (N, 3) m in the base frame to values (N,) m, at most 0 inside."""
    box: Sequence[Sequence[float]]
    """Lower and upper corner (2, 3) of an axis-aligned box that contains the target, m."""
    symbol: str = field(init=False, default="implicit", repr=False)

    @property
    def volume(self) -> Volume:
        """The function and its box."""
        try:
            low, high = self.box
        except (TypeError, ValueError) as error:
            raise InputError("found no two corners, allowed: (2, 3) in m", "box") from error
        corners = _three("box", low), _three("box", high)
        if not callable(self.function):
            raise InputError(f"found {self.function!r}, allowed: a function", "function")
        if not all(a < b for a, b in zip(*corners, strict=True)):
            raise InputError("found an empty box, allowed: the lower corner first", "box")
        return FunctionVolume(self.function, corners)


_NAMED: dict[str, type[TargetVolume]] = {
    one.symbol: one
    for one in (ReachSphere, ToolSphere, ReachAndToolSpheres, ProtectiveVolume, RobotVolume)
}
_COMBINED = {one.symbol: one for one in (UnionOf, DifferenceOf, IntersectionOf)}


def volume_of(goal: Goal) -> TargetVolume:
    """Return the target volume of an internal goal."""
    keys: dict[str, Any] = {
        "weight": goal.weight,
        "at_least_percent": round(100 * goal.at_least, 9),
        "importance": goal.target.importance,
        "reachable": goal.target.reachable,
    }
    if goal.target.volume is None:
        return _made(goal.target.volumes[0], keys)
    return _made(goal.target.volume, keys | {"name": goal.target.name})


def _made(volume: Volume, keys: Mapping[str, Any]) -> TargetVolume:
    """Return the target with a volume; ``keys`` holds weight, minimum and name."""
    match volume:
        case NamedVolume(name, radius):
            return _NAMED[name](**keys) if radius is None else Shell(radius, **keys)
        case BoxVolume(size, centre, rpy):
            return Box(size, centre, _degrees(rpy), **keys)
        case CylinderVolume(length, height, centre, rpy):
            return Cylinder(length, height, centre, _degrees(rpy), **keys)
        case BallVolume(length, centre):
            return Sphere(length, centre, **keys)
        case HalfSpaceVolume(normal, point):
            return HalfSpace(normal, point, **keys)
        case MeshVolume(vertices, faces):
            return Mesh(vertices, faces, **keys)
        case FunctionVolume(function, box):
            return Implicit(function, box, **keys)
        case CombinedVolume(rule, of):
            return _COMBINED[rule](tuple(_made(part, {}) for part in of), **keys)
    raise TypeError(f"no target of kind {type(volume).__name__}")


def _three(name: str, values: Any) -> Coordinates:
    """Return three finite numbers; raise InputError that names the argument otherwise."""
    try:
        x, y, z = (float(value) for value in values)
    except (TypeError, ValueError) as error:
        raise InputError(f"found {values!r}, allowed: three numbers (x, y, z)", name) from error
    if not all(math.isfinite(value) for value in (x, y, z)):
        raise InputError(f"found {values!r}, allowed: finite numbers", name)
    return x, y, z


def _turn(rpy_deg: Any) -> Coordinates:
    x, y, z = (math.radians(angle) for angle in _three("rpy_deg", rpy_deg))
    return x, y, z


def _degrees(rpy: Coordinates) -> Coordinates:
    x, y, z = (round(math.degrees(angle), 9) + 0.0 for angle in rpy)
    return x, y, z


def _metres(name: str, value: Any) -> float:
    number(name, value, "m, above 0")
    if not (math.isfinite(value) and value > 0):
        raise InputError(f"found {value:g}, allowed: m, above 0", name)
    return float(value)


def weight_field(
    weights: Any,
    *,
    cell: Sequence[float],
    origin: Sequence[float] = _ORIGIN,
    outside: float = 0.0,
) -> WeightField:
    """Return a weight field: how much each place of a target matters, such as where people walk.

    ζ is then the covered share of the weight. Only ratios of weights count. They are constant on
    each cell of the grid and rounded to 1/65535 of the largest.

    Args:
        weights: weights of 0 or more on a grid along the axes of the base frame: an array (X, Y) or
            (X, Y, Z), or the path of a file: a CSV file, whose rows run along x and follow each
            other along y, or a NumPy array (.npy, .npz).
        cell: sides (x, y, z) of a cell, m.
        origin: lower corner (x, y, z) of the grid in the base frame, m.
        outside: weight outside the grid.

    Returns:
        The field, for the argument ``importance`` of a target.

    Raises:
        InputError: for a file or weights that cannot be used.

    Example:
        >>> import numpy as np
        >>> import place_rings as pr
        >>> busy = pr.weight_field(np.array([[1.0, 0.2]]), cell=(1, 1, 2), origin=(0, -1, 0))
        >>> pr.Scene(targets=pr.Shell(0.5, importance=busy))
        <Scene: ur10, 1 pose, V_S(0.5) weighted, occlusion shadow>
    """
    corner, sides = _three("origin", origin), _three("cell", cell)
    if isinstance(weights, str | Path):
        from .formats.schema.importance_models import weights_of
        from .formats.weight_grids import weight_rows

        try:
            rows, layers = weight_rows("weights", Path(weights), Path(weights).read_bytes())
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", "weights", weights) from error
        except UserError as error:
            raise InputError(str(error)) from error
        with input_errors("weights"):
            weights = weights_of(rows, layers or 1)
    try:
        grid = np.asarray(weights, float)
    except (TypeError, ValueError) as error:
        raise InputError("found no numbers, allowed: (X, Y) or (X, Y, Z)", "weights") from error
    grid = grid[..., None] if grid.ndim == 2 else grid
    with input_errors("weights"):
        if grid.ndim != 3:
            raise ValueError(f"found shape {grid.shape}, allowed: (X, Y) or (X, Y, Z)")
        return WeightField.of(grid, corner, sides, outside)
