"""Zeta of a setup in a scene, counted or certified: the verifier that checks every result."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import psutil

from ..coverage.choices import Rule
from ..coverage.occlusion.occlusion_mode import Occlusion
from ..coverage.rings.ring import Setup
from ..coverage.solids.base import Parts
from ..coverage.targets.target import Target
from ..coverage.voxels.certified_bounds import bracket
from ..coverage.voxels.octree import count_each, regions
from ..coverage.voxels.octree_cells import Region
from ..coverage.voxels.volume_tally import Bracket
from ..coverage.voxels.voxel_set import VoxelSet
from ..coverage.voxels.weighted_voxels import important
from ..coverage.voxels.weighted_voxels import layers as weighted_layers
from .occlusion import setup_sight
from .pose_workers import KeptVoxels, active_workers, each_pose
from .sampling_error import PointCount
from .scene import Scene
from .target_voxels import check_beams, check_voxel, surface_voxels, target_voxels
from .verified import PoseZeta, Verified, proof_of, weighted_mean

Layers = list[tuple[int, VoxelSet]]
"""Sets of voxels with integer weights."""
VOXEL = 0.01  # m, default side of a voxel
RULES: tuple[Rule, ...] = ("sampled", "centre", "touch", "certified")
_SIDES = 24  # voxels on the surface of a target inside a region, per voxel on one of its faces
# of the width of a certificate, that of the interval of its cells: a simpler checker's bounds of
# the shares of cut cells are up to 1.2 times as wide as ours, which also use that a cell may lie in
# a part of a target
_FINER = 0.6
# bytes per voxel on the surface of a target: its key, its interval and the sorting of both
_BYTES = 100


class EmptyTargetError(ValueError):
    """A target without a voxel."""


def _silent(_: object) -> None:
    """Report nothing."""


class Verifier:
    """Counts zeta of setups in one scene and caches the targets' voxels, which are the same for all
    setups.
    """

    def __init__(
        self,
        scene: Scene,
        voxel: float | None = None,
        rule: Rule = "sampled",
        width: float = 0.0,
        tell: Callable[[Bracket], None] = _silent,
        memory: float | None = None,
        at: Callable[[int], None] = _silent,
        keep: bool = False,
    ) -> None:
        """Choose how to count.

        Args:
            scene: robot, poses, goals.
            voxel: side of a voxel, m; by default 0.01, or none if certified to a width.
            rule: how a voxel is counted, or ``certified``.
            width: requested width, in [0, 1], of a certified interval; 0: the interval that cells
                of side ``voxel`` give.
            tell: called with the interval after each pass of a certified count.
            memory: bytes that counting may use: half for the work, a quarter for one target's
                voxels (larger targets are counted region by region), and a quarter for the voxels
                cached for the next setup. None: half of the free memory.
            at: called with the index of each pose before it is counted.
            keep: whether certified intervals hold their cells, for a certificate.
        """
        self.memory = psutil.virtual_memory().available / 2 if memory is None else memory
        certified = rule == "certified" and width > 0
        self.scene, self.rule, self.width, self.keep = scene, rule, width, keep
        self.tell, self.at = tell, at
        self.voxel = VOXEL if voxel is None and not certified else voxel
        self._targets = KeptVoxels()
        self._layers: dict[tuple[Target, int], Layers] = {}

    def __getstate__(self) -> dict[str, Any]:
        """How it counts, with its share of the memory; what it reports to stays in its process."""
        own = {"tell": _silent, "at": _silent, "memory": self.memory / active_workers()}
        return {**vars(self), **own, "_layers": {}}

    def _important(self, target: Target, voxels: VoxelSet) -> VoxelSet:
        """Return the voxels at which the target's weight field, if it has one, is above 0."""
        if target.importance is None:
            return voxels
        return important(target.importance, voxels, self.points == "sampled")

    def pieces(self, target: Target, pose: int) -> Iterator[tuple[VoxelSet, Region | None]]:
        """Yield the voxels of ``target`` at a pose, each once: all, or region by region.

        Under a weight field they are those of a weight above 0; see ``layers``.

        Regions are used where the memory limit requires them. The rule is that of
        ``points``.

        Raises:
            ValueError: if the target contains no voxel, or its radius lies within V_R.
            TooFineError: if the count would take days.
        """
        self.at(pose)
        if kept := self._targets.get((target, pose)):
            yield kept, None
            return
        voxel = VOXEL if self.voxel is None else self.voxel
        solid = self.scene.solid(target, pose)
        check_voxel(solid, voxel)
        whole = surface_voxels(solid, voxel) * _BYTES <= self.memory / 4
        side, total = int(math.sqrt(self.memory / 4 / (_SIDES * _BYTES))), 0
        for region in [None] if whole else regions(solid, voxel, side):
            wanted = target_voxels(solid, voxel, self.points, region, self.memory / 2)
            wanted = self._important(target, wanted)
            kept_bytes = sum(kept.nbytes for kept in self._targets.values())
            if region is None and wanted.nbytes + kept_bytes <= self.memory / 4:
                self._targets[target, pose] = wanted
            total += len(wanted)
            if len(wanted):
                yield wanted, region
        if total == 0:
            raise EmptyTargetError(
                f"target {target} contains no voxel of {voxel:g} m: it is empty, or the voxels are"
                " too large"
            )

    @property
    def point_voxel(self) -> float:
        """Side of the voxels, m, for counts that judge each voxel at one point.

        Raises:
            ValueError: under the rules ``touch`` and ``certified``.
        """
        if self.rule not in ("sampled", "centre") or self.voxel is None:
            raise ValueError(f"this count needs the rule sampled or centre, got {self.rule}")
        return self.voxel

    @property
    def points(self) -> Literal["sampled", "centre", "touch"]:
        """The points at which a voxel is judged; ``sampled`` where none are asked for."""
        return "sampled" if self.rule == "certified" else self.rule

    def most_bytes(self, target: Target, pose: int) -> float:
        """Return the bytes that a target's voxels use at a pose: an upper estimate until they are
        counted; infinity where no voxels are stored.
        """
        if kept := self._targets.get((target, pose)):
            return kept.nbytes
        solid = self.scene.solid(target, pose)
        return math.inf if self.voxel is None else surface_voxels(solid, self.voxel) * _BYTES

    def under(self, occlusion: Occlusion) -> "Verifier":
        """Return a verifier for another occlusion model, with the same cached voxels."""
        return self.in_scene(replace(self.scene, occlusion=occlusion))

    def at_centres(self) -> "Verifier":
        """Return a verifier of the same scene that judges voxels at their centres."""
        if self.rule == "centre":
            return self
        return Verifier(self.scene, self.point_voxel, "centre", memory=self.memory, at=self.at)

    def in_scene(self, scene: Scene) -> "Verifier":
        """Return a verifier for a scene of the same targets and poses, with the same cached
        voxels."""
        other = object.__new__(type(self))
        vars(other).update(vars(self))
        other.scene = scene
        return other

    def seen(self, setup: Setup, pose: int) -> Parts:
        """Return the visible parts of a setup's beams at a pose."""
        q = self.scene.poses[pose].q
        return setup_sight(self.scene, setup, q, self.rule == "certified")

    def counted(self, pose: int, count: PointCount) -> PoseZeta:
        """Return zeta at a pose from the counts of the target's voxels and of the covered ones."""
        weight, zeta = float(self.scene.pose_weights[pose]), count.zeta
        error = count.error if self.rule == "sampled" else None
        return PoseZeta(weight, zeta, zeta, zeta, error, count.voxels, count.covered)

    def at_pose(self, setup: Setup, target: Target, pose: int) -> PoseZeta:
        """Return zeta of ``setup`` for ``target`` at a pose; raises as ``verify``."""
        seen = self.seen(setup, pose)
        if self.rule == "certified" or self.voxel is None:
            self.at(pose)
            solid = self.scene.solid(target, pose)
            width = self.width * (_FINER if self.keep else 1.0)
            b = bracket(solid, seen, width, self.voxel, self.tell, target.importance, self.keep)
            if self.keep:
                b = b.widened((1 / _FINER - 1) / 2)
            weight = float(self.scene.pose_weights[pose])
            middle, half = (b.low + b.high) / 2, (b.high - b.low) / 2
            return PoseZeta(weight, middle, b.low, b.high, half, bounds=b)
        count = PointCount()
        for wanted, region in self.pieces(target, pose):
            layers = self.layers(target, pose, wanted, region)
            # of a target without weights, the voxels are the only layer
            sets = [some for _, some in layers]
            sets = sets if target.importance is None else [wanted, *sets]
            counts = count_each(seen, wanted.voxel, self.points, sets, self.memory / 2, region)
            each = zip(layers, counts[-len(layers) :], strict=True)
            count.add(wanted, counts[0], ((w, some, n) for (w, some), n in each))
        return self.counted(pose, count)

    def layers(self, target: Target, pose: int, wanted: VoxelSet, region: Region | None) -> Layers:
        """Return a piece of a target as sets of voxels with integer weights.

        The weight of a voxel is the sum of the weights of all sets that contain it. Without a
        weight field it is one set of weight 1.
        """
        if target.importance is None:
            return [(1, wanted)]
        if region is None and (kept := self._layers.get((target, pose))) is not None:
            return kept
        layers = weighted_layers(target.importance, wanted, self.points == "sampled")
        size = sum(some.nbytes for _, some in layers)
        if region is None and size <= self.memory / 4:
            self._layers = {(target, pose): layers, **self._layers}
            while (
                sum(s.nbytes for each in self._layers.values() for _, s in each) > self.memory / 4
            ):
                self._layers.popitem()
        return layers

    def verify(self, setup: Setup, target: Target) -> Verified:
        """Return zeta of ``setup`` for ``target`` over the scene's poses.

        Raises:
            ValueError: if the target is empty, its radius lies within V_R, or a beam is too wide.
            TooFineError: if the count would take days.
            BodilessError: if the occlusion model needs the robot's bodies and the robot has none.
        """
        start = time.perf_counter()
        if self.voxel is not None:
            groups = self.scene.with_cell(setup).groups
            check_beams({group.sensor for group in groups}, self.voxel)
        poses = each_pose(partial(self.at_pose, setup, target), len(self.scene.poses), self.at)
        return self.over_poses(target, poses, time.perf_counter() - start)

    def verify_goals(self, setup: Setup) -> tuple[Verified, ...]:
        """Return ``verify`` of ``setup`` for each goal of the scene, in order."""
        return tuple(self.verify(setup, goal.target) for goal in self.scene.targets)

    def over_poses(self, target: Target, poses: tuple[PoseZeta, ...], seconds: float) -> Verified:
        """Return the weighted mean of a target's zetas at all poses, computed in ``seconds``."""
        weights = [p.weight for p in poses]
        zeta, low, high = (
            weighted_mean(weights, [getattr(p, key) for p in poses])
            for key in ("zeta", "low", "high")
        )
        if self.rule == "certified":
            rounding = (len(poses) + 4) * 2.0**-52  # of weights that sum to 1, and of the mean
            low, high = low * (1 - rounding), min(high * (1 + rounding), 1.0)
        errors, counts = [p.error for p in poses], not (certified := self.rule == "certified")
        mean = None if None in errors else weighted_mean(weights, [e or 0.0 for e in errors])
        return Verified(
            target=target,
            rule=self.rule,
            voxel=self.voxel,
            zeta=zeta,
            low=low,
            high=high,
            error=(high - low) / 2 if certified else mean,
            target_voxels=sum(p.target_voxels or 0 for p in poses) if counts else None,
            covered_voxels=sum(p.covered_voxels or 0 for p in poses) if counts else None,
            proof=proof_of(self.width, [p.bounds for p in poses if p.bounds is not None]),
            poses=poses,
            seconds=seconds,
        )

    def judge(self, setup: Setup) -> tuple[float, float]:
        """Return the summed shortfall of zeta below the goals' floors, and its weighted mean.

        The mean is over the goals, and over all poses or at the worst one, as the scene states.
        Both values lie in [0, 1]. The better of two setups has the smaller shortfall or, if these
        are equal, the larger mean.

        Raises:
            ValueError, TooFineError, BodilessError: as ``verify`` does.
        """
        return self.judged(self.verify_goals(setup))

    def judged_error(self, each: Sequence[Verified]) -> float | None:
        """Return the error of ``judged``'s mean for verified goals; None if it is not known.

        Goals and poses share sample points, so their errors are added, not their squares.
        """
        errors = [[p.error for p in v.poses] for v in each]
        if any(error is None for of_goal in errors for error in of_goal):
            return None
        weights = [float(w) for w in self.scene.goal_weights]
        at_poses = [
            weighted_mean(weights, [e or 0.0 for e in es]) for es in zip(*errors, strict=True)
        ]
        if self.scene.over_poses == "mean":
            return weighted_mean([float(w) for w in self.scene.pose_weights], at_poses)
        return max(at_poses)

    def judged(self, each: Sequence[Verified]) -> tuple[float, float]:
        """Return ``judge``'s values for a setup whose goals are already verified."""
        goals, weights = self.scene.targets, [float(w) for w in self.scene.goal_weights]
        short = math.fsum(
            max(goal.at_least - v.zeta, 0.0) for goal, v in zip(goals, each, strict=True)
        )
        if self.scene.over_poses == "mean":
            return short, weighted_mean(weights, [v.zeta for v in each])
        at_poses = zip(*(v.poses for v in each), strict=True)
        return short, min(
            weighted_mean(weights, [p.zeta for p in goal_by_goal]) for goal_by_goal in at_poses
        )
