"""What a page shows of a setup: pose, target, selection, cones and classes of points."""

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.targets.target import Target
from .colours import KINDS

BEHIND, NONE = "behind the robot", "none"
_AXES = {"x: front": (1.0, 0.0, 0.0), "y: side": (0.0, -1.0, 0.0), "z: top": (0.0, 0.0, 1.0)}
CUTS = (BEHIND, NONE, *_AXES)
_UPRIGHT = 0.05  # m, reach of an arm that has no direction
_STEEP = math.radians(60)  # elevation of the camera above which that cut is level


@dataclass(frozen=True)
class Cut:
    """The half-space on the far side of a plane."""

    normal: tuple[float, float, float]
    """Unit normal of the plane, towards the side that is cut away."""
    offset: float
    """Distance of the plane from the base along the normal, m."""

    def keeps(self, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """Return for each point (N, 3) m whether it is shown."""
        kept: np.ndarray = points @ np.array(self.normal) <= self.offset
        return kept


def facing(
    direction: Float[np.ndarray, " 3"], curve: Float[np.ndarray, "N 3"]
) -> tuple[float, float, float]:
    """Return the normal of the plane through the robot that faces a camera best.

    The plane is level, or upright and along the arm or across it.

    Args:
        direction: from the scene to the camera.
        curve: points (N, 3) m along the robot's centre line, from the base.
    """
    if math.atan2(abs(direction[2]), math.hypot(direction[0], direction[1])) > _STEEP:
        return 0.0, 0.0, math.copysign(1.0, direction[2])
    x, y = arm_direction(curve)
    normals = ((y, -x), (-y, x), (x, y), (-x, -y))
    best = max(normals, key=lambda n: n[0] * direction[0] + n[1] * direction[1])
    return round(best[0], 9) + 0.0, round(best[1], 9) + 0.0, 0.0


def arm_direction(curve: Float[np.ndarray, "N 3"]) -> tuple[float, float]:
    """Return the level direction, of length 1, from the base to the farthest point of the arm.

    It is x for an arm straight above its base.
    """
    away = curve[:, :2] - curve[0, :2]
    size = np.linalg.norm(away, axis=1)
    far = int(size.argmax())
    if size[far] < _UPRIGHT:
        return 1.0, 0.0
    return float(away[far, 0] / size[far]), float(away[far, 1] / size[far])


def cut_of(
    kind: str,
    offset: float,
    direction: Float[np.ndarray, " 3"],
    curve: Float[np.ndarray, "N 3"],
) -> Cut | None:
    """Return the cut that a page asks for.

    Args:
        kind: one of ``CUTS``.
        offset: distance of a plane across an axis from the base, along that axis, m.
        direction: from the scene to the camera.
        curve: points (N, 3) m along the robot's centre line, from the base.

    Raises:
        ValueError: for another kind, or an offset that is not finite.
    """
    if kind not in CUTS or not math.isfinite(offset):
        raise ValueError(f"cut: found {kind} at {offset:g} m, allowed: {', '.join(CUTS)}")
    if kind == NONE:
        return None
    if kind == BEHIND:
        normal = facing(direction, curve)
        along = curve @ np.array(normal)
        return Cut(normal, float(along.min() + along.max()) / 2)
    axis = _AXES[kind]
    return Cut(axis, offset * sum(axis))


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
