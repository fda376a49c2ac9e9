"""A check on a real or simulated rig: connect, move or guide the robot, and record."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Protocol

import numpy as np
from jaxtyping import Float

from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import rounded
from ...formats.errors import UserError
from ...formats.schema.proposal_models import ProposalFile
from ...objectives.scene import CoreScene
from ..poses.itinerary import Itinerary
from ..poses.near_stops import NearStops
from ..poses.routes import SLACK, Clearance
from ..recording.recording import Recording
from ..rings.line_monitor import BAUD
from ..robot.link import START
from ..robot.motion import MoveRefusedError
from ..robot.robot_mode import not_running
from ..robot.state import JOINTS, State
from ..robot.vetting import LinkFaultError
from ..rod.rod import Rod
from ..session.gathering import Gathered
from ..session.session import Session
from ..simulated.process import SimulatedRig, SimulationError
from ..simulated_cell.cell import simulated_rig, with_cell
from .actors import (
    Ask,
    GuidedRobot,
    Helper,
    MovedRobot,
    RobotAndHelper,
    SimulatedHelper,
    hurried,
)
from .arm_calibration import ArmKinematics, arm_kinematics
from .findings import differences
from .models import AboutFile, PortModel
from .part_results import part_results
from .plan_files import mount_plan_model, rod_plan_model
from .planned_check import PlannedCheck, ring_names
from .plans import CheckOptions, Part, Plans
from .preconditions import (
    least_near_share,
    require_boards,
    require_free_inputs,
    require_known_cell,
    require_near_stop,
    require_ports,
    require_revolute,
    require_running,
)
from .procedure import EndedError, run
from .records import lines_of
from .stopping import StopBound, bounds_of_route

# factor on time limits: a simulated rig shares the machine with the check
_REAL, _SIMULATED = 1.0, 100.0
_FIRST = 3.0  # s for the first frames of all rings
_STARTING = 20.0  # s for those of a ring that starts: seconds for each of its sensors
_ANSWER = 1.0  # s, for the inputs that another client holds
_HELLO, _LOOK = 2.5, 0.02  # s for the first hello of all rings; s between looks at it


class LiveView(AbstractContextManager["LiveView"], Protocol):
    """Shows a session while it runs, and asks the person at the rig."""

    def show(self, part: Part, done: int, of: int) -> None:
        """Show that ``done`` of ``of`` steps of a part are complete."""
        ...

    def ask(self, words: str) -> bool:
        """Show an instruction and wait for the person.

        Returns:
            True if the person did it, False if they skipped it.

        Raises:
            EndedError: if the person ended the check.
        """
        ...

    def resume(self, words: str) -> bool:
        """Say why the robot was stopped, and ask whether it may go on."""
        ...


class Attendant(Protocol):
    """Interface to the person who runs a check."""

    def working(self, what: str) -> AbstractContextManager[object]:
        """Show what the program is doing meanwhile."""
        ...

    def view(self, session: Session, setup: Setup) -> LiveView:
        """Return the live view of a session."""
        ...

    def show_near_stops(self, stops: NearStops, setup: Setup, scene: CoreScene) -> None:
        """Show how much of the near stop each ring keeps along the route."""
        ...

    def show_stopping(self, bounds: Sequence[StopBound], warning: str | None) -> None:
        """Show how soon the robot stops after each kind of event, and how far it travels."""
        ...

    def confirm(self, scene: CoreScene, plans: Plans, itinerary: Itinerary) -> None:
        """Ask whether a real robot may move; raise UserError unless the answer is yes."""
        ...

    def note(self, text: str) -> None:
        """Show a line."""
        ...

    def alarm(self, text: str) -> None:
        """Warn at once that the robot was not seen to stand still."""
        ...


@dataclass(frozen=True)
class LiveRecord:
    """A check that is complete or ended early."""

    check: PlannedCheck
    """The planned check."""
    gathered: Gathered
    """Data received."""
    file: Path
    """Path of the recording."""


@dataclass(frozen=True)
class _Rig:
    """Addresses of a rig."""

    address: str
    """Address of the robot's controller."""
    ports: Sequence[PortModel]
    """Ports of the rings."""
    simulated: SimulatedRig | None
    """The simulated rig; None for a real one."""


@dataclass(frozen=True)
class LiveCheck:
    """A check of a setup on a rig."""

    name: str
    """Name of the setup, for display."""
    setup: Setup
    """The rings, rounded as in the proposal's file."""
    scene: CoreScene
    """The scene; for a simulated rig with its cell."""
    options: CheckOptions
    """What to do."""
    host: str | None
    """Name or address of the robot's controller; None starts a simulated rig."""
    warnings: tuple[str, ...] = ()
    """Why the kinematics of the scene may not be those of the arm."""

    @staticmethod
    def of(
        name: str, setup: Setup, scene: CoreScene, options: CheckOptions, host: str | None
    ) -> "LiveCheck":
        """Create a check and verify that it may run; read the calibration of a real arm.

        Raises:
            UserError: if ur-rtde does not support the robot, or the robot shall move in a cell that
                is not completely described, or the controller's arm is another robot or, if it
                shall move, not known.
        """
        scene = with_cell(scene) if host is None else scene
        require_revolute(scene.robot)
        if len(scene.robot.chain) != JOINTS:
            raise UserError(
                f"check: robot {scene.robot.name} has {len(scene.robot.chain)} joints; ur-rtde"
                f" supports only robots with {JOINTS}"
            )
        moves = options.move and bool({"mount", "coverage"} & set(options.parts))
        if moves:
            require_known_cell(scene)
        arm = ArmKinematics(scene) if host is None else arm_kinematics(scene, host, moves)
        setup = rounded(setup, scene.sensor)
        return LiveCheck(name, setup, arm.scene, options, host, arm.warnings)

    @property
    def moved(self) -> bool:
        """Whether the check moves the robot."""
        return self.options.move or self.host is None

    def record(
        self, plans: Plans, ports: Sequence[PortModel], folder: Path, attendant: Attendant
    ) -> LiveRecord:
        """Run the plans and record them.

        Args:
            plans: what to do.
            ports: of the rings; a simulated rig uses its own instead.
            folder: for the recording.
            attendant: the person at the rig.

        Raises:
            UserError: if the check cannot start.
        """
        with self._rig(ports, folder, attendant) as rig:
            about = self._about(plans, rig)
            check = PlannedCheck.read("about", about.model_dump(mode="json"))
            file = _free(folder)
            recording = Recording(file, {"check": about.model_dump(mode="json")})
            session = Session(
                *(rig.address, check.ports, recording),
                limits=self.scene.link,
                patience=self._patience,
                thinned=True,
                robot=self.scene.robot,
            )
            try:
                self._follow(session, check, rig, attendant)
            finally:
                session.close()
        return LiveRecord(check, session.gathered, file)

    @property
    def _patience(self) -> float:
        return _SIMULATED if self.host is None else _REAL

    @contextmanager
    def _rig(
        self, ports: Sequence[PortModel], folder: Path, attendant: Attendant
    ) -> Iterator[_Rig]:
        if self.host is not None:
            yield _Rig(self.host, ports, None)
            return
        with ExitStack() as stack:
            with attendant.working("starting the simulated rig"):
                rig = stack.enter_context(_started(self.scene, self.setup, self.options, folder))
            own = [
                PortModel(name=rig.ring(i), count=r.count, baud=BAUD, patience=_SIMULATED)
                for i, r in enumerate(self.setup.groups)
            ]
            yield _Rig(rig.address, own, rig)

    def _about(self, plans: Plans, rig: _Rig) -> AboutFile:
        return AboutFile(
            setup=self.name,
            proposal=ProposalFile.of(self.setup, self.scene),
            seed=self.options.seed,
            injected=rig.simulated is not None,
            faults=self.options.faults,
            moved=self.moved,
            stale_s=self.scene.link.state_stale * self._patience,
            voxel=self.options.voxel,
            ports=list(rig.ports),
            seconds=plans.seconds,
            wave=plans.wave,
            stops=mount_plan_model(plans.mount) if plans.mount else None,
            trials=[rod_plan_model(p) for p in plans.rods],
            version=version("place-rings"),
        )

    def _follow(
        self, session: Session, check: PlannedCheck, rig: _Rig, attendant: Attendant
    ) -> None:
        """Run the plans; raise UserError if they cannot start."""
        setup, plans = check.setup, check.plans
        for warning in self.warnings:
            session.say("warning", text=warning)
        state = self._state(lambda: session.link.wait((START + 1) * session.patience))
        moves = self.moved and bool(plans.poses)
        if why := not moves and not_running(state.mode):
            session.say("warning", text=why)
        self._await_rings(session, rig, attendant)
        if rig.simulated is None:
            self._require_ports(session, [port.name for port in rig.ports])
        if moves:
            state = self._state(session.link.latest)  # the rings may have taken long
        if moves and rig.simulated is None:
            require_boards(setup, session.rings.counts)
            require_running(state.mode)
            require_free_inputs(rig.address, _ANSWER * session.patience)
        with ExitStack() as stack:
            view = attendant.view(session, setup)
            robot: MovedRobot | GuidedRobot = GuidedRobot(session, view.ask)
            if moves:
                robot = self._moved_robot(session, check, rig, state.q, attendant, view.resume)
                stack.callback(robot.close)
            rod = plans.rods[0].rod if plans.rods else Rod()
            helper = (
                Helper(view.ask, setup, moves)
                if rig.simulated is None
                else SimulatedHelper(rig.simulated, setup, rod)
            )
            stack.enter_context(view)
            before = partial(self._require_self_check, session, check, moves)
            run(session, plans, RobotAndHelper(robot, helper, view.show), before)

    def _state(self, state: Callable[[], State]) -> State:
        """Return a state; raise UserError if the robot's link has none."""
        try:
            return state()
        except LinkFaultError as fault:
            raise UserError(f"--robot-host {self.host or 'sim'}: {fault}") from fault

    def _await_rings(self, session: Session, rig: _Rig, attendant: Attendant) -> None:
        """Wait for the first frames of all rings, longer for those that are starting."""
        session.rings.wait(_FIRST * session.patience)
        if rig.simulated is None and (starting := session.rings.starting):
            names = [ring_names(self.setup)[ring] for ring in starting]
            attendant.note(
                f"{', '.join(names)}: starting, no frame in {_FIRST * session.patience:g} s;"
                f" waiting for up to {_STARTING * session.patience:g} s"
            )
            session.say("starting", rings=starting)
            until = time.monotonic() + (_STARTING - _FIRST) * session.patience
            while session.rings.starting and time.monotonic() < until:
                time.sleep(_LOOK)

    def _require_self_check(self, session: Session, check: PlannedCheck, moves: bool) -> None:
        """Raise EndedError if a real robot would move although the self check differs."""
        if self.host is None or not moves or check.plans.seconds is None:
            return
        gathered = session.gathered.snapshot(session.rings.counts)
        only = replace(check, plans=replace(check.plans, mount=None, rods=()))
        done, lines = part_results(only, gathered), lines_of(check.setup, check.ports, gathered)
        if differs := [*done.failures, *differences(check.setup, done, None, (), lines)]:
            if not self.options.differing_self_check:
                raise EndedError(
                    f"the self check differs, so the robot was not moved: {'; '.join(differs)};"
                    " --allow-differing-self-check moves it anyway"
                )
            session.say(
                "warning",
                text="the robot moved although the self check differs"
                " (--allow-differing-self-check)",
            )

    def _require_ports(self, session: Session, devices: Sequence[str]) -> None:
        """Raise UserError if ports are swapped, once the known boards had time to say hello."""
        until = time.monotonic() + _HELLO
        while time.monotonic() < until and any(
            ring.serial and not c.serials
            for ring, c in zip(self.setup.rings, session.rings.counts, strict=False)
        ):
            time.sleep(_LOOK)
        require_ports(self.setup, session.rings.counts, devices)

    def _moved_robot(
        self,
        session: Session,
        check: PlannedCheck,
        rig: _Rig,
        start: Float[np.ndarray, " J"],
        attendant: Attendant,
        resume: Ask,
    ) -> MovedRobot:
        """Return the robot, ready to move, once a person has confirmed; raise UserError if it may
        not move.
        """
        setup, scene = check.setup, check.scene
        if rig.simulated is not None:
            scene = hurried(scene)
        if wrong := Clearance(scene, setup).fault(start, SLACK):
            raise UserError(
                f"--move: the robot cannot start from its present pose: {wrong}; move it to a"
                " clear pose with the pendant"
            )
        with attendant.working("planning the route"):
            itinerary = Itinerary(scene, setup, start, check.plans.poses, check.about.seed)
            stops = itinerary.near_stops()
        attendant.show_near_stops(stops, setup, scene)
        bounds, warning = bounds_of_route(check.scene, setup, stops.joints, self.host is not None)
        attendant.show_stopping(bounds, warning)
        session.say("stopping", seconds=bounds[0].seconds, metres=bounds[0].metres)
        waived = self.options.reduced_near_stop
        if rig.simulated is None:
            require_near_stop(stops, scene, waived)
            attendant.confirm(scene, check.plans, itinerary)
        waived = waived and stops.share < least_near_share(scene)
        session.say("near stop", share=stops.share, waived=waived)
        try:
            ask = resume if rig.simulated is None else None
            return MovedRobot(rig.address, scene, session, itinerary, stops, attendant.alarm, ask)
        except (MoveRefusedError, LinkFaultError) as error:
            raise UserError(f"--move: {error}") from error


def _started(scene: CoreScene, setup: Setup, options: CheckOptions, folder: Path) -> SimulatedRig:
    try:
        return simulated_rig(scene, setup, options.seed, folder, options.faults)
    except SimulationError as error:
        raise UserError(f"--rig sim: {error}") from error


def _free(folder: Path) -> Path:
    """Return the first unused name of a recording."""
    return next(
        p for p in (folder / f"recording-{i}.rig" for i in range(1, 100_000)) if not p.exists()
    )
