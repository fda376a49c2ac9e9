"""Model of an obstacle of the cell."""

from typing import Annotated, Self

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from ...coverage.robots.kinematics import transform
from ...coverage.solids.polyhedra import Polyhedron, box, half_space, hull
from ...objectives.scene import Obstacle
from .base_model import StrictModel, fault
from .field_types import FARTHEST, LONGEST_NAME, Metres

_Coordinate = Annotated[
    float, Field(ge=-FARTHEST, le=FARTHEST, description="coordinate in the base frame, m")
]
_Three = Field(min_length=3, max_length=3)
_Angle = Annotated[float, Field(ge=-360, le=360, description="angle, degrees")]


class ObstacleModel(StrictModel):
    """An obstacle of the cell: a box (``size``), a mesh (``file``), the convex hull of ``points``,
    or the half-space below a ``floor``.

    ``centre`` and ``rpy_deg`` (rotations about x, then y, then z of the base frame) place all but
    the floor.
    """

    name: str = Field(default="", max_length=LONGEST_NAME, description="name of the obstacle")
    centre: Annotated[list[_Coordinate], _Three] = Field(
        default=[0.0, 0.0, 0.0], description="origin of the obstacle in the base frame, m"
    )
    rpy_deg: Annotated[list[_Angle], _Three] = Field(
        default=[0.0, 0.0, 0.0],
        description="orientation in degrees: rotations about the fixed x, then y, then z axis",
    )
    size: Annotated[list[Metres], _Three] | None = Field(
        default=None, description="lengths of a box along its axes, m"
    )
    file: str | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="mesh file in the scene's folder or below",
    )
    scale: float = Field(
        default=1.0, gt=0, le=1000, description="length of one unit of the mesh, m"
    )
    points: list[Annotated[list[_Coordinate], _Three]] | None = Field(
        default=None,
        min_length=4,
        max_length=20_000,
        description="points whose convex hull is the obstacle, m",
    )
    floor: float | None = Field(
        default=None, ge=-FARTHEST, le=FARTHEST, description="height of the floor, m"
    )

    @model_validator(mode="after")
    def _of_one_kind(self) -> Self:
        kinds = ("size", "file", "points", "floor")
        given = [kind for kind in kinds if getattr(self, kind) is not None]
        if len(given) != 1:
            raise fault(given or None, f"exactly one of the keys {', '.join(kinds)}")
        if self.scale != 1.0 and self.file is None:
            raise fault(f"scale {self.scale:g}", "no scale without file, because it scales a mesh")
        if self.points is not None:
            try:
                hull(np.array(self.points))
            except ValueError as error:
                raise fault(self.points, "points that do not all lie in one plane") from error
        return self

    @property
    def transform(self) -> Float[np.ndarray, "4 4"]:
        """Pose in the base frame, m."""
        return transform(self.centre, np.radians(self.rpy_deg))

    def body(self) -> Polyhedron | None:
        """Return the solid in the base frame; None for a mesh, which another file holds."""
        T = self.transform
        if self.floor is not None:
            return half_space(self.floor)
        if self.size is not None:
            return box(self.centre, self.size, T[:3, :3])
        if self.points is not None:
            return hull(np.array(self.points) @ T[:3, :3].T + T[:3, 3])
        return None


def obstacles_of(models: list[ObstacleModel]) -> tuple[Obstacle, ...]:
    """Return the obstacles that need no other file; the loader adds meshes."""
    obstacles = []
    for i, model in enumerate(models):
        name = model.name or ("floor" if model.floor is not None else f"obstacle {i}")
        if (body := model.body()) is not None:
            obstacles.append(Obstacle(name, body, model.model_dump(exclude_defaults=True)))
    return tuple(obstacles)
