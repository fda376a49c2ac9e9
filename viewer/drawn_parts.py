"""What a page shows of a setup: pose, target, selection, cones and classes of points."""

from dataclasses import dataclass, field
from typing import Literal

from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.targets.target import Target
from .colours import KINDS
from .cut import Cut

Shown = Literal["off", "this ring", "this link", "all"]
SHOWN_CONES: tuple[Shown, ...] = ("off", "this ring", "this link", "all")


@dataclass(frozen=True)
class DrawnParts:
    """What a page shows."""

    pose: int
    """Index of the pose."""
    target: Target
    """Target whose points are shown."""
    occlusion: Occlusion
    """Model of occlusion."""
    cones: Shown = "this ring"
    """Rings whose cones are shown."""
    ring: int = 0
    """Index of the selected ring or single sensor; those follow the rings."""
    kinds: frozenset[int] = field(default_factory=lambda: frozenset(k.number for k in KINDS))
    """Classes of points that are shown."""
    cut: Cut | None = None
    """Half-space in which points are shown; None: everywhere."""
    sensor: int | None = None
    """Index of the selected sensor on the selected ring, or None."""
    outline: bool = True
    """True to show the target's outline."""
    robot: bool = True
    """True to show the robot."""
    faulty: frozenset[int] = frozenset()
    """Rings and single sensors that cannot be built, drawn in red."""


def shown_cones(setup: Setup, choice: DrawnParts) -> list[int]:
    """Return the indices of the rings and single sensors whose cones are shown."""
    link = setup.groups[choice.ring].link
    return [
        i
        for i, ring in enumerate(setup.groups)
        if choice.cones == "all"
        or (choice.cones == "this link" and ring.link == link)
        or (choice.cones == "this ring" and i == choice.ring)
    ]
