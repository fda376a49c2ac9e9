"""Common task of all searches: a clock, the objective of the peers, and the exact value of answers.

Peers see the rings of a layout as numbers in a unit box.
"""

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from place_rings.coverage.processors import processors
from place_rings.coverage.rings.ring import Setup
from place_rings.objectives.feasibility.mounting import meeting
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.scene import CoreScene
from place_rings.objectives.soft_objective import CoverageObjective
from place_rings.objectives.target_points import TargetPoints
from place_rings.objectives.verify import Verifier
from place_rings.placement.search.design import Candidate, Space, stacked

POINTS = 8192  # points of all goals and poses, on which candidates are evaluated
_BATCH = 16  # candidates between two checks of the clock
_BRIEF = 0.05, 0.02  # s, and share of the time, after which a replaced answer counts


class OverError(Exception):
    """The time is over."""


@dataclass(frozen=True)
class Shown:
    """A setup that was a search's best."""

    seconds: float
    """Processor time, s."""
    value: float
    """Value by which the search chose it."""
    setup: Setup
    """The setup."""


@dataclass
class Watch:
    """A search's clock of processor time, and the setups that were its best."""

    seconds: float
    """Processor time after which it is over, s."""
    began: float = field(default_factory=time.process_time)
    """Processor time of the start, s."""
    shown: list[Shown] = field(default_factory=list)
    """The setups."""

    @property
    def spent(self) -> float:
        """Processor time since the start, s."""
        return time.process_time() - self.began

    def show(self, value: float, make: Callable[[], Setup], always: bool = False) -> None:
        """Store a setup if it is in time and better than earlier ones, or if ``always``."""
        now = self.spent
        if now <= self.seconds and (always or not self.shown or value > self.shown[-1].value):
            self.shown.append(Shown(now, value, make()))

    def lasting(self) -> list[Shown]:
        """Return the setups without those that a better one replaced at once."""
        ends = [*(s.seconds for s in self.shown[1:]), math.inf]
        return [
            s
            for s, end in zip(self.shown, ends, strict=True)
            if end - s.seconds > max(_BRIEF[0], _BRIEF[1] * s.seconds)
        ]


class PeerObjective:
    """The objective of the peers.

    Candidates are ``size`` numbers in [0, 1]: position along the whole link, tilt and phase of each
    ring of a layout. Each ring is moved to the nearest place that the rules leave free, so peers
    search the feasible set of our search. The value is the exact share of training points that a
    candidate covers, compiled, on the processors of this process. low, high (3, R): values at 0
    and 1.
    """

    def __init__(
        self, scene: CoreScene, layout: Setup, seed: int, watch: Watch, points: int = POINTS
    ) -> None:
        """Draw the points and compile."""
        self.watch, self.space, self._rings = watch, Space(scene, layout), layout.rings
        drawn = TargetPoints(scene, max(points // (len(scene.goals) * len(scene.poses)), 64), seed)
        self._objective = CoverageObjective(scene, drawn)
        workers, every = processors(), drawn.points
        self._clouds = []
        for i in range(workers):  # every processor handles its own part of the points
            drawn.points = [p[: len(p) // workers * workers][i::workers] for p in every]
            self._clouds.append(drawn.clouds(len(drawn.points[0])))
        self._threads = ThreadPoolExecutor(workers)
        self.low, self.high = self._bounds(scene)
        self._free = self.high > self.low
        self.size = int(self._free.sum())
        start = self.candidate(np.full(self.size, 0.5))
        self._objective.zetas(
            stacked([self.space.arrays(start)]), start.values[None], self._clouds[0]
        )

    def _bounds(self, scene: CoreScene) -> tuple[Float[np.ndarray, "3 R"], ...]:
        edges = []
        for ring in self._rings:
            position = scene.limits_of(ring.link).position
            fixed = scene.robot.mount(ring.link).length == 0
            tilt = self.space.tilts(ring.link, ring.count) or (0.0, 0.0)
            edges.append(((0.0, 0.0) if fixed else position, tilt, (0.0, 2 * math.pi / ring.count)))
        low, high = np.array(edges).transpose(2, 1, 0)
        return low, high

    def candidate(self, x: Float[np.ndarray, " n"]) -> Candidate:
        """Return the nearest candidate that the rules of each link allow.

        Raises:
            RuntimeError: if the rules leave no place.
        """
        values = self.low.copy()
        values[self._free] += np.clip(x, 0, 1) * (self.high - self.low)[self._free]
        rings = [
            replace(ring, position=p, tilt=t, phase=f)
            for ring, p, t, f in zip(self._rings, *values.tolist(), strict=True)
        ]
        found = self.space.candidate(Setup(tuple(rings)))
        if found is None:
            raise RuntimeError("the rules leave no place for the layout")
        return found

    def shares(self, x: Float[np.ndarray, "S n"]) -> Float[np.ndarray, " S"]:
        """Return shares (S,) in [0, 1] of candidates (S, n); each new best one is shown.

        A candidate that would be the best but whose rings of different links collide is rejected:
        its share is 0.

        Raises:
            OverError: if the time is over.
        """
        found = []
        for low, high in pairwise([*range(0, len(x), _BATCH), len(x)]):
            if self.watch.spent >= self.watch.seconds:
                raise OverError
            some = [self.candidate(one) for one in np.asarray(x[low:high], float)]
            setups = stacked([self.space.arrays(c) for c in some])
            values = np.stack([self.space.values(c) for c in some])
            each = self._threads.map(
                lambda c, s=setups, v=values: self._objective.zetas(s, v, c), self._clouds
            )
            found.append(self._checked(np.mean(list(each), axis=0), some))
        return np.concatenate(found)

    def _checked(
        self, share: Float[np.ndarray, " S"], some: Sequence[Candidate]
    ) -> Float[np.ndarray, " S"]:
        """Show the best candidate if it is a new best, and reject those that collide."""
        while share.max() > (self.watch.shown[-1].value if self.watch.shown else 0.0):
            best = int(np.argmax(share))
            setup, clear = self.space.setup(some[best]), self.space.clear
            if clear is None or not meeting(clear, setup.rings):
                self.watch.show(float(share[best]), lambda found=setup: found)
                break
            share[best] = 0.0
        return share


class Judge:
    """Counts answers exactly, and rejects those that break a rule."""

    def __init__(self, scene: CoreScene, voxel: float = 0.01) -> None:
        self._scene, self._verifier = scene, Verifier(scene, voxel)

    def value(self, setup: Setup) -> float | None:
        """Return the weighted mean of ζ over goals and poses, in [0, 1]; None for a setup that
        breaks a rule.
        """
        if faults(self._scene, setup.rings):
            return None
        zetas = [self._verifier.verify(setup, goal.target).zeta for goal in self._scene.goals]
        return float(np.dot(self._scene.goal_weights, zetas))
