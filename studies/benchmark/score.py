"""The scorer: whether an answer keeps a question's rules, its count, and an interval proven to hold
the value."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...coverage.definitions.errors import UserError, unusable
from ...coverage.rings.ring import Setup
from ...formats.layouts.entry_csv import RADIUS_M, EntryModel, read_entry
from ...objectives.criterion import judge
from ...objectives.detection_share import at_pose
from ...objectives.feasibility.clearance import MountClearance
from ...objectives.feasibility.violations import faults
from ...objectives.named_layouts import ring_radii
from ...objectives.verify import Verifier
from .questions import VERSION, Question

VOXEL = 0.01  # m, of the count
WIDTH = 0.005  # width of the proven interval of coverage, as a share
CELL = 0.01  # m, cells of the proven interval of detection
_MOST = 1000  # sensors that are counted
_DIGITS = 4  # decimals of a percentage


@dataclass(frozen=True)
class AnswerScore:
    """How good an answer is."""

    question: str
    """Name of the question."""
    sensors: int
    """Number of sensors."""
    rings: int
    """Number of rings."""
    percent: float
    """The count: the weighted mean over targets and poses, or the worst pose, percent."""
    low_percent: float
    """Lower end of the interval proven to hold the value, percent."""
    high_percent: float
    """Upper end of that interval, percent."""
    broken: tuple[str, ...]
    """The rules that it breaks, a line each; with one, it is out of competition."""

    @property
    def points(self) -> float:
        """What counts: ``percent``, and 0 out of competition."""
        return 0.0 if self.broken else self.percent


def broken_rules(question: Question, setup: Setup) -> tuple[str, ...]:
    """Return the rules of a question that a setup breaks, a line each."""
    scene, lines = question.scene, list[str]()
    if setup.sensors > question.sensors:
        lines.append(f"found {setup.sensors} sensors, allowed: at most {question.sensors}")
    if setup.singles:
        lines.append(f"{len(setup.singles)} sensors form no ring, allowed: rings")
    radii = ring_radii(scene, MountClearance(scene) if scene.real else None)
    for i, ring in enumerate(setup.rings):
        if abs(ring.radius - radii[ring.link]) > RADIUS_M:
            found, wanted = 1000 * ring.radius, 1000 * radii[ring.link]
            lines.append(
                f"ring {i} ({ring.link}) has a radius of {found:g} mm, allowed: {wanted:g}"
            )
        if ring.sensor != scene.sensor_of(ring.link):
            lines.append(f"ring {i} ({ring.link}) has another sensor than the question's")
    return (*lines, *(fault.text for fault in faults(scene, setup.rings)))


def score(question: Question, setup: Setup) -> AnswerScore:
    """Return the score of a setup.

    Raises:
        ValueError: if the setup has no sensor, or more than are counted.
    """
    if not 0 < setup.sensors <= _MOST:
        raise ValueError(f"found {setup.sensors} sensors, allowed: 1 to {_MOST}")
    verifier = Verifier(question.scene, VOXEL)
    low, high = proven(question, setup)
    return AnswerScore(
        question.name,
        setup.sensors,
        len(setup.rings),
        round(100 * judge(verifier, setup, question.aim)[1], _DIGITS),
        math.floor(100 * low * 10**_DIGITS) / 10**_DIGITS,
        math.ceil(100 * high * 10**_DIGITS) / 10**_DIGITS,
        broken_rules(question, setup),
    )


def proven(question: Question, setup: Setup, width: float = WIDTH) -> tuple[float, float]:
    """Return an interval that holds the value of a setup.

    Coverage is enclosed to ``width`` at each target and pose, the probability of detection by cells
    of 1 cm.
    """
    scene, detection = question.scene, question.aim.detection
    ends = np.zeros((2, len(scene.targets), len(scene.poses)))
    if detection is None:
        verifier = Verifier(scene, None, "certified", width)
    else:
        verifier = Verifier(scene, CELL, "certified")
    for g, goal in enumerate(scene.targets):
        for p in range(len(scene.poses)):
            if detection is None:
                one = verifier.at_pose(setup, goal.target, p)
                ends[:, g, p] = one.low, one.high
            else:
                of = at_pose(verifier, setup, goal.target, p, detection)
                ends[:, g, p] = of.low, of.high
    at_poses = np.einsum("g,egp->ep", scene.goal_weights, ends)
    mean = scene.over_poses == "mean"
    low, high = at_poses @ scene.pose_weights if mean else at_poses.min(axis=1)
    rounding = 1e-12
    return max(float(low) - rounding, 0.0), min(float(high) + rounding, 1.0)


def scored_file(question: Question, path: Path) -> tuple[EntryModel, Setup, AnswerScore]:
    """Return what a file states about its answer, the setup, and its score.

    Raises:
        UserError: if the file is not usable, or answers another question or version.
    """
    about, setup = read_entry(path, question.scene)
    for key, stated, wanted in (
        ("question", about.question, question.name),
        ("version", about.version, VERSION),
    ):
        if stated not in (None, wanted):
            raise unusable(f"{path}: {key}", stated, f"{wanted}")
    try:
        found = score(question, setup)
    except ValueError as error:
        raise UserError(f"{path}: {error}") from error
    value = {"question": question.name, "version": VERSION, "percent": found.percent}
    about = about.model_copy(update=value)
    return about, setup, found
