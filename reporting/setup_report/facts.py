"""The counts in a report: ζ, robustness, blind spots."""

import math
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from ...coverage.detection.detection import Detection
from ...coverage.detection.pieces import PIECES
from ...coverage.rings.ring import Setup
from ...formats.schema.written_models import RequirementModel
from ...objectives.blind_spots import Blind, blind_spots
from ...objectives.detection_share import detected
from ...objectives.feasibility.mounting import Fault
from ...objectives.feasibility.violations import faults
from ...objectives.firing.schedule import FiringSchedule, firing_schedule
from ...objectives.options import FiringOptions, ReportOptions, RobustnessOptions
from ...objectives.pose_subset import MANY, representative
from ...objectives.robustness import RingSensitivity, Robustness, robustness
from ...objectives.scene import Scene
from ...objectives.smallest_object import smallest_objects
from ...objectives.verified import CalibrationEffect, Verified
from ...objectives.verify import Verifier
from ...objectives.verify_breakdown import calibration_effect
from ...placement.search.result import SearchResult
from ..comparison import compared, counted, papers
from ..progress import ProgressBar
from ..terminal import Terminal

QUESTIONS = tuple(Detection(PIECES[name]) for name in ("hand", "arm", "torso"))
"""The questions of detection that a report answers."""
DETECTION_VOXEL = 0.02
"""Smallest side of the voxels of a report's counts of detection, m."""
_SEEN = 3  # largest k for which k-coverage is counted
_LOOKED = 8  # largest number of poses at which blind spots are computed


@dataclass(frozen=True)
class Facts:
    """The figures of a report."""

    name: str
    """Name of the setup."""
    setup: Setup
    """The setup."""
    scene: Scene
    """Its scene."""
    options: ReportOptions
    """How it is counted."""
    sensors: dict[str, int]
    """Number of sensors of each setup, by name."""
    zetas: list[Verified]
    """ζ of the setup, which comes first, and of the paper's layouts."""
    robust: tuple[Robustness, ...]
    """Redundancy and tolerance for each goal."""
    robust_poses: int
    """Number of poses over which ``robust`` is computed."""
    blind: list[Blind]
    """Blind spots for each target."""
    broken: list[Fault]
    """Violated rules of the scene, and of a real mount."""
    found: SearchResult | None
    """Record of the search that found the setup, or None."""
    calibration: list[CalibrationEffect]
    """What the calibration of the arm changes, for each goal; empty without one."""
    required: list[RequirementModel]
    """Required coverages of the scene, decided."""
    sensitivity: tuple[RingSensitivity, ...]
    """What small errors of each ring cost."""

    @property
    def voxel(self) -> float:
        """Side of a voxel, m."""
        return self.options.voxel

    @cached_property
    def firing(self) -> FiringSchedule:
        """Which sensors may fire together, at representative poses."""
        return firing_schedule(
            self.name, self.setup, standing_for(self.scene, MANY), FiringOptions()
        )

    @cached_property
    def detected(self) -> list[Verified]:
        """The goals' records with ζ of detection at representative poses, for each of
        ``QUESTIONS``."""
        verifier = Verifier(standing_for(self.scene, MANY), max(self.voxel, DETECTION_VOXEL))
        return [
            replace(r, detection=detected(verifier, self.setup, r.target, question))
            for question in QUESTIONS
            for r in self.own
        ]

    @cached_property
    def with_objects(self) -> list[Verified]:
        """The goals' records, with the largest unseen objects where the options ask for them or the
        target states the largest gap."""
        if not self.own:
            return []
        each = smallest_objects(self.scene, self.setup, self.voxel, self.options)
        return [replace(r, smallest_object=o) for r, o in zip(self.own, each, strict=True)]

    @property
    def own(self) -> list[Verified]:
        """ζ of the setup for each goal of the scene."""
        goals = [g.target.key for g in self.scene.targets]
        return [r for goal in goals for r in self.zetas if r.setup == self.name and r.key == goal]


def standing_for(scene: Scene, poses: int) -> Scene:
    """Return ``scene`` with at most ``poses`` representative poses."""
    if len(scene.poses) <= poses:
        return scene
    weights = representative(scene.pose_weights, poses, np.random.default_rng(0))
    kept = tuple(
        replace(p, weight=float(w)) for p, w in zip(scene.poses, weights, strict=True) if w > 0
    )
    return replace(scene, poses=kept)


def looked_at(scene: Scene, worst: int) -> list[int]:
    """Return the poses at which blind spots are computed: all, or some spread over the motion and
    the worst.
    """
    poses = len(scene.poses)
    if poses <= _LOOKED:
        return list(range(poses))
    return sorted({worst, *np.linspace(0, poses - 1, _LOOKED - 1).astype(int).tolist()})


def gather(
    name: str,
    setup: Setup,
    scene: Scene,
    options: ReportOptions,
    found: SearchResult | None,
    console: Terminal,
) -> Facts:
    """Count everything that the report of ``setup`` states, with progress on ``console``."""
    voxel, draws = options.voxel, options.draws
    setups = {name: setup} | {
        paper: one for paper, one in papers(scene).items() if one != setup and paper != name
    }
    targets, zetas = compared(scene), list[Verified]()
    with ProgressBar(console) as bar:
        task = bar.add_task("counting", total=len(targets) * len(setups))
        for result in counted(Verifier(scene, voxel), setups, targets, targets, {}):
            zetas.append(result)
            bar.advance(task)
    few = standing_for(scene, MANY)
    errors = RobustnessOptions(k=_SEEN, draws=draws, seed=options.seed)
    with ProgressBar(console) as bar:
        task = bar.add_task("mounting errors", total=draws * len(few.poses) * len(few.targets))
        tell = partial(bar.advance, task)
        robust = robustness(Verifier(few, voxel), name, setup, errors, tell)
    with console.status("computing what errors of single rings cost"):
        from ...objectives.sensitivity import sensitivity  # loads JAX

        costs = sensitivity(few, setup) if setup.rings else ()
    worst = {r.key: r.worst.pose for r in zetas if r.setup == name and r.worst}
    with console.status("computing blind spots"):
        blind = [
            blind_spots(verifier, setup, t, looked_at(scene, worst.get(t.key, 0)))
            for t in (goal.target for goal in scene.targets)
            for verifier in [Verifier(scene, voxel)]
        ]
    broken = faults(scene, setup.rings)
    with console.status("proving the requirements"):
        required = decide(scene, setup)
    sensors = {n: one.sensors for n, one in setups.items()}
    return Facts(
        name,
        setup,
        scene,
        options,
        sensors,
        zetas,
        robust,
        len(few.poses),
        blind,
        broken,
        found,
        calibration_effect(Verifier(scene, voxel), setup),
        required,
        costs,
    )


_WIDTHS = (0.005, 0.001, 0.0005)  # of the interval, until it decides


def requirement_sentence(r: RequirementModel) -> str:
    """Return a requirement and what is proved about it."""
    proved = f"proved: {r.low_percent:.2f} to {r.high_percent:.2f} %"
    doubt = (
        "; the interval contains the required value, so it is not proved"
        if r.low_percent < r.required_percent <= r.high_percent
        else ""
    )
    return f"{r.target} requires at least {r.required_percent:g} %; {proved}{doubt}"


def decide(scene: Scene, setup: Setup) -> list[RequirementModel]:
    """Return the requirements of a scene's goals, decided for a setup.

    Each interval is narrowed until it decides its requirement, or down to a twentieth of a point.
    Its ends are rounded outward to hundredths.
    """
    decided = list[RequirementModel]()
    for goal in scene.targets:
        if goal.at_least <= 0:
            continue
        low, high = 0.0, 1.0
        for width in _WIDTHS:
            verified = Verifier(scene, None, "certified", width).verify(setup, goal.target)
            low, high = verified.low, verified.high
            if low >= goal.at_least or high < goal.at_least:
                break
        required, low_percent = round(100 * goal.at_least, 9), math.floor(1e4 * low) / 100
        decided.append(
            RequirementModel(
                target=str(goal.target),
                required_percent=required,
                low_percent=low_percent,
                high_percent=math.ceil(1e4 * high) / 100,
                passes=low_percent >= required,
            )
        )
    return decided
