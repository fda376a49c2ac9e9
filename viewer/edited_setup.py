"""A setup that is being changed: every change gives another whole setup, as a proposal's file would
hold it.
"""

import itertools
import math
from collections import Counter
from dataclasses import dataclass, replace

from ..coverage.rings.ring import Ring, Setup
from ..coverage.rings.rounding import rounded
from ..objectives.scene import Scene

MOST_RINGS, MOST_SENSORS = 50, 64  # of a setup that is changed by hand, and of one of its rings
STEEPEST_DEG = 85.0


@dataclass(frozen=True)
class EditedSetup:
    """A setup of a scene that can be changed ring by ring; what is out of bounds is brought to the
    nearest bound.
    """

    scene: Scene
    setup: Setup

    def _with(self, rings: list[Ring]) -> "EditedSetup":
        return replace(self, setup=rounded(Setup(tuple(rings)), self.scene.sensor))

    def most(self, i: int) -> int:
        """Sensors that ring ``i`` may have: those it has, where they are more than are given by
        hand.
        """
        return max(MOST_SENSORS, self.setup.rings[i].count)

    def changed(
        self,
        i: int,
        link: str | None = None,
        position: float | None = None,
        tilt_deg: float | None = None,
        phase_deg: float | None = None,
        count: int | None = None,
    ) -> "EditedSetup":
        """Ring ``i`` changed in what is given. One that goes to another link takes the sensor and
        the radius of that link.

        Raises:
            ValueError: for a link that the robot has not, or a number that is not finite.
            IndexError: for a ring that is not there.
        """
        ring = self.setup.rings[i]
        if not all(
            math.isfinite(v) for v in (position, tilt_deg, phase_deg, count) if v is not None
        ):
            raise ValueError("found a number that is not finite, allowed: finite ones")
        if link is not None and link != ring.link:
            ring = replace(
                self._ring(link, ring.count),
                tilt=ring.tilt,
                phase=ring.phase,
                position=ring.position,
            )
        length = self.scene.robot.mount(ring.link).length
        if position is not None:
            ring = replace(ring, position=min(max(position, 0.0), 1.0))
        if tilt_deg is not None:
            ring = replace(ring, tilt=math.radians(min(max(tilt_deg, -STEEPEST_DEG), STEEPEST_DEG)))
        if phase_deg is not None:
            ring = replace(ring, phase=math.radians(math.fmod(phase_deg, 360.0)))
        if count is not None:
            ring = replace(ring, count=min(max(int(count), 1), self.most(i)))
        ring = ring if length > 0 else replace(ring, position=0.0)
        return self._with([*self.setup.rings[:i], ring, *self.setup.rings[i + 1 :]])

    def _ring(self, link: str, count: int) -> Ring:
        """A new ring on ``link``: with the radius of those that are there."""
        self.scene.robot.mount(link)
        radius = next(
            (r.radius for r in self.setup.rings if r.link == link), self.scene.radius_of(link)
        )
        return Ring(link, 0.0, count, 0.0, 0.0, radius, self.scene.sensor_of(link))

    def added(self, link: str) -> "EditedSetup":
        """One ring more, in the middle of the widest free stretch of ``link``, with as many sensors
        as most rings have.

        Raises:
            ValueError: where there is no room for one, or no such link.
        """
        there = sorted(r.position for r in self.setup.rings if r.link == link)
        length = self.scene.robot.mount(link).length
        if len(self.setup.rings) >= MOST_RINGS:
            raise ValueError(
                f"there are {len(self.setup.rings)} rings, allowed: {MOST_RINGS} at most"
            )
        if length == 0 and there:
            raise ValueError("there is room for one ring only on this link")
        count = Counter(r.count for r in self.setup.rings).most_common(1)[0][0]
        low, high = self.scene.limits_of(link).position
        places = [low, *(p for p in there if low <= p <= high), high]
        ends = [(b - a, (a + b) / 2) for a, b in itertools.pairwise(places)]
        place = max(ends)[1] if there else (low + high) / 2
        ring = replace(self._ring(link, count), position=place if length > 0 else 0.0)
        return self._with([*self.setup.rings, ring])

    def removed(self, i: int) -> "EditedSetup":
        """Without ring ``i``. ValueError for the last one; IndexError for one that is not there."""
        rings = list(self.setup.rings)
        if len(rings) == 1:
            raise ValueError("the last ring stays")
        del rings[i]
        return self._with(rings)
