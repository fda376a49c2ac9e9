"""Records of the largest objects about the places of a target that no sensor sees."""

import math
from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field

from ..coverage.definitions.definition import definition
from ..coverage.definitions.field_types import Items, Metres
from ..coverage.definitions.units import Millimetres
from ..coverage.voxels.largest_object import LargestObject

Verdict = Literal["pass", "fail", "not known"]
MOST = 1.0
"""Diameter above which objects are not told apart, m: a crouching person is smaller."""


@definition(kw_only=True)
class ObjectBounds:
    """Bounds of the diameter of the largest unseen object of a shape."""

    low: Annotated[float, Millimetres("low_mm")]
    """Diameter of an unseen object that was found, m; 0: none, 1 m: that or more."""
    high: Annotated[float, Millimetres("high_mm")]
    """Diameter above which no object is unseen, m: proved, but 1 m stands for that or more."""
    pose: Annotated[int, Field(ge=0)]
    """The pose of the found object."""
    centre: Items[float] | None = None
    """Centre of the found object, m; none without one."""

    @property
    def open(self) -> bool:
        """Whether the object may have any size from ``low`` on."""
        return self.high >= MOST

    @property
    def text(self) -> str:
        """The interval of the diameter, rounded outward to tenths of mm."""
        low, high = math.floor(1e4 * self.low) / 10, math.ceil(1e4 * self.high) / 10
        return f"{low:.1f} mm or more" if self.open else f"{low:.1f} to {high:.1f} mm"

    @staticmethod
    def of(largest: LargestObject, pose: int) -> "ObjectBounds":
        """Return the record of a pose's largest object."""
        place = None if largest.centre is None else tuple(map(float, largest.centre))
        return ObjectBounds(low=2 * largest.low, high=2 * largest.high, pose=pose, centre=place)

    @staticmethod
    def worst(poses: "Sequence[ObjectBounds]") -> "ObjectBounds":
        """Return the bounds of the largest object over several poses."""
        largest = max(poses, key=lambda one: one.low)
        high = max(one.high for one in poses)
        return ObjectBounds(low=largest.low, high=high, pose=largest.pose, centre=largest.centre)


@definition(kw_only=True)
class SmallestObject:
    """The largest objects about the places of a target that no sensor sees, over all poses."""

    sphere: ObjectBounds
    """The largest unseen sphere at the worst pose."""
    rod: ObjectBounds
    """The largest unseen vertical rod at the worst pose."""
    rod_length: Metres
    """Length of the rod, m."""
    largest_gap: Annotated[float, Millimetres("largest_gap_mm")] | None = None
    """The target's largest allowed diameter of an unseen sphere, m."""
    verdict: Verdict | None = None
    """Whether that is kept; ``not known``: the bounds contain it."""
    zones_per_m3: float
    """Point density, a mean over the poses: zones of which the centre ray has an unoccluded part in
    the target, so that they can yield a point there in each frame, per volume of the target."""
    spheres: Items[ObjectBounds]
    """The largest unseen sphere at each pose."""
    rods: Items[ObjectBounds]
    """The largest unseen rod at each pose."""
    seconds: Annotated[float, Field(ge=0)]
    """Duration of the work, s."""


def verdict_of(sphere: ObjectBounds, largest_gap: float | None) -> Verdict | None:
    """Return whether no unseen sphere is larger than the largest allowed one, of a diameter in m;
    None without one."""
    if largest_gap is None:
        return None
    if sphere.high <= largest_gap:
        return "pass"
    return "fail" if sphere.low > largest_gap else "not known"
