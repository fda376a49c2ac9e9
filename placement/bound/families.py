"""All rings that the rules of a scene allow, by link, and what a budget may choose from them."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...coverage.robots.kinematics import forward
from ...coverage.robots.robot import Mount
from ...coverage.sensors.sensor import Sensor
from ...objectives.link_segments import HIGH, LOW, Segment, most_rings, segments
from ..space.design import Space


@dataclass(frozen=True)
class Family:
    """All rings that a scene's rules allow on one link."""

    mount: Mount
    """The link's mount."""
    T_base_link: Float[np.ndarray, "4 4"]
    """Frame of the link, m."""
    radius: float
    """Radius of the rings, m."""
    sensor: Sensor
    """Sensor of the rings."""
    positions: tuple[tuple[float, float], ...]
    """Intervals of position, in [0, 1], outside which no ring may sit."""
    tilts: dict[int, tuple[float, float]]
    """Lowest and highest tilt, rad, of a ring of each number of sensors."""
    rings: int
    """Most rings on the link."""

    @property
    def tilt(self) -> tuple[float, float]:
        """Lowest and highest tilt of any ring, rad."""
        low, high = zip(*self.tilts.values(), strict=True)
        return min(low), max(high)

    @property
    def counts(self) -> tuple[int, ...]:
        """Numbers of sensors that a ring may have, ascending."""
        return tuple(sorted(self.tilts))

    def beams(
        self, position: float, tilt: float, azimuth: Float[np.ndarray, " A"]
    ) -> tuple[Float[np.ndarray, "A 3"], Float[np.ndarray, "A 3"]]:
        """Return apexes m and axes of sensors at one place of a ring, base frame."""
        m, R = self.mount, self.T_base_link[:3, :3]
        radial = np.cos(azimuth)[:, None] * m.zero + np.sin(azimuth)[:, None] * m.side
        apex = m.start + position * m.length * m.axis + self.radius * radial
        look = math.cos(tilt) * radial + math.sin(tilt) * m.axis
        return apex @ R.T + self.T_base_link[:3, 3], look @ R.T


def _merged(some: list[Segment]) -> tuple[tuple[float, float], ...]:
    """Return the intervals of position that any tilt allows on some segments, overlaps joined."""
    ends = sorted((float(s.by_tilt[LOW].min()), float(s.by_tilt[HIGH].max())) for s in some)
    merged: list[tuple[float, float]] = []
    for low, high in ends:
        low, high = min(max(low, 0.0), 1.0), min(max(high, 0.0), 1.0)
        if merged and low <= merged[-1][1]:
            merged[-1] = merged[-1][0], max(merged[-1][1], high)
        else:
            merged.append((low, high))
    return tuple(merged)


def families(space: Space, pose: int) -> tuple[Family, ...]:
    """Return the families of a design space at a pose of its scene.

    They hold every setup of the space, and more. The spacing of rings is dropped, but not the
    number of rings that it leaves room for. The bodies of real rings do not narrow their positions:
    a search keeps rings within tables of the room for bodies, which are on the safe side, and a
    ring that is placed by hand may pass the exact check where no table allows it.
    """
    scene = space.scene
    allowed = segments(scene)
    frames = np.asarray(forward(scene.robot.chain, scene.poses[pose].q))
    each, layout = [], space.layout
    for mount in scene.robot.mounts:
        some = [s for s in allowed if s.link == mount.link]
        if not some:
            continue
        if layout is None:
            counts = list(range(space.least, space.most_on(mount.link) + 1))
            standing = sum(r.link == mount.link for r in space.fixed)
            room = max(scene.rules.max_rings_per_link - standing, 0)
            rings = most_rings(allowed, mount.link, room)
        else:
            mine = [r.count for r in layout.rings if r.link == mount.link]
            counts, rings = sorted(set(mine)), len(mine)
        tilts = {n: t for n in counts if (t := space.tilts(mount.link, n)) is not None}
        if rings and tilts:
            ring, at = space.ring(mount.link, max(tilts)), frames[mount.frame]
            each.append(Family(mount, at, ring.radius, ring.sensor, _merged(some), tilts, rings))
    return tuple(each)


@dataclass(frozen=True)
class Budget:
    """What a layout may consist of: rings of the families within a number of sensors, or given
    rings."""

    rings: tuple[int, ...]
    """Most rings of each family."""
    counts: tuple[tuple[int, ...], ...]
    """Numbers of sensors of a family's rings, ascending."""
    sensors: int
    """Most sensors."""
    total: int | None = None
    """Most rings; None: only the families limit them."""
    layout: tuple[tuple[int, int], ...] | None = None
    """Family and number of sensors of each ring of a given layout; None: any rings."""

    @staticmethod
    def of(space: Space, some: tuple[Family, ...]) -> "Budget":
        """Return the budget of a design space; ``some`` are its families."""
        rings, counts = tuple(f.rings for f in some), tuple(f.counts for f in some)
        layout = None
        if space.layout is not None:
            links = [f.mount.link for f in some]
            layout = tuple((links.index(r.link), r.count) for r in space.layout.rings)
        return Budget(rings, counts, space.free, space.rings, layout)

    def best(self, values: list[Float[np.ndarray, " _"]]) -> tuple[float, list[tuple[int, int]]]:
        """Return the largest sum of the values of allowed rings, and these rings.

        It is a knapsack problem over the numbers of sensors, solved exactly by dynamic programming
        over the slots for rings.

        Args:
            values: value of a ring of each number of sensors (``counts``), for each family.

        Returns:
            The largest sum; family and index of the number of sensors of each ring.
        """
        if self.layout is not None:
            at = [(f, self.counts[f].index(n)) for f, n in self.layout]
            return float(sum(values[f][i] for f, i in at)), at
        best, taken = self._knapsack(values)
        r, s = np.unravel_index(int(best.argmax()), best.shape)
        value, chosen = float(best[r, s]), []
        for f, choice in reversed(taken):
            if (i := int(choice[r, s])) >= 0:
                chosen.append((f, i))
                s -= self.counts[f][i]
                r -= len(best) > 1
        return value, chosen

    def by_sensors(self, values: list[Float[np.ndarray, " _"]]) -> Float[np.ndarray, " N"]:
        """Return the largest sum for at most n sensors, for each n from 0; of a given layout only
        that of the whole."""
        if self.layout is not None:
            return np.array([self.best(values)[0]])
        most: np.ndarray = self._knapsack(values)[0].max(axis=0)
        return most

    def _knapsack(
        self, values: list[Float[np.ndarray, " _"]]
    ) -> tuple[Float[np.ndarray, "R N"], list[tuple[int, Int[np.ndarray, "R N"]]]]:
        """Return the value of at most r rings (any number, if none is limited) and s sensors, and
        for each slot its family and the index of the size that it takes there."""
        n, some = self.sensors, range(len(self.rings))
        slots = [f for f in some for _ in range(min(self.rings[f], n // self.counts[f][0]))]
        total = len(slots) if self.total is None else min(self.total, len(slots))
        limited = total < len(slots)
        best = np.zeros((total + 1 if limited else 1, n + 1))
        taken = []
        for f in slots:
            more, choice = best.copy(), np.full(best.shape, -1)
            for i, count in enumerate(self.counts[f]):
                if count > n:
                    break
                before = best[:-1, : n + 1 - count] if limited else best[:, : n + 1 - count]
                to = (slice(1, None) if limited else slice(None), slice(count, None))
                better = before + values[f][i] > more[to]
                more[to][better] = (before + values[f][i])[better]
                choice[to][better] = i
            best = more
            taken.append((f, choice))
        return best, taken
