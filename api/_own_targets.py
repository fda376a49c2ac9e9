"""Targets of one's own: boxes, cylinders, spheres, half-spaces, functions, and their combinations.

All exclude the robot's own volume V_R and the scene's obstacles, as the named targets do; with V_N
among their parts they exclude the robot's bodies in place of V_R.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ._arguments import metres, three, turn
from ._errors import InputError, input_errors
from ._targets import (
    TargetVolume,
)
from .coverage.robots.kinematics import transform
from .coverage.targets import Target
from .coverage.volumes import (
    BallVolume,
    BoxVolume,
    CylinderVolume,
    FunctionVolume,
    HalfSpaceVolume,
    MeshVolume,
    Volume,
)
from .formats.errors import UserError

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
    """Centre (x, y, z) in the base frame (``base`` of ``Scene``), m."""
    rpy_deg: Sequence[float] = _ORIGIN
    """Rotations about x, y and z of the base frame, in this order, degrees."""
    symbol: str = field(init=False, default="box", repr=False)

    @property
    def volume(self) -> Volume:
        """The box without its weight and name."""
        with input_errors("size"):
            return BoxVolume(
                three("size", self.size), three("centre", self.centre), turn(self.rpy_deg)
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
    """Middle of its axis (x, y, z) in the base frame (``base`` of ``Scene``), m."""
    rpy_deg: Sequence[float] = _ORIGIN
    """Rotations about x, y and z of the base frame, in this order, degrees."""
    symbol: str = field(init=False, default="cylinder", repr=False)

    @property
    def volume(self) -> Volume:
        """The cylinder without its weight and name."""
        radius, height = metres("radius", self.radius), metres("height", self.height)
        return CylinderVolume(radius, height, three("centre", self.centre), turn(self.rpy_deg))


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
    """Centre (x, y, z) in the base frame (``base`` of ``Scene``), m."""
    symbol: str = field(init=False, default="sphere", repr=False)

    @property
    def volume(self) -> Volume:
        """The sphere without its weight and name."""
        return BallVolume(metres("radius", self.radius), three("centre", self.centre))


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
    """A point (x, y, z) of the plane in the base frame (``base`` of ``Scene``), m."""
    symbol: str = field(init=False, default="half-space", repr=False)

    @property
    def volume(self) -> Volume:
        """The half-space."""
        with input_errors("normal"):
            return HalfSpaceVolume(three("normal", self.normal), three("point", self.point))


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
            centre: origin of the mesh (x, y, z) in the base frame (``base`` of ``Scene``), m.
            rpy_deg: rotations about x, y and z of the base frame, in this order, degrees.
            keys: further arguments of a target, such as ``name`` and ``weight``.

        Returns:
            The target.

        Raises:
            InputError: if the file cannot be read or the mesh is not closed.
        """
        from .formats.target_meshes import closed_mesh

        T = transform(np.array(three("centre", centre)), np.array(turn(rpy_deg)))
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
        corners = three("box", low), three("box", high)
        if not callable(self.function):
            raise InputError(f"found {self.function!r}, allowed: a function", "function")
        if not all(a < b for a, b in zip(*corners, strict=True)):
            raise InputError("found an empty box, allowed: the lower corner first", "box")
        return FunctionVolume(self.function, corners)
