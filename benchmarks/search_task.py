"""Common task of all searches: rings as numbers in a unit box, and the judgement of answers."""

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from place_rings.coverage.rings.ring import Setup, sensor_optics
from place_rings.coverage.rings.ring_kinematics import sensor_axes
from place_rings.coverage.robots.built_in import UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.soft.estimator import SHARP, soft_zeta
from place_rings.coverage.soft.sampling import cloud
from place_rings.coverage.solids.cones import Cones
from place_rings.coverage.targets import Target
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import CoreScene, Goal, paper_scene
from place_rings.objectives.soft_objective import CoverageObjective
from place_rings.objectives.target_points import TargetPoints
from place_rings.placement.search.design import Space, stacked
from place_rings.placement.search.layout import ring_layout
from place_rings.simulation.pick_and_place import pick_and_place

POINTS = 8192  # training points of all goals and poses, on which candidates are evaluated
HELD_OUT = 100_000  # other points, on which all methods' answers are judged afterwards
_HELD_OUT_SEED = 10**6
_BATCH = 16  # candidates between two checks of the clock
_RULES = Rules(spacing=0.0)
_GOALS = {
    "V_S(0.5)": (Goal(Target("V_S", 0.5)),),
    "V_S(1.5)": (Goal(Target("V_S", 1.5)),),
    "V_OT": (Goal(Target("V_OT")),),
    "V_T": (Goal(Target("V_T")),),
    "near + far": (Goal(Target("V_S", 0.5), 0.5), Goal(Target("V_S", 1.5), 0.5)),
    "trajectory": (Goal(Target("V_S", 0.5)),),
}
SCENES = tuple(_GOALS)
_POSES = 12  # poses of the trajectory, at equal time steps of the paper's task
RINGS_PER_LINK = {80: 2, 112: 3}  # the paper's layouts: 5 and 7 rings of 16


class OverError(Exception):
    """The time is over."""


def scene_named(name: str) -> CoreScene:
    """Return a scene of the benchmark; rings may touch, for every method."""
    if name != "trajectory":
        return paper_scene(goals=_GOALS[name], rules=_RULES)
    q = pick_and_place(UR10, 50.0).q
    poses = tuple(Pose(q[i]) for i in np.round(np.linspace(0, len(q) - 1, _POSES)).astype(int))
    return paper_scene(goals=_GOALS[name], poses=poses, rules=_RULES)


def layout(scene: CoreScene, sensors: int) -> Setup:
    """Return the paper's rings for a number of sensors."""
    return ring_layout(scene, RINGS_PER_LINK[sensors], 16)


def _wall_and_work() -> tuple[float, float]:
    return time.perf_counter(), time.process_time() / (os.cpu_count() or 1)


@dataclass(frozen=True)
class Shown:
    """A setup that was a search's best."""

    wall: float
    """Wall time, s."""
    work: float
    """Processor time / number of processors, s."""
    value: float
    """Value by which the search chose it."""
    setup: Setup
    """The setup."""


@dataclass
class Watch:
    """A search's clock, and the setups that were its best.

    The clock shows wall time, or ``work``: processor time / number of processors, which other work
    on the machine hardly changes.
    """

    seconds: float
    work: bool = False
    began: tuple[float, float] = field(default_factory=_wall_and_work)
    shown: list[Shown] = field(default_factory=list)
    evaluations: int = 0

    def _since(self) -> tuple[float, float]:
        now = _wall_and_work()
        return now[0] - self.began[0], now[1] - self.began[1]

    def left(self) -> float:
        """Remaining time, s."""
        return self.seconds - self._since()[self.work]

    def show(self, value: float, make: Callable[[], Setup], always: bool = False) -> None:
        """Store a setup if it is in time and better than earlier ones, or if ``always``."""
        now = self._since()
        if now[self.work] <= self.seconds and (
            always or not self.shown or value > self.shown[-1].value
        ):
            self.shown.append(Shown(*now, value, make()))


class Question:
    """The objective of the peers.

    Candidates are the layout's positions, tilts and phases as ``size`` numbers in [0, 1]. The value
    is the exact share of training points that they cover, compiled, on all processors. low, high
    (3, R): values at 0 and 1.
    """

    def __init__(
        self, scene: CoreScene, wanted: Setup, seed: int, watch: Watch, points: int = POINTS
    ) -> None:
        """Draw the points and compile."""
        self.watch, self._space = watch, Space(scene, wanted)
        drawn = TargetPoints(scene, max(points // (len(scene.goals) * len(scene.poses)), 64), seed)
        self._objective = CoverageObjective(scene, drawn)
        workers, every = os.cpu_count() or 1, drawn.points
        self._clouds = []
        for i in range(workers):  # every processor handles its own part of the points
            drawn.points = [p[: len(p) // workers * workers][i::workers] for p in every]
            self._clouds.append(drawn.clouds(len(drawn.points[0])))
        self._threads = ThreadPoolExecutor(workers)
        start = self._space.candidate(wanted)
        if start is None:
            raise ValueError("the layout does not fit the scene")
        self._like, self._arrays = start, stacked([self._space.arrays(start)])
        self.low, self.high = self._space.box(start)
        self._free = self.high > self.low
        self.size = int(self._free.sum())
        self._objective.zetas(self._arrays, start.values[None], self._clouds[0])

    def _values(self, x: Float[np.ndarray, "S n"]) -> Float[np.ndarray, "S 3 R"]:
        values = np.repeat(self.low[None], len(x), axis=0)
        values[:, self._free] += np.clip(x, 0, 1) * (self.high - self.low)[self._free]
        return values

    def shares(self, x: Float[np.ndarray, "S n"]) -> Float[np.ndarray, " S"]:
        """Return shares (S,) in [0, 1] of candidates (S, n); each new best one is shown.

        Raises:
            OverError: if the time is over.
        """
        found = []
        for low, high in pairwise([*range(0, len(x), _BATCH), len(x)]):
            if self.watch.left() <= 0:
                raise OverError
            values = self._values(np.asarray(x[low:high], float))
            setups = jax.tree.map(lambda a, n=high - low: np.repeat(a, n, axis=0), self._arrays)
            each = self._threads.map(
                lambda c, s=setups, v=values: self._objective.zetas(s, v, c), self._clouds
            )
            share = np.mean(list(each), axis=0)
            best = int(np.argmax(share))
            self.watch.evaluations += high - low
            self.watch.show(float(share[best]), lambda v=values[best]: self._setup(v))
            found.append(share)
        return np.concatenate(found)

    def _setup(self, values: Float[np.ndarray, "3 R"]) -> Setup:
        return self._space.setup(
            type(self._like)(self._like.segment, self._like.count, values, self._like.sign)
        )


def held_out(scene: CoreScene, setups: list[Setup], points: int = HELD_OUT) -> list[float]:
    """Return the weighted mean share in [0, 1] of points that no search used.

    All setups must have the same number of sensors.
    """
    terms = [(g, p) for g in range(len(scene.goals)) for p in range(len(scene.poses))]
    drawn = TargetPoints(scene, -(-points // len(terms)), _HELD_OUT_SEED)
    clouds = [jax.tree.map(jnp.asarray, cloud(p)) for p in drawn.points]
    half, range_m = (jnp.asarray(a, jnp.float32) for a in sensor_optics(setups[0]))

    @jax.jit
    def share(apex: Any, axis: Any, some: Any) -> Any:
        return soft_zeta(Cones(apex, axis, half, range_m), some, SHARP, slopes=False).zeta

    found = []
    frames = [forward(scene.robot.chain, pose.q) for pose in scene.poses]
    for setup in setups:
        looks = [[a.astype(np.float32) for a in sensor_axes(scene.robot, setup, f)] for f in frames]
        each = [share(*looks[p], some) for (_, p), some in zip(terms, clouds, strict=True)]
        weights = [scene.goal_weights[g] * scene.pose_weights[p] for g, p in terms]
        found.append(float(np.dot(weights, np.asarray(each, float))))
    return found
