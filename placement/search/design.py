"""Candidates of a search: rings in the places there are for them, and the setups that they stand
for.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax
import numpy as np
from jaxtyping import Float, Int

from ...coverage.rings.ring import Setup
from ...coverage.rings.ring_kinematics import ring_arrays
from ...objectives.parameterization import Interval, Segment, SetupArrays, decode, encode, stretch
from .feasible_set import FeasibleSet


@dataclass(frozen=True)
class Candidate:
    """R places for rings: the segment of each (-1: no ring), its sensors, its values (3, R) as
    ``decode`` reads them, and the sign of its tilt where all share one."""

    segment: Int[np.ndarray, " R"]
    count: Int[np.ndarray, " R"]
    values: Float[np.ndarray, "3 R"]
    sign: Float[np.ndarray, " R"]

    @property
    def rings(self) -> Int[np.ndarray, " N"]:
        """The places that hold a ring."""
        return np.flatnonzero(self.segment >= 0)


class Space(FeasibleSet):
    """All setups that keep a scene's rules: with the links and counts of a layout, or with so many
    sensors in any rings.
    """

    def holds(self, c: Candidate) -> bool:
        """Do the boards of all rings fit?"""
        return all(
            self.tilts(self.segments[c.segment[i]].link, int(c.count[i])) is not None
            for i in c.rings
        )

    def box(self, c: Candidate) -> tuple[Float[np.ndarray, "3 R"], Float[np.ndarray, "3 R"]]:
        """Bounds of all values of a candidate, equal where there is nothing to choose."""
        low, high = np.zeros((2, 3, self.places + len(self.fixed)))
        for i in c.rings:
            low[:, i], high[:, i] = self.limits(c.segment[i], c.count[i])
        if self.scene.rules.shared_tilt and len(c.rings):
            tilts = low[1, c.rings].max(), high[1, c.rings].min()
            low[1], high[1] = 0.0, 0.0
            low[1, 0], high[1, 0] = tilts
        return low, high

    def stretch(self, c: Candidate) -> Interval:
        """Where a candidate's rings and the fixed ones may be."""
        shared = (
            np.concatenate([c.sign, np.ones(len(self.fixed))])
            if self.scene.rules.shared_tilt
            else None
        )
        which = np.concatenate([c.segment, np.full(len(self.fixed), -1)])
        where = stretch(self.segments, which, shared)
        if self.fixed:  # they stay, and keep their own tilts
            n = len(c.segment)
            where.low[n:] = [ring.position for ring in self.fixed]
            where.tilt_of[n:] = np.arange(n, n + len(self.fixed))
        return where

    def arrays(self, c: Candidate) -> SetupArrays:
        """A candidate for the objective; all candidates have one shape."""
        links = [self.segments[i].link if i >= 0 else self.scene.robot.links[0] for i in c.segment]
        rings = [self.ring(link, int(n)) for link, n in zip(links, c.count, strict=True)]
        return ring_arrays(
            self.scene.robot, (*rings, *self.fixed), self.sensors, self.square
        ), self.stretch(c)

    def values(self, c: Candidate) -> Float[np.ndarray, "3 R"]:
        """Values of a candidate's rings and of the fixed ones."""
        held = np.array([(0.0, ring.tilt, ring.phase) for ring in self.fixed]).reshape(-1, 3).T
        return np.concatenate([c.values, held], axis=1)

    def setup(self, c: Candidate) -> Setup:
        """The setup that a candidate stands for: each phase in [0, spacing), the rings of a link
        from proximal to distal, the fixed ones as they are."""
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
        return Setup(
            tuple(sorted([*rings, *self.fixed], key=lambda r: (order.index(r.link), r.position)))
        )

    def candidate(self, setup: Setup) -> Candidate | None:
        """The candidate nearest to a setup's free rings; None where the rules have no place for
        them.
        """
        segment, count, values = (
            np.full(self.places, -1),
            np.zeros(self.places, int),
            np.zeros((3, self.places)),
        )
        rings = [ring for ring in setup.rings if ring not in self.fixed]
        if len(rings) > self.places or sum(r.count for r in rings) > self.free:
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
        along = encode(
            self.stretch(c), np.concatenate([values[0], [r.position for r in self.fixed]])
        )
        values[0] = along[: self.places]
        low, high = self.box(c)
        return replace(c, values=np.clip(values, low[:, : self.places], high[:, : self.places]))


def _off(s: Segment, position: float) -> float:
    return max(s.low - position, position - s.high, 0.0)


def stacked(each: Sequence[SetupArrays]) -> SetupArrays:
    """Arrays of several candidates along a new first axis."""
    together: SetupArrays = jax.tree.map(lambda *a: np.stack(a), *each)
    return together
