"""Model of an obstacle of the cell."""

from typing import ClassVar

from pydantic import Field

from ...coverage.definitions.field_types import FARTHEST
from ...coverage.solids.polyhedra import Polyhedron, half_space
from ...objectives.scene import Obstacle
from .convex_models import ConvexModel


class ObstacleModel(ConvexModel):
    """An obstacle of the cell: a box (``size``), a mesh (``file``), the convex hull of ``points``,
    or the half-space below a ``floor``.

    ``centre`` and ``rpy_deg`` (rotations about x, then y, then z of the base frame) place all but
    the floor.
    """

    kinds: ClassVar[tuple[str, ...]] = (*ConvexModel.kinds, "floor")

    floor: float | None = Field(
        default=None, ge=-FARTHEST, le=FARTHEST, description="height of the floor, m"
    )

    def body(self) -> Polyhedron | None:
        """Return the solid in the base frame; None for a mesh, which another file holds."""
        return self.polyhedron() if self.floor is None else half_space(self.floor)


def obstacles_of(models: list[ObstacleModel]) -> tuple[Obstacle, ...]:
    """Return the obstacles that need no other file; the loader adds meshes."""
    obstacles = []
    for i, model in enumerate(models):
        name = model.name or ("floor" if model.floor is not None else f"obstacle {i}")
        if (body := model.body()) is not None:
            obstacles.append(Obstacle(name, body, model.model_dump(exclude_defaults=True)))
    return tuple(obstacles)
