"""Exact zeta of a setup in a scene: the verifier that every answer passes through."""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import psutil

from ..coverage.choices import Rule
from ..coverage.occlusion.model import OCCLUSIONS, Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.solids.base import Difference
from ..coverage.targets import Target
from ..coverage.voxels.certified_bounds import Bracket, bracket
from ..coverage.voxels.octree import count, regions, voxels
from ..coverage.voxels.octree_cells import Region
from ..coverage.voxels.voxel_set import VoxelSet
from .occlusion import setup_sight
from .scene import Scene

VOXEL = 0.01  # m, side of a voxel where none is given
RULES: tuple[Rule, ...] = ("centre", "touch", "certified")
_MOST = 1e10  # voxels on the surface of a target: more would take days
_SIDES = 24  # voxels on the surface of a target inside a region, for each voxel on one of its faces
# for each voxel on the surface of a target: its key, its interval and the sorting of both
_BYTES = 100


def weighted_mean(weights: Iterable[float], shares: Iterable[float]) -> float:
    """The mean of shares in [0, 1] by weights that sum to 1 but for rounding, which takes it
    nowhere beyond 1.
    """
    return min(
        math.fsum(float(w) * float(share) for w, share in zip(weights, shares, strict=True)), 1.0
    )


class TooFineError(ValueError):
    """Voxels so small that counting them would take days."""


@dataclass(frozen=True)
class PoseZeta:
    """Zeta in [0, 1] at one pose; low and high equal it unless the rule is certified, then it is
    their middle, ``proof`` says how they were reached, and there are no counts of voxels."""

    weight: float
    zeta: float
    low: float
    high: float
    target_voxels: int | None
    covered_voxels: int | None
    proof: Bracket | None = None


@dataclass(frozen=True)
class Verified:
    """Zeta in [0, 1] of one target: the weighted mean over poses, and each pose beside it;
    ``width`` is that asked of a certified interval."""

    target: Target
    rule: Rule
    voxel: float | None
    zeta: float
    low: float
    high: float
    poses: tuple[PoseZeta, ...]
    seconds: float
    width: float = 0.0

    @property
    def worst(self) -> int:
        """The pose with the least zeta; the first of equals."""
        return min(range(len(self.poses)), key=lambda i: self.poses[i].zeta)

    @property
    def target_voxels(self) -> int | None:
        """Voxels of the target, all poses together."""
        return None if self.rule == "certified" else sum(p.target_voxels or 0 for p in self.poses)

    @property
    def covered_voxels(self) -> int | None:
        """Covered voxels of the target, all poses together."""
        return None if self.rule == "certified" else sum(p.covered_voxels or 0 for p in self.poses)


def target_voxels(
    solid: Difference,
    voxel: float,
    rule: Literal["centre", "touch"],
    region: Region | None = None,
    memory: float | None = None,
) -> VoxelSet:
    """Omega(V_max), of the whole or of one region: under ``touch``, as in the paper, the voxels
    touched by the outer solid less those touched by V_R."""
    if rule == "centre":
        return voxels(solid, voxel, region=region, memory=memory)
    outer, body = (
        voxels(s, voxel, "touch", region=region, memory=memory) for s in (solid.a, solid.b)
    )
    return outer - body


def surface_voxels(solid: Difference, voxel: float) -> float:
    """A generous guess of the voxels on the surface of a solid, a few times those on its box: the
    ones that are stored.
    """
    x, y, z = np.ptp(solid.bounds(), axis=0)
    return float(4 * (x * y + y * z + z * x) / voxel**2)


def check_voxel(solid: Difference, voxel: float) -> None:
    """Refuse a voxel size that would take days, before it is tried.

    Raises:
        TooFineError: if the surface has more than 10^10 voxels.
    """
    if not (math.isfinite(voxel) and voxel > 0):
        raise ValueError(f"voxel {voxel} is not a positive number of metres")
    surface = surface_voxels(solid, voxel)
    if surface > _MOST:
        raise TooFineError(
            f"voxel {voxel:g} m would mean about {surface:.1g} voxels on the surface alone, more"
            f" than {_MOST:.0e}; allowed: {voxel * math.sqrt(surface / _MOST):.1g} m and more"
        )


def _silent(_: object) -> None:
    """Report nothing."""


class Verifier:
    """Counts zeta of setups in one scene and keeps the voxels of its targets, which no setup
    changes.
    """

    def __init__(
        self,
        scene: Scene,
        voxel: float | None = None,
        rule: Rule = "centre",
        width: float = 0.0,
        tell: Callable[[Bracket], None] = _silent,
        memory: float | None = None,
        at: Callable[[int], None] = _silent,
    ) -> None:
        """Choose how to count.

        Args:
            scene: robot, poses, goals.
            voxel: side of a voxel, m; by default 0.01, and none when certified to a width.
            rule: how a voxel is counted, or ``certified``.
            width: in [0, 1], of the interval, when certified; 0: what cells of side ``voxel`` give.
            tell: is given the interval after each pass, when certified.
            memory: bytes that counting may take: half for the work, a quarter for one target's
                voxels (what needs more is
                counted region by region) and a quarter for those kept for the next setup. None:
                    half of what is free.
            at: is given the number of each pose before it is counted.
        """
        self.memory = psutil.virtual_memory().available / 2 if memory is None else memory
        certified = rule == "certified" and width > 0
        self.scene, self.rule, self.width, self.tell, self.at = scene, rule, width, tell, at
        self.voxel = VOXEL if voxel is None and not certified else voxel
        self._targets: dict[tuple[Target, int], VoxelSet] = {}

    def __getstate__(self) -> dict[str, Any]:
        """How it counts; what it reports to, and the voxels, stay in their process."""
        return {**vars(self), "tell": _silent, "at": _silent, "_targets": {}}

    def _target(self, target: Target, pose: int, solid: Difference, voxel: float) -> VoxelSet:
        if (target, pose) in self._targets:
            return self._targets[target, pose]
        found = target_voxels(solid, voxel, self._rule, memory=self.memory / 2)
        if found.nbytes + sum(kept.nbytes for kept in self._targets.values()) <= self.memory / 4:
            self._targets[target, pose] = found
        return found

    def pieces(self, target: Target, pose: int) -> Iterator[tuple[VoxelSet, Region | None]]:
        """The voxels of ``target`` at a pose, each once: all of them, or region by region where
        memory asks for it; of the rule ``touch``, or else ``centre``.

        Raises:
            ValueError: for a target that holds no voxel, or one whose radius lies within V_R.
            TooFineError: if the count would take days.
        """
        self.at(pose)
        voxel = VOXEL if self.voxel is None else self.voxel
        solid = self.scene.solid(target, pose)
        check_voxel(solid, voxel)
        total = 0
        if surface_voxels(solid, voxel) * _BYTES <= self.memory / 4:
            wanted = self._target(target, pose, solid, voxel)
            total = len(wanted)
            if total:
                yield wanted, None
        else:
            for region in regions(
                solid, voxel, int(math.sqrt(self.memory / 4 / (_SIDES * _BYTES)))
            ):
                wanted = target_voxels(solid, voxel, self._rule, region, self.memory / 2)
                total += len(wanted)
                if len(wanted):
                    yield wanted, region
        if total == 0:
            raise ValueError(
                f"target {target} holds no voxel of {voxel:g} m: it is empty or the voxel too large"
            )

    @property
    def centre_voxel(self) -> float:
        """Side of the voxels, m, for what counts by the rule ``centre`` alone; ValueError under
        another rule.
        """
        if self.rule != "centre" or self.voxel is None:
            raise ValueError(f"found rule {self.rule}, allowed here: centre")
        return self.voxel

    @property
    def _rule(self) -> Literal["centre", "touch"]:
        return "touch" if self.rule == "touch" else "centre"

    def under(self, occlusion: Occlusion) -> "Verifier":
        """The same under another occlusion, with the voxels that are kept."""
        other = object.__new__(type(self))
        vars(other).update(vars(self))
        other.scene = replace(self.scene, occlusion=occlusion)
        return other

    def _at_pose(self, setup: Setup, target: Target, pose: int) -> PoseZeta:
        scene, weight = self.scene, float(self.scene.pose_weights[pose])
        q = scene.poses[pose].q
        seen = setup_sight(scene, setup, q, self.rule == "certified")
        if self.rule == "certified" or self.voxel is None:
            self.at(pose)
            b = bracket(scene.solid(target, pose), seen, self.width, self.voxel, self.tell)
            return PoseZeta(weight, (b.low + b.high) / 2, b.low, b.high, None, None, b)
        total = covered = 0
        for wanted, region in self.pieces(target, pose):
            total += len(wanted)
            covered += count(seen, self.voxel, self._rule, wanted, region, self.memory / 2)
        zeta = covered / total
        return PoseZeta(weight, zeta, zeta, zeta, total, covered)

    def verify(self, setup: Setup, target: Target) -> Verified:
        """Zeta of ``setup`` for ``target`` over the scene's poses.

        Raises:
            ValueError: for an empty target, or one whose radius lies within V_R.
            TooFineError: if the count would take days.
            BodilessError: if the robot should shadow or blind its sensors, and has no bodies.
        """
        start = time.perf_counter()
        poses = tuple(self._at_pose(setup, target, i) for i in range(len(self.scene.poses)))
        weights = [p.weight for p in poses]
        zeta, low, high = (
            weighted_mean(weights, [getattr(p, key) for p in poses])
            for key in ("zeta", "low", "high")
        )
        if self.rule == "certified":
            rounding = (len(poses) + 4) * 2.0**-52  # of weights that sum to 1, and of the mean
            low, high = low * (1 - rounding), min(high * (1 + rounding), 1.0)
        return Verified(
            target,
            self.rule,
            self.voxel,
            zeta,
            low,
            high,
            poses,
            time.perf_counter() - start,
            self.width,
        )

    def judge(self, setup: Setup) -> tuple[float, float]:
        """By how much zeta falls short of the goals' floors, all together, and its weighted mean
        over the goals, of all poses or of the worst one, as the scene asks: both in [0, 1]. A setup
        is better than another if it falls less short, or else if its mean is higher. Raises as
        ``verify`` does."""
        return self.judged([self.verify(setup, goal.target) for goal in self.scene.goals])

    def judged(self, each: Sequence[Verified]) -> tuple[float, float]:
        """The judgement of a setup whose goals are verified already, in their order."""
        goals, weights = self.scene.goals, [float(w) for w in self.scene.goal_weights]
        short = math.fsum(
            max(goal.at_least - v.zeta, 0.0) for goal, v in zip(goals, each, strict=True)
        )
        if self.scene.over_poses == "mean":
            return short, weighted_mean(weights, [v.zeta for v in each])
        at_poses = zip(*(v.poses for v in each), strict=True)
        return short, min(
            weighted_mean(weights, [p.zeta for p in goal_by_goal]) for goal_by_goal in at_poses
        )


def by_occlusion(verifier: Verifier, setup: Setup, known: Verified) -> dict[Occlusion, float]:
    """Zeta in [0, 1] of ``setup`` for the target of ``known`` under each model, by the same voxels;
    ``known`` under its own.

    None where the robot has no bodies, or where the rule is certified: an interval is made for one
    model at a time.
    """
    scene = verifier.scene
    if not scene.robot.bodies or verifier.rule == "certified":
        return {}
    return {
        occlusion: (
            known.zeta
            if occlusion == scene.occlusion
            else verifier.under(occlusion).verify(setup, known.target).zeta
        )
        for occlusion in OCCLUSIONS
    }
