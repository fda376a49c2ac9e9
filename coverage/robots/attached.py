"""Convex solids with a frame of their own, and those that a link carries beside its own body: tools
and payloads."""

from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar, TypeVar

import numpy as np
from jaxtyping import Float
from pydantic import Field, PlainValidator, WithJsonSchema

from ..definitions.definition import definition, fault, refuse
from ..definitions.field_types import (
    FARTHEST,
    ORIGIN,
    Angles,
    Items,
    Metres,
    PartNames,
    Text,
    Triple,
)
from ..definitions.units import ELSEWHERE
from ..solids.capsules import Capsules
from ..solids.polyhedra import MOST_FACES, Polyhedron, box, hull, placed
from ..solids.segments import point_to_segment
from .kinematics import transform

_SHORTER = 9  # lengths of an enclosing capsule's axis of which the best is taken
_MOST_FACES = 2 * MOST_FACES  # rounded corners may split the faces of a mesh that has MOST_FACES
SolidPoint = Triple[
    Annotated[
        float, Field(ge=-FARTHEST, le=FARTHEST, description="coordinate in the solid's frame, m")
    ]
]


def _solid(value: Any) -> Any:
    if value is not None and not isinstance(value, Capsules | Polyhedron):
        raise fault(value, "a Polyhedron, or none and the keys of one by name")
    return value


GIVEN_SOLID = (PlainValidator(_solid), WithJsonSchema({}), ELSEWHERE)
"""Annotations of the solid itself, which follows from the keys of its table."""
_CAPSULE = ("start", "end", "radius")


@definition
class ConvexSolid:
    """A convex solid: a box (``size``), the convex hull of ``points``, or in a scene's file the
    mesh in a ``file``.

    ``centre`` and ``rpy_deg`` place it.
    """

    kinds: ClassVar[tuple[str, ...]] = ("size", "file", "points")
    """The keys of which exactly one states the kind of solid."""
    name: Text = ""
    """Name of the solid."""
    _: KW_ONLY
    centre: SolidPoint = ORIGIN
    """Origin of the solid, m, in the base frame (key base of the scene) or in that of its link."""
    rpy_deg: Angles = ORIGIN
    """Orientation in degrees: rotations about the fixed x, then y, then z axis."""
    size: Triple[Metres] | None = None
    """Lengths of a box along its axes, m."""
    file: Annotated[str, Field(min_length=1, max_length=1000)] | None = None
    """Mesh file in the scene's folder or below."""
    scale: Annotated[float, Field(gt=0, le=1000)] = 1.0
    """Length of one unit of the mesh, m."""
    parts: PartNames = ()
    """Parts of a glTF or OpenUSD file that are taken, by the names of its nodes, in which ``*``
    stands for any text; a ``!`` before a name leaves the part out. Default: all."""
    points: Annotated[Items[SolidPoint], Field(min_length=4, max_length=20_000)] | None = None
    """Points whose convex hull is the solid, m."""
    hulled: Annotated[bool, ELSEWHERE] = field(default=False, compare=False)
    """Whether it is the convex hull of a non-convex shape."""

    def _polyhedron(self) -> Polyhedron | None:
        """Return the box or the hull in the frame that carries it; None for other kinds.

        Raises:
            ValidationError: if the keys state no solid, or more than one.
        """
        stated = [key for key in self.kinds if getattr(self, key) is not None]
        if len(stated) != 1:
            allowed = f"exactly one of the keys {', '.join(self.kinds)}"
            refuse([((), ", ".join(stated) or None, allowed)])
        if self.scale != 1.0 and self.file is None:
            allowed = "no scale without file, because it scales a mesh"
            refuse([((), f"scale {self.scale:g}", allowed)])
        if self.parts and self.file is None:
            refuse([(("parts",), list(self.parts), "parts only with the file that has them")])
        T = self.transform
        if self.size is not None:
            return box(self.centre, self.size, T[:3, :3])
        if self.points is None:
            return None
        try:
            return hull(np.array(self.points) @ T[:3, :3].T + T[:3, 3], _MOST_FACES)
        except ValueError:
            allowed = f"points that span a volume, with at most {_MOST_FACES} faces around them"
            refuse([((), self.points, allowed)])
            raise

    @property
    def transform(self) -> Float[np.ndarray, "4 4"]:
        """Pose (4, 4) in the base frame or in that of the link, m."""
        return transform(self.centre, np.radians(self.rpy_deg))


Solid = TypeVar("Solid", bound=ConvexSolid)


def named(solids: Iterable[Solid], noun: str) -> tuple[Solid, ...]:
    """Return solids with names: those without one are called ``noun`` and their number."""
    pairs = enumerate(solids)
    return tuple(s if s.name else replace(s, name=f"{noun} {i}") for i, s in pairs)


def refuse_file(solid: ConvexSolid) -> None:
    """Raise ValueError for the mesh in a file, which only a scene's file can name."""
    if solid.file is not None:
        raise ValueError(f"{solid.name}.file: allowed only in a scene's file, which load reads")


@definition
class Attached(ConvexSolid):
    """A tool or payload on a link. It moves with the link, belongs to the robot's body, occludes
    sensors, is excluded from targets, and rings keep clear of it.

    It is a box (``size``), the convex hull of ``points``, a capsule (``start``, ``end`` and
    ``radius``), or in a scene's file the mesh in a ``file``. ``centre`` and ``rpy_deg`` (rotations
    about x, then y, then z of the link's frame) place it.

    Example:
        >>> import place_rings as pr
        >>> pr.Attached("gripper", centre=[0, 0, 0.07], size=[0.1, 0.06, 0.14]).link
        'tcp'
    """

    kinds = (*ConvexSolid.kinds, "start")
    link: Text = "tcp"
    """Link that carries it: a link with a mount, a joint (the link that it moves), tcp or base."""
    start: SolidPoint | None = field(default=None, kw_only=True)
    """Start of a capsule's axis, m."""
    end: SolidPoint | None = field(default=None, kw_only=True)
    """End of the capsule's axis, m."""
    radius: Annotated[float, Field(gt=0, le=10)] | None = field(default=None, kw_only=True)
    """Radius of the capsule, m."""
    solid: Annotated[Capsules | Polyhedron, *GIVEN_SOLID] = field(
        default=None, repr=False, compare=False
    )  # type: ignore[assignment]
    """The solid in the link's frame, a single capsule or a convex polyhedron: follows from the
    other arguments, or stands in their place."""

    def __post_init__(self) -> None:
        if self.solid is not None and not any(getattr(self, key) is not None for key in self.kinds):
            return
        solid: Capsules | Polyhedron | None = self._polyhedron()
        capsule = [key for key in _CAPSULE if getattr(self, key) is not None]
        if capsule and len(capsule) != len(_CAPSULE):
            allowed = "start, end and radius together, for a capsule"
            refuse([((), ", ".join(capsule), allowed)])
        if capsule:
            T = self.transform
            start, end = np.array([self.start, self.end], float) @ T[:3, :3].T + T[:3, 3]
            solid = Capsules(start, end, self.radius)
        object.__setattr__(self, "solid", solid)

    def moved(self, T: Float[np.ndarray, "4 4"]) -> Capsules | Polyhedron:
        """Return the solid in the frame in which its own frame has the pose ``T`` (4, 4) m."""
        if isinstance(self.solid, Polyhedron):
            return placed(self.solid, T)
        start, end = (
            T[:3, :3] @ np.asarray(v) + T[:3, 3] for v in (self.solid.start, self.solid.end)
        )
        return Capsules(start, end, self.solid.radius)


@dataclass(frozen=True)
class CarriedPolyhedron:
    """A convex polyhedron that a joint or the base carries."""

    name: str
    """Name in messages and exports."""
    frame: int
    """Index into ``forward``'s frames, or ``BASE`` for the base frame."""
    body: Polyhedron
    """The polyhedron in that frame."""
    hulled: bool = False
    """Whether it is the convex hull of a non-convex shape."""

    @cached_property
    def enclosing(self) -> Capsules:
        """A capsule, in the same frame, that contains the polyhedron."""
        return enclosing_capsule(np.asarray(self.body.edges).reshape(-1, 3))


def enclosing_capsule(points: Float[np.ndarray, "N 3"]) -> Capsules:
    """Return a capsule that contains points (N, 3) m.

    Its axis lies along their principal axis; of several lengths, the one of the least volume is
    taken.
    """
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle)[2]  # (3, 3), the longest first
    along = (points - middle) @ axes.T
    low, high = along.min(axis=0), along.max(axis=0)
    centre, half = middle + ((low + high) / 2) @ axes, (high[0] - low[0]) / 2
    best = None
    for length in np.linspace(0, half, _SHORTER):
        start, end = centre - length * axes[0], centre + length * axes[0]
        radius = float(point_to_segment(points, start, end).max())
        capsule = Capsules(start, end, radius)
        if best is None or capsule.volume < best.volume:
            best = capsule
    assert best is not None
    return best
