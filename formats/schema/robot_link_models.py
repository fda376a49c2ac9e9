"""Models of what a robot's links carry: axes around which rings sit, and capsules that enclose
them."""

from collections.abc import Collection, Iterator, Sequence
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ...coverage.definitions.definition import Fault, refuse
from ...coverage.robots.robot import Body, Mount
from ...coverage.solids.capsules import Capsules
from .chain_models import LENGTH, TOLERANCE, VECTOR, UnitVector, is_unit
from .field_types import Name, Point
from .mapping import MappedModel

_Share = Annotated[
    float, Field(ge=0, le=1, description="position along the axis, from 0 proximal to 1 distal")
]


def on_the_axis(keys: dict[str, Any]) -> dict[str, Any]:
    """Return a mount's keys without ``aside`` and ``toward_deg``, which earlier files may state.

    They shifted the link's tube from the mount axis. A file that states a shift is refused, because
    positions and radii of its rings would refer to another axis.
    """
    aside = keys.get("aside", 0)
    if aside != 0:
        refuse([(("aside",), aside, "a mount whose axis is the axis of the link's own tube")])
    return {key: value for key, value in keys.items() if key not in ("aside", "toward_deg")}


class MountAxisModel(MappedModel[Mount]):
    """The axis of a link around which rings sit, in the frame of a joint or of the TCP."""

    link: Name = Field(description="name of the link")
    frame: Name = Field(description="joint that moves the link, or tcp")
    start: Annotated[Point, VECTOR] = Field(
        default=[0.0, 0.0, 0.0], description="proximal end of the axis, m"
    )
    axis: Annotated[UnitVector, VECTOR] = Field(description="unit vector towards the distal end")
    zero: Annotated[UnitVector, VECTOR] = Field(
        description=(
            "unit vector perpendicular to the axis, towards the first sensor of a ring with phase 0"
        )
    )
    length: Annotated[float, LENGTH] = Field(
        ge=0, le=100, description="length of the axis, m; 0: a fixed position"
    )
    usable: Annotated[list[_Share], Field(min_length=2, max_length=2)] = Field(
        default=[0.0, 1.0],
        description="interval in which a real ring can be closed, from 0 proximal to 1 distal",
    )
    section: Annotated[float, LENGTH] = Field(
        default=0.0,
        ge=0,
        le=10,
        description="radius of the body that a ring surrounds, m; 0: unknown",
    )
    confidence: Literal["", "high", "medium", "low"] = Field(
        default="", description="how far a ring may rely on the section; empty: not assessed"
    )
    basis: str = Field(default="", max_length=300, description="reason for the confidence")

    @model_validator(mode="before")
    @classmethod
    def _on_the_axis(cls, keys: Any) -> Any:
        return on_the_axis(keys) if isinstance(keys, dict) else keys


class BodyModel(MappedModel[Body]):
    """A capsule in the frame of a joint or of the base."""

    name: Name = Field(description="name of the body")
    frame: Name = Field(description="joint that moves the body, or base")
    start: Point = Field(description="start of the capsule's axis, m")
    end: Point = Field(description="end of the capsule's axis, m")
    radius: float = Field(gt=0, le=10, description="radius of the capsule, m")

    def to_domain(self, **given: Any) -> Body:
        """Return the body; pass its ``frame`` as an index."""
        ends = np.array([self.start, self.end], float)
        return super().to_domain(capsule=Capsules(ends[0], ends[1], self.radius), **given)

    @classmethod
    def from_domain(cls, value: Body, **given: Any) -> Self:
        """Return the table of a body; pass its ``frame`` by name."""
        capsule = value.capsule
        ends = {"start": VECTOR.write(capsule.start), "end": VECTOR.write(capsule.end)}
        return super().from_domain(value, **ends, radius=LENGTH.write(capsule.radius), **given)


def mount_faults(mounts: Sequence[MountAxisModel], frames: Collection[str]) -> Iterator[Fault]:
    """Yield the mounts with a frame that is not in ``frames``, or with a wrong axis."""
    for i, mount in enumerate(mounts):
        if mount.frame not in frames:
            yield ("mounts", i, "frame"), mount.frame, ", ".join(frames)
        for key in ("axis", "zero"):
            if not is_unit(getattr(mount, key)):
                yield ("mounts", i, key), f"{getattr(mount, key)}", "a vector of length 1"
        if abs(sum(a * b for a, b in zip(mount.axis, mount.zero, strict=True))) > TOLERANCE:
            yield ("mounts", i, "zero"), f"{mount.zero}", "a vector perpendicular to axis"
        if mount.usable[0] >= mount.usable[1]:
            yield ("mounts", i, "usable"), f"{mount.usable}", "the lower value first"
