"""Convex obstacles of a cell."""

from dataclasses import field
from typing import Annotated

from pydantic import Field

from ..coverage.definitions.definition import definition
from ..coverage.definitions.field_types import FARTHEST
from ..coverage.robots.attached import GIVEN_SOLID, ConvexSolid
from ..coverage.solids.polyhedra import Polyhedron, half_space


@definition
class Obstacle(ConvexSolid):
    """A convex obstacle of the cell. It occludes sensors and is excluded from targets.

    It is a box (``size``), the convex hull of ``points``, the half-space below a ``floor``, or in a
    scene's file the mesh in a ``file``. ``centre`` and ``rpy_deg`` (rotations about x, then y, then
    z of the base frame) place all but the floor.

    Example:
        >>> import place_rings as pr
        >>> pr.Obstacle("table", centre=[0.8, 0, -0.1], size=[0.6, 1.2, 0.2]).name
        'table'
    """

    kinds = (*ConvexSolid.kinds, "floor")
    floor: Annotated[float, Field(ge=-FARTHEST, le=FARTHEST)] | None = field(
        default=None, kw_only=True
    )
    """Height of the floor, m; the obstacle is everything below."""
    body: Annotated[Polyhedron, *GIVEN_SOLID] = field(default=None, repr=False, compare=False)  # type: ignore[assignment]
    """Its shape in the base frame: follows from the other arguments, or stands in their place."""

    def __post_init__(self) -> None:
        if self.body is not None and not any(getattr(self, key) is not None for key in self.kinds):
            return
        body = self._polyhedron()
        if self.floor is not None:
            object.__setattr__(self, "name", self.name or "floor")
            body = half_space(self.floor)
        object.__setattr__(self, "body", body)
