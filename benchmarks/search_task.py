"""Common task of all searches: scenes, rings as numbers in a unit box, and the exact value of
answers.
"""

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float
from place_rings.coverage.processors import processors
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.targets import Target
from place_rings.objectives.feasibility.mounting import meeting
from place_rings.objectives.feasibility.violations import faults
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import CoreScene, Goal, paper_scene
from place_rings.objectives.soft_objective import CoverageObjective
from place_rings.objectives.target_points import TargetPoints
from place_rings.objectives.verify import Verifier
from place_rings.placement.search.design import Candidate, Space, stacked
from place_rings.placement.search.feasible_set import InfeasibleError
from place_rings.placement.search.layout import ring_layout
from place_rings.simulation.pick_and_place import pick_and_place
from place_rings.studies.engine.scenes import scene_from

POINTS = 8192  # points of all goals and poses, on which candidates are evaluated
VOXEL = 0.01  # m, of the exact count that judges answers
_BATCH = 16  # candidates between two checks of the clock
GOALS = {
    "V_S(0.5)": (Goal(Target("V_S", 0.5)),),
    "V_S(1.5)": (Goal(Target("V_S", 1.5)),),
    "V_OT": (Goal(Target("V_OT")),),
    "V_T": (Goal(Target("V_T")),),
    "near + far": (Goal(Target("V_S", 0.5), 0.5), Goal(Target("V_S", 1.5), 0.5)),
    "trajectory": (Goal(Target("V_S", 0.5)),),
}
PAPER = tuple(GOALS)  # scenes of the paper's world, on the UR10
ROBOTS = {"UR10": "ur10", "UR5e": "ur5e", "Panda": "panda"}  # real scenes: V_S(0.5), default pose
SENSORS = {"real": (40, 80), "paper": (80, 112)}
_POSES = 12  # poses of the trajectory, at equal time steps of the paper's task
_RINGS_PER_LINK = {112: 3}  # the paper's layout of 7 rings; otherwise 2
_MOST = 30  # sensors of a ring in the real scenes; with 24 a Panda has no room for 80


class OverError(Exception):
    """The time is over."""


def scene_named(name: str) -> CoreScene:
    """Return a scene of the benchmark. In the paper's world rings may touch, for every method."""
    if name in ROBOTS:
        rules = {"mount": "real", "sensors_per_ring": [3, _MOST]}
        return scene_from({"robot": ROBOTS[name], "occlusion": "shadow", "rules": rules})
    rules = Rules(spacing=0.0)
    if name != "trajectory":
        return paper_scene(goals=GOALS[name], rules=rules)
    return paper_scene(goals=GOALS[name], poses=poses_of_task(), rules=rules)


def poses_of_task() -> tuple[Pose, ...]:
    """Return poses of the paper's task, at equal time steps."""
    q = pick_and_place(UR10, 50.0).q
    return tuple(Pose(q[i]) for i in np.round(np.linspace(0, len(q) - 1, _POSES)).astype(int))


def layout(scene: CoreScene, sensors: int) -> Setup:
    """Return the rings of all methods but the search with free rings: those of the paper's layout,
    or one for each link where two have no room, with counts as even as the boards allow.

    Raises:
        InfeasibleError: if the rules leave no room for them.
    """
    paper = _RINGS_PER_LINK.get(sensors, 2)
    try:
        return _even(scene, ring_layout(scene, paper, 1), sensors)
    except InfeasibleError:
        return _even(scene, ring_layout(scene, 1, 1), sensors)


def _even(scene: CoreScene, rings: Setup, sensors: int) -> Setup:
    """Return rings with counts that differ as little as the boards allow."""
    space, count = Space(scene, sensors=sensors), [0] * len(rings.rings)
    most = [space.most_on(ring.link) for ring in rings.rings]
    for _ in range(sensors):
        count[min(range(len(count)), key=lambda i: (count[i] >= most[i], count[i]))] += 1
    setup = Setup(tuple(replace(r, count=n) for r, n in zip(rings.rings, count, strict=True)))
    Space(scene, setup)  # raises where there is no room
    return setup


def processor_seconds() -> float:
    """Return the processor time of this process, s."""
    return time.process_time()


@dataclass(frozen=True)
class Shown:
    """A setup that was a search's best."""

    wall: float
    """Wall time, s."""
    work: float
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
    began: tuple[float, float] = field(
        default_factory=lambda: (time.perf_counter(), processor_seconds())
    )
    """Wall and processor time of the start."""
    shown: list[Shown] = field(default_factory=list)
    """The setups."""
    evaluations: int = 0
    """Number of evaluated candidates."""

    def _since(self) -> tuple[float, float]:
        return time.perf_counter() - self.began[0], processor_seconds() - self.began[1]

    @property
    def spent(self) -> float:
        """Processor time since the start, s."""
        return self._since()[1]

    def left(self) -> float:
        """Remaining processor time, s."""
        return self.seconds - self._since()[1]

    def show(self, value: float, make: Callable[[], Setup], always: bool = False) -> None:
        """Store a setup if it is in time and better than earlier ones, or if ``always``."""
        now = self._since()
        if now[1] <= self.seconds and (always or not self.shown or value > self.shown[-1].value):
            self.shown.append(Shown(*now, value, make()))


class Question:
    """The objective of the peers.

    Candidates are ``size`` numbers in [0, 1]: position along the whole link, tilt and phase of each
    ring of a layout. Each ring is moved to the nearest place that the rules leave free, so peers
    search the feasible set of our search. The value is the exact share of training points that a
    candidate covers, compiled, on the processors of this process. low, high (3, R): values at 0
    and 1.
    """

    def __init__(
        self, scene: CoreScene, wanted: Setup, seed: int, watch: Watch, points: int = POINTS
    ) -> None:
        """Draw the points and compile."""
        import jax

        self.watch, self.space, self._rings = watch, Space(scene, wanted), wanted.rings
        drawn = TargetPoints(scene, max(points // (len(scene.goals) * len(scene.poses)), 64), seed)
        self._objective = CoverageObjective(scene, drawn)
        workers, every = processors(), drawn.points
        self._clouds = []
        for i in range(workers):  # every processor handles its own part of the points
            drawn.points = [p[: len(p) // workers * workers][i::workers] for p in every]
            self._clouds.append(drawn.clouds(len(drawn.points[0])))
        self._threads, self._tree = ThreadPoolExecutor(workers), jax.tree
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

    def values(self, x: Float[np.ndarray, " n"]) -> Float[np.ndarray, "3 R"]:
        """Return position, tilt and phase of each ring for a candidate."""
        values = self.low.copy()
        values[self._free] += np.clip(x, 0, 1) * (self.high - self.low)[self._free]
        return values

    def candidate(self, x: Float[np.ndarray, " n"]) -> Candidate:
        """Return the nearest candidate that the rules of each link allow.

        Raises:
            RuntimeError: if the rules leave no place.
        """
        each = zip(self._rings, *self.values(x).tolist(), strict=True)
        rings = [replace(r, position=p, tilt=t, phase=f) for r, p, t, f in each]
        found = self.space.candidate(Setup(tuple(rings)))
        if found is None:
            raise RuntimeError("the rules leave no place for the layout")
        return found

    def setup(self, x: Float[np.ndarray, " n"]) -> Setup:
        """Return the setup of a candidate."""
        return self.space.setup(self.candidate(x))

    def shares(self, x: Float[np.ndarray, "S n"]) -> Float[np.ndarray, " S"]:
        """Return shares (S,) in [0, 1] of candidates (S, n); each new best one is shown.

        A candidate that would be the best but whose rings of different links collide is rejected:
        its share is 0.

        Raises:
            OverError: if the time is over.
        """
        found = []
        for low, high in pairwise([*range(0, len(x), _BATCH), len(x)]):
            if self.watch.left() <= 0:
                raise OverError
            some = [self.candidate(one) for one in np.asarray(x[low:high], float)]
            setups = stacked([self.space.arrays(c) for c in some])
            values = np.stack([self.space.values(c) for c in some])
            each = self._threads.map(
                lambda c, s=setups, v=values: self._objective.zetas(s, v, c), self._clouds
            )
            share = np.mean(list(each), axis=0)
            self.watch.evaluations += high - low
            found.append(self._checked(share, some))
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

    def __init__(self, scene: CoreScene, voxel: float = VOXEL) -> None:
        self._scene, self._verifier = scene, Verifier(scene, voxel)

    def value(self, setup: Setup) -> float | None:
        """Return the weighted mean of ζ over goals and poses, in [0, 1]; None for a setup that
        breaks a rule.
        """
        if faults(self._scene, setup.rings):
            return None
        zetas = [self._verifier.verify(setup, goal.target).zeta for goal in self._scene.goals]
        return float(np.dot(self._scene.goal_weights, zetas))


def thinned(shown: Sequence[Shown]) -> list[Shown]:
    """Return the setups without those that a better one replaced at once: after less than 0.05 s or
    2 % of the time.
    """
    later: list[Any] = [*shown[1:], None]
    return [
        s
        for s, after in zip(shown, later, strict=True)
        if after is None or after.work - s.work > max(0.05, 0.02 * s.work)
    ]
