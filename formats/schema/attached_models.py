"""Model of what is attached to the robot: a tool or a payload."""

from collections.abc import Iterator, Sequence
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from ...coverage.definitions.definition import Fault, fault
from ...coverage.definitions.field_types import LONGEST_NAME
from ...coverage.robots.attached import Attached
from ...coverage.robots.robot import Robot
from ...coverage.solids.capsules import Capsules
from .convex_models import ConvexModel, SolidPoint

_CAPSULE = ("start", "end", "radius")


class AttachedModel(ConvexModel):
    """A tool or payload on a link: a box (``size``), a mesh (``file``), the convex hull of
    ``points``, or a capsule (``start``, ``end`` and ``radius``).

    ``centre`` and ``rpy_deg`` (rotations about x, then y, then z of the link's frame) place it.
    """

    kinds: ClassVar[tuple[str, ...]] = (*ConvexModel.kinds, "start")

    link: str = Field(
        default="tcp",
        max_length=LONGEST_NAME,
        description="link that carries it: a link with a mount, a joint, tcp or base",
    )
    start: SolidPoint | None = Field(default=None, description="start of a capsule's axis, m")
    end: SolidPoint | None = Field(default=None, description="end of the capsule's axis, m")
    radius: Annotated[float, Field(gt=0, le=10)] | None = Field(
        default=None, description="radius of the capsule, m"
    )

    @model_validator(mode="after")
    def _whole_capsule(self) -> Self:
        capsule = list(self.given(_CAPSULE))
        if capsule and len(capsule) != len(_CAPSULE):
            raise fault(", ".join(capsule), "start, end and radius together, for a capsule")
        return self

    def solid(self) -> Attached | None:
        """Return the solid, without a name; None for a mesh, which another file holds."""
        keys = self.model_dump(exclude_defaults=True)
        if self.start is None or self.end is None:
            body = self.polyhedron()
            return None if body is None else Attached(self.name, self.link, body, keys)
        ends, T = np.array([self.start, self.end], float), self.transform
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
