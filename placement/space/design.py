"""Design vectors of a search, and the setups that they encode."""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from ...coverage.detection.detection import Detection
from ...coverage.rings.ring import Setup, ring_values
from ...coverage.rings.ring_kinematics import ring_arrays
from ...coverage.rings.rounding import rounded
from ...objectives.link_segments import Segment
from ...objectives.parameterization import Interval, SetupArrays, decode, encode, stretch
from .feasible_set import FeasibleSet


@dataclass(frozen=True)
class Candidate:
    """A design vector with R places for rings."""

    segment: Int[np.ndarray, " R"]
    """Number of each ring's segment; -1 for a place without a ring."""
    count: Int[np.ndarray, " R"]
    """Sensors of each ring."""
    values: Float[np.ndarray, "3 R"]
    """Place along the segment, tilt and phase, as ``decode`` reads them."""
    sign: Float[np.ndarray, " R"]
    """Sign of each ring's tilt, where all rings share its size."""

    @property
    def rings(self) -> Int[np.ndarray, " N"]:
        """Indices of the places that hold a ring."""
        return np.flatnonzero(self.segment >= 0)


class Space(FeasibleSet):
    """All setups that satisfy a scene's rules, with the links and counts of a layout, or with a
    number of sensors in any rings or in a number of rings."""

    def holds(self, c: Candidate) -> bool:
        """Return whether the boards of all rings fit."""
        return all(
            self.tilts(self.segments[c.segment[i]].link, int(c.count[i])) is not None
            for i in c.rings
        )

    def apart(self, c: Candidate, places: Float[np.ndarray, "3 R"] | None = None) -> bool:
        """Return whether no rings of different links collide at any pose; ``places``: what
        ``decode`` makes of the candidate."""
        if self.collisions is None:
            return True
        if places is None:
            places = decode(self.stretch(c), self.values(c))
        i = c.rings
        return (
            not self.collisions.possible(self.link_of[c.segment[i]], places[0, i])
            or self.collision(c) is None
        )

    def collision(self, c: Candidate) -> str | None:
        """Return a collision of rings of different links, as text; None without one."""
        if self.collisions is None:
            return None
        return self.collisions.among(rounded(self.setup(c), self.scene.sensor).rings)

    def box(self, c: Candidate) -> tuple[Float[np.ndarray, "3 R"], Float[np.ndarray, "3 R"]]:
        """Return the lower and upper bounds of all values of a candidate; they are equal where
        nothing is free."""
        low, high = np.zeros((2, 3, self.places + len(self.held)))
        for i in c.rings:
            low[:, i], high[:, i] = self.limits(c.segment[i], c.count[i])
        if self.scene.rules.shared_tilt and len(c.rings):
            tilts = low[1, c.rings].max(), high[1, c.rings].min()
            low[1], high[1] = 0.0, 0.0
            low[1, 0], high[1, 0] = tilts
        return low, high

    def stretch(self, c: Candidate) -> Interval:
        """Return the intervals in which a candidate's rings may sit, and then the places of what
        stays."""
        shared = (
            np.concatenate([c.sign, np.ones(len(self.held))])
            if self.scene.rules.shared_tilt
            else None
        )
        which = np.concatenate([c.segment, np.full(len(self.held), -1)])
        where = stretch(self.segments, which, shared)
        stays = range(len(c.segment), len(c.segment) + len(self.held))
        where.hold(stays, ring_values(self.held).position.tolist())
        where.tilt_of[stays] = stays  # what stays keeps its tilt
        return where

    def arrays(self, c: Candidate, detection: Detection | None = None) -> SetupArrays:
        """Return the arrays of a candidate for the objective, with what its sensors need for a
        detection, if any; all candidates have the same shape."""
        links = [self.segments[i].link if i >= 0 else self.scene.robot.links[0] for i in c.segment]
        rings = [self.ring(link, int(n)) for link, n in zip(links, c.count, strict=True)]
        sensors = self.sensors + len(self.scene.standing)
        every = (*rings, *self.held)
        arrays = ring_arrays(self.scene.robot, every, sensors, self.possible, detection)
        return arrays, self.stretch(c)

    def values(self, c: Candidate) -> Float[np.ndarray, "3 R"]:
        """Return the values of a candidate's rings and of what stays."""
        stays = ring_values(self.held)
        held = np.stack([np.zeros(len(self.held)), stays.tilt, stays.phase])
        return np.concatenate([c.values, held], axis=1)

    def moved(self, c: Candidate, values: Float[np.ndarray, "3 R"]) -> Candidate:
        """Return a candidate with other positions, tilts and phases of its rings."""
        where, new = self.stretch(c), c.values.copy()
        new[1:, c.rings] = values[1:, c.rings]
        if self.scene.rules.shared_tilt and len(c.rings):
            new[1] = (where.sign * values[1])[c.rings[0]]
        there = replace(c, values=new)
        along = encode(where, self.values(there), values[0])
        return replace(c, values=np.concatenate([along[None, : len(c.segment)], new[1:]]))

    def setup(self, c: Candidate) -> Setup:
        """Return the setup that a candidate encodes.

        Each phase is in [0, spacing), the rings of a link are ordered from proximal to distal, and
        fixed rings and single sensors stay as they are.
        """
        position, tilt, phase = decode(self.stretch(c), self.values(c))
        rings = [
            replace(
                self.ring(self.segments[c.segment[i]].link, int(c.count[i])),
                position=float(np.clip(position[i], 0, 1)),
                tilt=float(tilt[i]),
                phase=float(phase[i] % (2 * math.pi / c.count[i])),
            )
            for i in c.rings
        ]
        order = self.scene.robot.links
        every = sorted([*rings, *self.fixed], key=lambda r: (order.index(r.link), r.position))
        return Setup(tuple(every), self.scene.rules.fixed_sensors)

    def candidate(self, setup: Setup) -> Candidate | None:
        """Return the candidate nearest to a setup's free rings; None if the rules leave no place
        for them."""
        segment, count, values = (
            np.full(self.places, -1),
            np.zeros(self.places, int),
            np.zeros((3, self.places)),
        )
        rings = [ring for ring in setup.rings if ring not in self.fixed]
        if len(rings) > self.places or sum(r.count for r in rings) > self.free:
            return None
        if self.rings is not None and len(rings) < self.rings:
            return None
        for i, ring in enumerate(rings):
            free = self.room(segment.tolist(), ring.link, ring.count)
            if not free:
                return None
            segment[i] = min(free, key=lambda j: _off(self.segments[j], ring.position))
            count[i], values[:, i] = ring.count, (ring.position, ring.tilt, ring.phase)
        sign = np.where(values[1] < 0, -1.0, 1.0)
        if self.scene.rules.shared_tilt:
            values[1] = np.abs(values[1]).mean()
        c = Candidate(segment, count, values, sign)
        low, high = (edge[:, : self.places] for edge in self.box(c))
        values[1:] = np.clip(values[1:], low[1:], high[1:])
        position = np.concatenate([values[0], ring_values(self.held).position])
        along = encode(self.stretch(c), self.values(c), position)[: self.places]
        values[0] = np.clip(along, low[0], high[0])
        return c


def _off(s: Segment, position: float) -> float:
    return max(s.low - position, position - s.high, 0.0)
