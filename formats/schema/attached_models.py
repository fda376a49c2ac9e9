"""Model of what is attached to the robot: a tool or a payload."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from ...coverage.robots.attached import Attached
from ...coverage.robots.robot import Robot
from ...coverage.solids.capsules import Capsules
from .base_model import Fault, StrictModel, fault
from .field_types import FARTHEST, LONGEST_NAME, Metres
from .obstacle_models import ObstacleModel

_Coordinate = Annotated[
    float, Field(ge=-FARTHEST, le=FARTHEST, description="coordinate in the link's frame, m")
]
_Angle = Annotated[float, Field(ge=-360, le=360, description="angle, degrees")]
_Three = Field(min_length=3, max_length=3)
_KINDS = ("size", "file", "points", "start")


class AttachedModel(StrictModel):
    """A tool or payload on a link: a box (``size``), a mesh (``file``), the convex hull of
    ``points``, or a capsule (``start``, ``end`` and ``radius``).

    ``centre`` and ``rpy_deg`` (rotations about x, then y, then z of the link's frame) place it.
    """

    name: str = Field(default="", max_length=LONGEST_NAME, description="name of the tool")
    link: str = Field(
        default="tcp",
        max_length=LONGEST_NAME,
        description="link that carries it: a link with a mount, a joint, tcp or base",
    )
    centre: Annotated[list[_Coordinate], _Three] = Field(
        default=[0.0, 0.0, 0.0], description="origin of the solid in the link's frame, m"
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
        description="points whose convex hull is the solid, m",
    )
    start: Annotated[list[_Coordinate], _Three] | None = Field(
        default=None, description="start of a capsule's axis, m"
    )
    end: Annotated[list[_Coordinate], _Three] | None = Field(
        default=None, description="end of the capsule's axis, m"
    )
    radius: Annotated[float, Field(gt=0, le=10)] | None = Field(
        default=None, description="radius of the capsule, m"
    )

    @model_validator(mode="after")
    def _of_one_kind(self) -> Self:
        given = [kind for kind in _KINDS if getattr(self, kind) is not None]
        if len(given) != 1:
            raise fault(", ".join(given) or None, f"exactly one of the keys {', '.join(_KINDS)}")
        capsule = [key for key in ("start", "end", "radius") if getattr(self, key) is not None]
        if capsule and len(capsule) != 3:
            raise fault(", ".join(capsule), "start, end and radius together, for a capsule")
        if self.start is None:
            self.shape()
        return self

    def shape(self) -> ObstacleModel:
        """Return the model of the box, mesh or hull as if the link's frame were the base's."""
        return ObstacleModel(
            name=self.name,
            centre=self.centre,
            rpy_deg=self.rpy_deg,
            size=self.size,
            file=self.file,
            scale=self.scale,
            points=self.points,
        )

    def solid(self) -> Attached | None:
        """Return the solid, without a name; None for a mesh, which another file holds."""
        keys = self.model_dump(exclude_defaults=True)
        if self.start is None or self.end is None:
            body = self.shape().body()
            return None if body is None else Attached(self.name, self.link, body, keys)
        ends = np.array([self.start, self.end], float)
        T = ObstacleModel(centre=self.centre, rpy_deg=self.rpy_deg, size=[1, 1, 1]).transform
        start, end = ends @ T[:3, :3].T + T[:3, 3]
        return Attached(self.name, self.link, Capsules(start, end, self.radius), keys)

    def faults(self, robot: Robot, i: int) -> Iterator[Fault]:
        """Yield a link that the robot lacks, and a robot without bodies.

        Args:
            robot: the robot of the scene.
            i: number of this solid in the scene.
        """
        if not robot.bodies:
            yield ("attached", i), self.name, f"none, because robot {robot.name} has no bodies"
        elif self.link not in robot.carriers:
            allowed = f"a link of {robot.name}: {', '.join(robot.carriers)}"
            yield ("attached", i, "link"), self.link, allowed


def attached_of(models: Sequence[AttachedModel]) -> tuple[Attached, ...]:
    """Return the solids that need no other file; the loader adds meshes."""
    solids = []
    for i, model in enumerate(models):
        if (one := model.solid()) is not None:
            name = one.name or f"attached {i}"
            solids.append(Attached(name, one.link, one.solid, one.keys, one.hulled))
    return tuple(solids)


def attached_to(robot: Robot, models: Sequence[AttachedModel]) -> Robot:
    """Return the robot with the solids that need no other file."""
    return robot.with_attached(attached_of(models))
