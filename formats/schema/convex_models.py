"""Base model of a convex solid: an obstacle of the cell, or what is attached to the robot."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Self

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from ...coverage.definitions.definition import fault
from ...coverage.definitions.field_types import FARTHEST, LONGEST_NAME, Metres
from ...coverage.robots.kinematics import transform
from ...coverage.solids.polyhedra import MOST_FACES, Polyhedron, box, hull
from .base_model import StrictModel
from .field_types import THREE, Angles

# rounded corners may split the faces of a mesh that has MOST_FACES
_MOST_FACES = 2 * MOST_FACES
SolidPoint = Annotated[
    list[
        Annotated[
            float,
            Field(ge=-FARTHEST, le=FARTHEST, description="coordinate in the solid's frame, m"),
        ]
    ],
    THREE,
]


class ConvexModel(StrictModel):
    """A convex solid: a box (``size``), a mesh (``file``) or the convex hull of ``points``."""

    kinds: ClassVar[tuple[str, ...]] = ("size", "file", "points")
    """The keys of which exactly one states the kind of solid."""

    name: str = Field(default="", max_length=LONGEST_NAME, description="name of the solid")
    centre: SolidPoint = Field(
        default=[0.0, 0.0, 0.0],
        description=(
            "origin of the solid, m, in the base frame (key base of the scene) or in that of its"
            " link"
        ),
    )
    rpy_deg: Angles = Field(
        default=[0.0, 0.0, 0.0],
        description="orientation in degrees: rotations about the fixed x, then y, then z axis",
    )
    size: Annotated[list[Metres], THREE] | None = Field(
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
    points: list[SolidPoint] | None = Field(
        default=None,
        min_length=4,
        max_length=20_000,
        description="points whose convex hull is the solid, m",
    )

    @model_validator(mode="after")
    def _of_one_kind(self) -> Self:
        given = list(self.given(self.kinds))
        if len(given) != 1:
            allowed = f"exactly one of the keys {', '.join(self.kinds)}"
            raise fault(", ".join(given) or None, allowed)
        if self.scale != 1.0 and self.file is None:
            raise fault(f"scale {self.scale:g}", "no scale without file, because it scales a mesh")
        if self.points is not None:
            try:
                hull(np.array(self.points), _MOST_FACES)
            except ValueError as error:
                allowed = f"points that span a volume, with at most {_MOST_FACES} faces around them"
                raise fault(self.points, allowed) from error
        return self

    def given(self, keys: tuple[str, ...]) -> Iterator[str]:
        """Yield those of the keys that are stated."""
        return (key for key in keys if getattr(self, key) is not None)

    @property
    def transform(self) -> Float[np.ndarray, "4 4"]:
        """Pose in the base frame or in that of the link, m."""
        return transform(self.centre, np.radians(self.rpy_deg))

    def polyhedron(self) -> Polyhedron | None:
        """Return the box or the hull in that frame; None for other kinds."""
        T = self.transform
        if self.size is not None:
            return box(self.centre, self.size, T[:3, :3])
        if self.points is not None:
            return hull(np.array(self.points) @ T[:3, :3].T + T[:3, 3])
        return None
