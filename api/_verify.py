"""Counted and certified coverage of a setup."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import zip_longest
from os import PathLike
from pathlib import Path
from typing import Any

from ._arguments import check_question, renamed
from ._errors import InputError, input_errors
from ._options import called_with
from ._pictures import Picture, drawn
from ._placement import Counted
from ._validation import SetupCall, SetupLike, check_scene, resolve_setup
from .coverage.detection.detection import Detection
from .coverage.rings.ring import Setup
from .coverage.rings.sensor_records import sensor_records
from .coverage.voxels.volume_tally import Bracket
from .formats.writing import write_bytes
from .objectives.certificate import certificate, certified_shapes
from .objectives.detection_share import detected
from .objectives.object_bounds import SmallestObject
from .objectives.options import VerifyOptions
from .objectives.pose_workers import PoseWorkers, active_workers
from .objectives.scene import Scene
from .objectives.smallest_object import smallest_objects
from .objectives.verified import Verified, lifted
from .objectives.verify import VOXEL, Verifier
from .objectives.verify_breakdown import calibration_effect


@dataclass(frozen=True, repr=False)
class Coverage(Counted):
    """Coverage of a scene's targets by a setup."""

    setup: Setup
    """The rings."""
    scene: Scene
    """Scene of the count."""
    each: tuple[Verified, ...]
    """One record for each target, with its poses."""
    name: str = "setup"
    """Name of the setup as the caller gave it."""
    objects: tuple[SmallestObject | None, ...] = ()
    """The largest unseen objects of each target; None where they were not asked for."""
    verifier: Verifier = field(kw_only=True, compare=False)
    """The counter."""

    @property
    def low(self) -> float:
        """Lower end of the guaranteed interval of the mean over the targets, in [0, 1]; the mean
        itself for a count.
        """
        return self._mean("low")

    @property
    def high(self) -> float:
        """Upper end of that interval, in [0, 1]."""
        return min(self._mean("high"), 1.0)

    @property
    def by_pose(self) -> tuple[float, ...]:
        """ζ in [0, 1] at each pose, the weighted mean over the targets."""
        weights = self.scene.goal_weights
        return tuple(
            float(sum(w * v.poses[i].zeta for w, v in zip(weights, self.each, strict=True)))
            for i in range(len(self.scene.poses))
        )

    @cached_property
    def records(self) -> tuple[Verified, ...]:
        """Records that ``place-rings verify --json`` prints: one for each target, in percent, under
        all occlusion models, with the sensors that cover almost nothing.
        """
        from .reporting.comparison import counted

        core = self.scene
        targets = [goal.target for goal in core.targets]
        known = {(self.name, v.target): v for v in self.each}
        records = counted(self.verifier, {self.name: self.setup}, targets, targets, known)
        effects = calibration_effect(self.verifier, self.setup)
        sensors, moved = sensor_records(self.setup), lifted(self.setup)
        return tuple(
            replace(
                record, sensors=sensors, lifted=moved, calibration=effect, smallest_object=largest
            )
            for record, effect, largest in zip_longest(records, effects, self.objects)
        )

    def plot_by_pose(self, path: str | PathLike[str] | None = None) -> Picture:
        """Draw ζ at each pose, over the time of a motion or pose by pose.

        Args:
            path: path of a PNG file to write as well, or None.

        Raises:
            InputError: if the scene has one pose, or the file cannot be written.

        Example:
            >>> import place_rings as pr
            >>> poses = [[0, -1.57, elbow, 0, 1.57, 0] for elbow in (0.5, 1, 1.5)]
            >>> coverage = pr.verify("n1_8_0", pr.Scene(poses=poses), voxel=0.1)
            >>> coverage.plot_by_pose().png[1:4]
            b'PNG'
        """
        from .reporting.plot_by_pose import plot_by_pose

        if len(self.scene.poses) < 2:
            raise InputError("found one pose, allowed: several", "poses")
        named = [replace(v, setup=self.name) for v in self.each]
        file = None if path is None else Path(path)
        return drawn(lambda to: plot_by_pose(named, self.scene, to), file)

    def __float__(self) -> float:
        return self.coverage

    def _mean(self, key: str) -> float:
        weights = self.scene.goal_weights
        return float(sum(w * getattr(v, key) for w, v in zip(weights, self.each, strict=True)))


@dataclass(frozen=True)
class VerifyCall(VerifyOptions, SetupCall):
    """A call of ``verify``."""

    detect: Detection | None = field(default=None, kw_only=True)
    """Count also the expected share in which a test piece is detected in time."""
    certificate: str | PathLike[str] | None = field(default=None, kw_only=True)
    """With ``rule`` certified: file for a certificate (.npz) from which others can derive the
    interval again."""
    progress: Callable[[Any], None] | None = field(default=None, kw_only=True)
    """Receives the index of each pose before the pose is counted; with ``rule`` certified the
    interval after each pass. With several ``workers`` it receives the index of each pose that is
    counted."""

    def __post_init__(self) -> None:
        """Raise InputError for values out of range, or a rule that cannot count detection."""
        super().__post_init__()
        check_question(self.detect)
        if self.detect is not None and self.rule == "touch":
            line = "found touch, allowed with detect: sampled, centre, certified"
            raise InputError(line, "rule", others=("detect",))
        if self.certificate is not None and not self.certified:
            line = f"found {self.certificate}, allowed: only with rule certified"
            raise InputError(line, "certificate", others=("rule",))


def counted(call: VerifyCall) -> Coverage:
    """Return the coverage as ``verify`` does, in the active processes, and write no certificate."""
    name, placed, core = resolve_setup(call.setup, call.scene)
    voxel = call.voxel
    if not call.certified:
        voxel = VOXEL if voxel is None else voxel
        check_scene(core, voxel)
    calls = dict[str, Any]()
    if call.progress is not None:
        calls["tell" if call.certified else "at"] = call.progress
        if active_workers() > 1:  # other processes tell of poses only
            calls["at"] = call.progress
    memory = None if call.memory is None else call.memory * 1e9
    keep = call.certificate is not None
    verifier = Verifier(core, voxel, call.rule, call.share, memory=memory, keep=keep, **calls)
    with input_errors():
        if keep:
            certified_shapes(core, placed)  # refuses others before the work
        each = tuple(verifier.verify(placed, goal.target) for goal in core.targets)
        if (question := call.detect) is not None:
            each = tuple(
                replace(v, detection=detected(verifier, placed, v.target, question)) for v in each
            )
        objects = smallest_objects(core, placed, voxel or VOXEL, call, verifier.at)
    return Coverage(placed, core, each, name, objects, verifier=verifier)


def proof_of(coverage: Coverage) -> bytes:
    """Return the certificate of a coverage that was counted with one."""
    shapes = certified_shapes(coverage.scene, coverage.setup)
    return certificate(coverage.scene, shapes, coverage.each)


@renamed(memory_gb="memory")
@called_with(VerifyCall)
def verify(call: VerifyCall) -> Coverage:
    """Count the coverage of a setup, with the error of the count, or compute an interval that is
    guaranteed to hold it.

    Returns:
        ζ for each target and pose, and its error.

    Raises:
        InputError: for a setup that does not fit the scene, or voxels so small that the count would
            take days.

    Example:
        >>> import place_rings as pr
        >>> pr.verify("n2_16_25", pr.Scene(targets=[pr.Shell(0.5)]), voxel=0.02)
        Coverage of n2_16_25: 80 sensors in 5 rings
          V_S(0.5): 39.89 ± 0.24 %
        >>> hand = pr.verify("n1_8_0", voxel=0.1, detect=pr.Detection("hand")).each[0].detection
        >>> 0 < hand.assumed_low <= hand.zeta <= hand.assumed_high < 1
        True
    """
    with PoseWorkers(call.workers or 1):
        coverage = counted(call)
    if call.certificate is not None:
        with input_errors():
            write_bytes(Path(call.certificate), proof_of(coverage))
    return coverage


def certify(
    setup: SetupLike,
    scene: Scene | None = None,
    *,
    width: float | None = None,
    voxel: float | None = None,
    progress: Callable[[Bracket], None] | None = None,
) -> Coverage:
    """Compute an interval that provably contains the coverage: ``verify`` by the rule certified.

    Args:
        setup, scene: as in ``verify``.
        width: largest width of the interval, percentage points; 0.1 by default.
        voxel: side of the smallest cells, m, in place of a width.
        progress: receives the interval after each pass.

    Returns:
        The coverage with ``low`` and ``high`` in [0, 1], which account for rounding errors.

    Raises:
        InputError: as in ``verify``, or for a width out of range.

    Example:
        >>> import place_rings as pr
        >>> proof = pr.certify("n1_8_0", pr.Scene(targets=[pr.Shell(0.5)]), width=1.0)
        >>> proof.low <= 0.1255 <= proof.high, proof.high - proof.low <= 0.01
        (True, True)
    """
    return verify(setup, scene, rule="certified", width=width, voxel=voxel, progress=progress)
