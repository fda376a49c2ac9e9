"""Edits of a setup: each edit returns a new, complete setup."""

import itertools
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ..coverage.rings.mounted_sensor import MountedSensor
from ..coverage.rings.ring import Ring, Setup
from ..coverage.rings.rounding import rounded
from ..objectives.scene import Scene

MOST_RINGS, MOST_SENSORS = 64, 64  # rings of an edited setup, sensors of an edited ring
NEW_COUNT = 8  # sensors of a new ring where no other ring has some
STEEPEST_DEG = 85.0


@dataclass(frozen=True)
class StatedRing:
    """What a page may change of a ring."""

    link: str
    """Name of its link."""
    position: float
    """Position in [0, 1] along the link's mount axis."""
    count: int
    """Number of sensors."""
    tilt_deg: float
    """Tilt, degrees."""
    phase_deg: float
    """Phase, degrees."""


@dataclass(frozen=True)
class EditedSetup:
    """A setup in a scene that can be edited ring by ring; values are clamped to their bounds."""

    scene: Scene
    setup: Setup

    def _with(self, rings: Sequence[Ring]) -> "EditedSetup":
        return replace(
            self, setup=rounded(replace(self.setup, rings=tuple(rings)), self.scene.sensor)
        )

    def most(self, i: int) -> int:
        """Return the largest count of ring ``i``: the limit for edits, or its present count if
        larger; 1 for a single sensor.
        """
        group = self.setup.groups[i]
        return max(MOST_SENSORS, group.count) if isinstance(group, Ring) else 1

    def moved(self, i: int, **pose: float) -> "EditedSetup":
        """Return the setup with single sensor ``i`` elsewhere on its link.

        Args:
            i: number of the single sensor; those of the rings come first.
            pose: new values of the fields of ``SinglePose``; the others stay.

        Raises:
            ValueError: for a number that is not finite or too large.
            IndexError: if there is no such single sensor.
        """
        singles, k = list(self.setup.singles), i - len(self.setup.rings)
        if k < 0:
            raise IndexError(f"number {i} is a ring")
        singles[k] = replace(SinglePose.of(singles[k]), **pose).placed(singles[k])
        setup = replace(self.setup, singles=tuple(singles))
        return replace(self, setup=rounded(setup, self.scene.sensor))

    def changed(
        self,
        i: int,
        link: str | None = None,
        position: float | None = None,
        tilt_deg: float | None = None,
        phase_deg: float | None = None,
        count: int | None = None,
    ) -> "EditedSetup":
        """Return the setup with ring ``i`` changed; None leaves a value as it is.

        A ring that moves to another link gets the sensor and the radius of that link.

        Args:
            i: index of the ring.
            link: new link.
            position: new position in [0, 1] along the link's mount axis.
            tilt_deg: new tilt, degrees.
            phase_deg: new phase, degrees.
            count: new number of sensors.

        Raises:
            ValueError: for a link that the robot does not have, or a number that is not finite.
            IndexError: if there is no such ring.
        """
        ring = self.setup.rings[i]
        if not all(
            math.isfinite(v) for v in (position, tilt_deg, phase_deg, count) if v is not None
        ):
            raise ValueError("numbers must be finite")
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

    def arranged(self, rings: Sequence[StatedRing]) -> "EditedSetup":
        """Return the setup with other rings; single sensors stay.

        A ring that stays on its link keeps its sensor and radius.

        Raises:
            ValueError: for no ring and no single sensor, for more rings than ``MOST_RINGS``, or as
                ``changed`` does.
        """
        if len(rings) > MOST_RINGS or not (rings or self.setup.singles):
            raise ValueError(f"found {len(rings)} rings, allowed: 1 to {MOST_RINGS}")
        old = dict(enumerate(self.setup.rings))
        kept = [
            old[i] if i in old and old[i].link == r.link else self._ring(r.link, 1)
            for i, r in enumerate(rings)
        ]
        draft = self._with(kept)
        for i, r in enumerate(rings):
            draft = draft.changed(i, None, r.position, r.tilt_deg, r.phase_deg, r.count)
        return draft

    def _ring(self, link: str, count: int) -> Ring:
        """Return a new ring on ``link`` with the radius of the rings there."""
        self.scene.robot.mount(link)
        radius = next(
            (r.radius for r in self.setup.rings if r.link == link), self.scene.radius_of(link)
        )
        return Ring(link, 0.0, count, 0.0, 0.0, radius, self.scene.sensor_of(link))

    def added(self, link: str) -> "EditedSetup":
        """Return the setup with one more ring in the middle of the widest gap on ``link``.

        It has the most frequent number of sensors; 8 if there is no other ring.

        Raises:
            ValueError: if the link does not exist or has no room for a ring.
        """
        there = sorted(r.position for r in self.setup.rings if r.link == link)
        length = self.scene.robot.mount(link).length
        if len(self.setup.rings) >= MOST_RINGS:
            raise ValueError(
                f"there are {len(self.setup.rings)} rings already; at most {MOST_RINGS} are allowed"
            )
        if length == 0 and there:
            raise ValueError("this link has room for one ring only")
        counts = Counter(r.count for r in self.setup.rings).most_common(1)
        count = counts[0][0] if counts else NEW_COUNT
        low, high = self.scene.limits_of(link).position
        places = [low, *(p for p in there if low <= p <= high), high]
        ends = [(b - a, (a + b) / 2) for a, b in itertools.pairwise(places)]
        place = max(ends)[1] if there else (low + high) / 2
        ring = replace(self._ring(link, count), position=place if length > 0 else 0.0)
        return self._with([*self.setup.rings, ring])

    def removed(self, i: int) -> "EditedSetup":
        """Return the setup without ring or single sensor ``i``.

        Raises:
            ValueError: for the last one.
            IndexError: if there is no such ring or sensor.
        """
        rings, singles = list(self.setup.rings), list(self.setup.singles)
        if len(rings) + len(singles) == 1:
            last = "ring" if rings else "sensor"
            raise ValueError(f"the last {last} cannot be removed")
        if i < len(rings):
            del rings[i]
        else:
            del singles[i - len(rings)]
        return replace(self, setup=replace(self.setup, singles=tuple(singles)))._with(rings)


FARTHEST = 5.0  # m, of each coordinate
_DIGITS, _DIGITS_POSITION = 9, 6


@dataclass(frozen=True)
class SinglePose:
    """Where a single sensor sits on its link, and how it is turned, in the link's frame."""

    x: float
    """Position along x, m."""
    y: float
    """Position along y, m."""
    z: float
    """Position along z, m."""
    azimuth_deg: float
    """Angle of the beam's axis from +x towards +y, degrees; 0 along z."""
    elevation_deg: float
    """Angle of the beam's axis from the plane of x and y towards +z, degrees."""
    roll_deg: float
    """Rotation about the beam's axis, right-handed, degrees; 0: ``up`` points towards greater
    elevation. 0 for a round beam."""

    @staticmethod
    def of(one: MountedSensor) -> "SinglePose":
        """Return the pose of a sensor."""
        look, up = one.T_link_sensor[:3, 2], one.T_link_sensor[:3, 1]
        level = math.hypot(look[0], look[1])
        azimuth = math.atan2(look[1], look[0]) if level > 1e-9 else 0.0
        elevation = math.atan2(look[2], level)
        above, side = _across(azimuth, elevation)
        roll = math.atan2(up @ side, up @ above) if one.up is not None else 0.0
        angles = (round(math.degrees(a), 6) + 0.0 for a in (azimuth, elevation, roll))
        return SinglePose(*one.position, *angles)

    def placed(self, one: MountedSensor) -> MountedSensor:
        """Return ``one`` at this pose.

        Raises:
            ValueError: if a number is not finite or a coordinate exceeds ``FARTHEST``.
        """
        at = (self.x, self.y, self.z)
        angles = (self.azimuth_deg, self.elevation_deg, self.roll_deg)
        if not all(map(math.isfinite, (*at, *angles))):
            raise ValueError("numbers must be finite")
        if max(map(abs, at)) > FARTHEST:
            raise ValueError(f"a coordinate must be at most {FARTHEST:g} m")
        x, y, z = (round(v, _DIGITS_POSITION) + 0.0 for v in at)
        before = SinglePose.of(one)
        # a sensor that moves is no longer where it was lifted
        there = replace(one, position=(x, y, z), lifted=one.lifted if self == before else 0.0)
        if replace(before, x=self.x, y=self.y, z=self.z) == self:
            return there  # turned as before, without another rounding
        azimuth, roll = math.radians(self.azimuth_deg), math.radians(self.roll_deg)
        elevation = math.radians(min(max(self.elevation_deg, -90.0), 90.0))
        above, side = _across(azimuth, elevation)
        level = math.cos(elevation)
        look = (level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation))
        up = None if one.up is None else _three(math.cos(roll) * above + math.sin(roll) * side)
        return replace(there, direction=_three(np.array(look)), up=up)


def _across(
    azimuth: float, elevation: float
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Return the two directions across a beam at roll 0: ``up``, and where it turns to."""
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    return np.array([-se * ca, -se * sa, ce]), np.array([sa, -ca, 0.0])


def _three(v: Float[np.ndarray, " 3"]) -> tuple[float, float, float]:
    x, y, z = (round(float(a), _DIGITS) + 0.0 for a in v)
    return x, y, z
