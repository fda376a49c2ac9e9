"""A check from files alone: joint states and readings that a rig's own software recorded."""

from importlib.metadata import version

import numpy as np
from jaxtyping import Float

from ...coverage.definitions.errors import UserError
from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import rounded
from ...coverage.robots.joint_values import angles_apart
from ...formats.schema.proposal_models import ProposalFile
from ...objectives.scene import Scene
from ..mount.stop_plan import FRAMES, MountPlan
from ..poses.planned_pose import planned_poses
from ..rings.line_monitor import BAUD, Port
from ..robot.vetting import STALE
from ..rod.trial_plan import RodPlan
from ..sensing.readings import WITHIN
from ..sources.files import FileData, RigFiles, read_files
from ..sources.names import rig_names
from ..sources.standstills import Standstill
from .check_data import CheckData
from .options import CheckOptions, FileOptions
from .planned_check import PlannedCheck, ring_names
from .plans import read_plans
from .preconditions import require_revolute
from .procedure import Span, spans
from .timing_check import scheduled_paces

_LONGEST = 3600.0  # s, of a self check


def file_check(
    name: str, setup: Setup, scene: Scene, from_: FileOptions, options: CheckOptions
) -> CheckData:
    """Read a check from files.

    Without notes of its steps, the self check takes place at the longest standstill of the robot,
    and the stops of the mount check are its standstills.

    Args:
        name: of the setup, for display.
        setup, scene: the setup and its scene.
        from_: the files.
        options: the parts, and how they are counted.

    Raises:
        UserError: if a file cannot be used, or a requested part is not in the files.
    """
    require_revolute(scene.robot)
    setup = rounded(setup, scene.sensor)
    rings = ring_names(setup)
    names = rig_names(setup, scene.robot, rings, from_.names)
    assert from_.joints is not None
    files = RigFiles.of(scene.robot, names.steps, from_.joints, from_.readings, from_.steps)
    data = read_files(files, setup, scene.robot, names, rings)
    check = _Steps(setup, scene, from_, options, data).check(name)
    gathered = data.gathered
    gathered.said.sort(key=lambda note: note[0])
    gathered.said.append((gathered.states[-1].time, {"what": "ended", "why": ""}))
    check = PlannedCheck.read(files.joints.name, check.header)
    return CheckData(check, gathered, gathered.states[0].time)


class _Steps:
    """Completes the steps of a check, and states the plans that they follow."""

    def __init__(
        self,
        setup: Setup,
        scene: Scene,
        from_: FileOptions,
        options: CheckOptions,
        data: FileData,
    ) -> None:
        self._setup, self._scene, self._options, self._data = setup, scene, options, data
        self._name = from_.joints
        self._said = data.gathered.said
        self._spans = spans(self._said)
        self._mount, self._rods = (
            read_plans(scene, options.parts, from_.plan, bool(options.part))
            if from_.plan
            else (None, ())
        )

    def check(self, name: str) -> PlannedCheck:
        """Return the check that a recording would have."""
        parts, setup = self._options.parts, self._setup
        seconds = self._self() if "self" in parts else None
        mount = self._stops() if "mount" in parts and setup.rings else None
        rods = self._trials() if "coverage" in parts else ()
        ports = [
            Port(name=topics, count=group.count, decoder="file", baud=BAUD)
            for group, topics in zip(setup.groups, self._data.topics, strict=True)
        ]
        return PlannedCheck(
            name=name,
            proposal=ProposalFile.of(setup, self._scene),
            seed=self._options.seed,
            simulated=False,
            moved=False,
            stale_s=min(STALE * self._data.gathered.patience, 10.0),
            voxel=self._options.voxel,
            ports=tuple(ports),
            seconds=seconds,
            wave="self" in parts and bool(self._of("wave")),
            paces=scheduled_paces(setup, self._scene, self._options),
            stops=mount,
            trials=rods,
            version=version("place-rings"),
        )

    def _of(self, what: str) -> list[Span]:
        """Return the steps of a kind; of repeated ones the last."""
        last = {s.number: s for s in self._spans if s.what == what}
        return [last[number] for number in sorted(last)]

    def _add(self, what: str, number: int, still: Standstill) -> None:
        note = {"what": "step", "step": what, "number": number}
        self._said.append((still.end, note | {"begin": still.begin, "end": still.end}))

    def _undisturbed(self) -> list[Standstill]:
        """Return the standstills during which no hand or rod was in the way."""
        busy = [s for s in self._spans if s.what in ("wave", "trial")]
        return [
            one
            for one in self._data.still
            if not any(s.begin < one.end and one.begin < s.end for s in busy)
        ]

    def _self(self) -> float:
        """Return the duration of the self check, s."""
        if done := self._of("self"):
            seconds = done[-1].end - done[-1].begin
        elif still := self._undisturbed():
            longest = max(still, key=lambda s: s.end - s.begin)
            self._add("self", 0, longest)
            seconds = longest.end - longest.begin
        else:
            raise UserError(
                f"{self._name}: joint states: found no standstill, wanted: a second or"
                " more in which the robot stands still"
            )
        return min(max(seconds, 1e-3), _LONGEST)

    def _stops(self) -> MountPlan:
        """Return the stops of the mount check: planned, noted, or where the robot stood still."""
        noted, plan = self._of("mount"), self._mount
        if plan is not None:
            held = {span.number for span in noted}
            for still in () if noted else self._undisturbed():
                off = angles_apart(plan.joints, still.q).max(axis=1)
                if off.min() <= WITHIN:
                    held.add(int(off.argmin()))
                    self._add("mount", int(off.argmin()), still)
            for number in sorted(set(range(len(plan.joints))) - held):
                why = "no step in the files" if noted else "no standstill there in the files"
                note = {"what": "skipped", "step": "mount", "number": number, "why": why}
                self._said.append((0.0, note))
            return plan
        if noted:
            self._renumber({s.number: i for i, s in enumerate(noted)})
            poses = [self._pose(s) for s in noted]
        else:
            stood = self._undisturbed()
            for i, one in enumerate(stood):
                self._add("mount", i, one)
            poses = [one.q for one in stood]
        if not poses:
            raise UserError(
                f"{self._name}: joint states: found no standstill, wanted: stops of the mount check"
            )
        joints = self._scene.robot.unwound(np.array(poses))
        nothing = (((0.0,) * 4,) * 4,) * len(self._setup.rings)
        return MountPlan(FRAMES, planned_poses(joints), nothing)

    def _renumber(self, numbers: dict[int, int]) -> None:
        """Number the noted stops consecutively."""
        for _, note in self._said:
            if note.get("what") == "begin" and note.get("step") == "mount":
                note["number"] = numbers.get(note["number"], -1)

    def _pose(self, span: Span) -> Float[np.ndarray, " J"]:
        """Return the median joint angles (J,) rad during a step."""
        states = self._data.gathered.states
        here = [s.q for s in states if span.begin <= s.time <= span.end]
        if not here:
            raise UserError(
                f"{self._name}: mount {span.number}: found no joint states between"
                f" {span.begin:.3f} and {span.end:.3f} s, wanted: some in each step"
            )
        pose: np.ndarray = np.median(here, axis=0)
        return pose

    def _trials(self) -> tuple[RodPlan, ...]:
        """Return the plans of the trials, if the files hold some."""
        if self._of("trial") and self._rods:
            return self._rods
        lack = "found no steps `trial N`" if self._rods else "no --plan FOLDER with its trials"
        if self._options.part:
            raise UserError(f"check: --part coverage: {lack}, wanted: a plan and its steps")
        text = f"coverage check: left out: {lack}"
        self._said.append((0.0, {"what": "warning", "text": text}))
        return ()
