"""Redesign problem: the setups that differ from a mounted one in a few touched rings, encoded for
local search and decoded.

The unchanged rings play the part of a scene's fixed rings in a search. They stay as they are, even
where they break rules; the touched rings must satisfy every rule against them.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Group, Ring, Setup, ring_values
from ...coverage.rings.ring_kinematics import RingArrays, ring_arrays
from ...coverage.rings.rounding import rounded
from ...objectives.feasibility.clearance import MountClearance
from ...objectives.feasibility.violations import ELECTRONICS, commonest_tilt, faults, held
from ...objectives.link_segments import Segment, fits, segments
from ...objectives.parameterization import Interval, SetupArrays, decode, encode, stretch
from ...objectives.scene import Scene
from .changes import Rings, Touched, turn

Values = Float[np.ndarray, "3 R"]


@dataclass(frozen=True)
class EncodedSetup:
    """A touched setup, encoded for the objective."""

    touched: Touched
    """The setup."""
    arrays: SetupArrays
    """Its ``(RingArrays, Interval)``."""
    low: Values
    """Lower bounds; equal to ``high`` except for touched rings."""
    high: Values
    """Upper bounds."""
    values: Values
    """Values as ``decode`` reads them."""

    @property
    def loose(self) -> bool:
        """Whether any value is free."""
        return bool(np.any(self.high > self.low))

    @property
    def decoded(self) -> Values:
        """Positions, tilts and phases."""
        return decode(self.arrays[1], self.values)

    def moved(self, values: Values) -> "EncodedSetup":
        """Return the setup with other positions, tilts and phases."""
        where, free = self.arrays[1], self.high > self.low
        new = np.where(free, values, self.values)
        rings = np.arange(len(where.tilt_of))
        for k in np.flatnonzero(free[1]):
            i = rings[where.tilt_of == k][0]
            new[1, k] = where.sign[i] * values[1, i]
        new[0] = np.where(free[0], encode(where, new, values[0]), self.values[0])
        return replace(self, values=new)


class RedesignProblem:
    """A mounted setup in a scene, with places for added rings and a number of additional
    sensors."""

    def __init__(self, scene: Scene, mounted: Setup, places: int, add_sensors: int = 0) -> None:
        """Round ``mounted`` as a file does, so that unchanged rings are identical before and after.

        Args:
            scene: robot, poses, goals, rules.
            mounted: the mounted setup.
            places: number of places for added rings.
            add_sensors: number of additional sensors.
        """
        self.scene = scene
        self.mounted = rounded(mounted, scene.sensor)
        self.before: Rings = (*self.mounted.rings, *(None,) * places)
        self.sensors = self.mounted.sensors + add_sensors
        self.still: tuple[Group, ...] = (*self.mounted.singles, *scene.cell_sensors)
        self.fixed, self._missing = held(scene, self.mounted.rings)
        self.clear = MountClearance(scene) if scene.real else None
        self.radii = {link: self._radius(link) for link in scene.robot.links}
        self._segments: dict[tuple[int, ...], list[Segment]] = {}

    @property
    def start(self) -> Touched:
        """The setup without changes."""
        return Touched(self.before, (), self.mounted.singles)

    def may_touch(self, t: Touched) -> list[int]:
        """Return the places that may be touched next: mounted rings that are not fixed, and one
        place for a new ring."""
        mounted = [
            i for i in range(len(self.mounted.rings)) if i not in self.fixed and i not in t.free
        ]
        more = [i for i in range(len(self.mounted.rings), len(self.before)) if i not in t.free]
        return mounted + more[:1]

    def _radius(self, link: str) -> float:
        """Return the radius of a new ring on ``link``, m: that of the rings there, or the scene's,
        enlarged where a real ring must close around the link."""
        there = next((ring.radius for ring in self.mounted.rings if ring.link == link), None)
        if self.clear is None:
            return self.scene.radius_of(link) if there is None else there
        if there is not None and there >= self.scene.least_radius(link):
            return there
        return self.clear.radius(link)

    def stays(self, free: tuple[int, ...]) -> list[Ring]:
        """Return the untouched rings and the scene's fixed rings, mounted or not."""
        there = [ring for i, ring in enumerate(self.before) if ring is not None and i not in free]
        return [*there, *self._missing]

    def segments(self, free: tuple[int, ...]) -> list[Segment]:
        """Return the segments on which the touched rings may sit."""
        if free not in self._segments:
            stay = self.stays(free)
            rules = replace(self.scene.rules, fixed=tuple(stay))
            rooms = self.clear.rooms(self.radii, stay) if self.clear is not None else None
            self._segments[free] = segments(replace(self.scene, rules=rules), rooms)
        return self._segments[free]

    def _seats(self, t: Touched) -> np.ndarray | None:
        """Return the nearest segment with room for each touched ring (R,), -1 for no ring; None if
        one has no room."""
        available, which = self.segments(t.free), np.full(len(t.rings), -1)
        links = [ring.link for ring in self.stays(t.free)]
        for i in t.free:
            ring = t.rings[i]
            if ring is None:
                continue
            room = [
                k
                for k, s in enumerate(available)
                if s.link == ring.link
                and np.count_nonzero(which == k) < s.room
                and fits(available, [*which.tolist(), k])
            ]
            if not room or links.count(ring.link) >= self.scene.rules.max_rings_per_link:
                return None
            at = ring.position
            which[i] = min(
                room, key=lambda k: max(available[k].low - at, at - available[k].high, 0.0)
            )
            links.append(ring.link)
        return which

    def _tilts(
        self,
        t: Touched,
        rings: list[int],
        where: Interval,
        low: Values,
        high: Values,
        values: Values,
    ) -> bool:
        """Set the bounds of the touched rings' tilts; return False if a shared tilt exceeds a
        link's limits."""
        old = {i: ring for i in rings if (ring := t.rings[i]) is not None}
        limits = {i: self.scene.limits_of(ring.link).tilt for i, ring in old.items()}
        if not self.scene.rules.shared_tilt:
            for i in rings:
                low[1, i], high[1, i] = limits[i]
            return True
        own = [
            ring
            for i, ring in enumerate(self.before)
            if ring is not None and i not in (*t.free, *self.fixed)
        ]
        signs = {i: math.copysign(1.0, ring.tilt) for i, ring in old.items()}
        if own:
            tilt = commonest_tilt(own)
            for i in rings:
                both = [
                    s * tilt
                    for s in (signs[i], -signs[i])
                    if limits[i][0] <= s * tilt <= limits[i][1]
                ]
                if not both:
                    return False
                low[1, i] = high[1, i] = both[0]
        elif rings:
            where.tilt_of[rings] = rings[0]
            where.sign[rings] = [signs[i] for i in rings]
            high[1, rings[0]] = min(min(-a, b) for a, b in limits.values())
            values[1, rings[0]] = abs(values[1, rings[0]])
        return bool(np.all(high[1] >= low[1]))

    def placed(self, t: Touched) -> EncodedSetup | None:
        """Encode a touched setup, with its touched rings moved to where the rules allow them.

        Returns:
            The encoded setup; None if a ring has no room or there are too many sensors.
        """
        which = self._seats(t)
        if which is None or t.sensors > self.sensors:
            return None
        rings, touched = self._rings(t), [i for i in t.free if t.rings[i] is not None]
        staying = [i for i in range(len(rings)) if i not in touched]
        which = np.concatenate([which, np.full(len(self.still), -1)])
        where, values = _where(self.segments(t.free), which, rings, staying), _values(rings)
        low, high = values.copy(), values.copy()
        low[:, touched] = high[:, touched] = 0.0
        if not self._tilts(t, touched, where, low, high, values):
            return None
        values[1] = np.clip(values[1], low[1], high[1])
        values[0] = encode(where, values, values[0])
        low[0, staying] = high[0, staying] = values[0, staying] = 0.0
        for i in touched:
            full = 2 * math.pi / rings[i].count
            high[0, i], low[2, i], high[2, i] = (
                float(where.loose[i]),
                values[2, i] - full,
                values[2, i] + full,
            )
        arrays = self._arrays(rings), where
        return EncodedSetup(t, arrays, low, high, np.clip(values, low, high))

    def as_it_stands(self, t: Touched) -> EncodedSetup:
        """Encode a touched setup with every ring where it is, whether the rules allow it or not."""
        rings, values = self._rings(t), _values(self._rings(t))
        values[0] = 0.0
        where = _where([], np.full(len(rings), -1), rings, list(range(len(rings))))
        return EncodedSetup(t, (self._arrays(rings), where), values, values, values)

    def _rings(self, t: Touched) -> list[Group]:
        """Return the ring at each place, and then the single sensors, which stay."""
        nothing = Ring(self.scene.robot.links[0], 0.0, 0)
        return [*(nothing if ring is None else ring for ring in t.rings), *self.still]

    def _arrays(self, rings: list[Group]) -> RingArrays:
        sensors = self.sensors + len(self.scene.cell_sensors)
        possible = (*self.scene.sensors, *(g.sensor for g in self.mounted.groups))
        return ring_arrays(self.scene.robot, tuple(rings), sensors, possible)

    def read(self, placed: EncodedSetup, values: Values) -> Touched:
        """Decode ``values`` to a touched setup; phases differ from the mounted ones as little as
        possible."""
        t = placed.touched
        position, tilt, phase = decode(placed.arrays[1], values)
        rings = list(t.rings)
        for i in t.free:
            ring, before = t.rings[i], self.before[i]
            if ring is not None:
                at = float(np.clip(position[i], 0, 1))
                ring = replace(ring, position=at, tilt=float(tilt[i]), phase=float(phase[i]))
                least = (
                    before.phase + turn(before, ring)
                    if before
                    else ring.phase % (2 * math.pi / ring.count)
                )
                rings[i] = replace(ring, phase=least)
        return replace(t, rings=tuple(rings))

    def put_back(self, t: Touched, places: tuple[int, ...], keys: tuple[str, ...]) -> Touched:
        """Restore the mounted values ``keys`` of the rings at ``places``.

        A ring on another link keeps its own values, except its count.
        """
        rings = list(t.rings)
        for i in places:
            ring, before = rings[i], self.before[i]
            if (
                ring is not None
                and before is not None
                and (ring.link == before.link or keys == ("count",))
            ):
                rings[i] = replace(ring, **{key: getattr(before, key) for key in keys})
        return replace(t, rings=tuple(rings))

    def rounded(self, t: Touched) -> Touched:
        """Return the setup rounded as in a file; a ring that equals the mounted one no longer
        counts as touched."""
        rings = tuple(
            None if r is None else rounded(Setup((r,)), self.scene.sensor).rings[0] for r in t.rings
        )
        free = tuple(i for i in t.free if rings[i] != self.before[i])
        return replace(t, rings=rings, free=free)

    def keeps_rules(self, t: Touched) -> bool:
        """Return whether the touched rings satisfy every rule against all rings; one whose sensor
        count is unchanged may keep that count."""
        places = [i for i, ring in enumerate(t.rings) if ring is not None]
        for fault in faults(self.scene, t.setup.rings, self.clear):
            concerned = {places[k] for k in fault.rings} & set(t.free)
            if fault.rule in ("sensors_per_ring", ELECTRONICS):
                concerned = {i for i in concerned if not _same_count(self.before[i], t.rings[i])}
            if concerned:
                return False
        return t.sensors <= self.sensors


def _where(
    available: list[Segment], which: np.ndarray, rings: list[Group], staying: list[int]
) -> Interval:
    where = stretch(available, which)
    where.hold(staying, ring_values(rings).position[staying].tolist())
    return where


def _values(rings: list[Group]) -> Values:
    v = ring_values(rings)
    return np.stack([v.position, v.tilt, v.phase])


def _same_count(before: Ring | None, after: Ring | None) -> bool:
    return before is not None and after is not None and before.count == after.count
