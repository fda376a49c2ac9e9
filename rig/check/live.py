"""A check on a real or simulated rig: connect, move or guide the robot, and record."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from ...coverage.definitions.errors import UserError
from ...coverage.rings.ring import Setup
from ...coverage.rings.rounding import rounded
from ...formats.firmware.ring_pace import RingPace
from ...formats.schema.proposal_models import ProposalFile
from ...objectives.scene import Scene
from ..recording.recording import Recording
from ..rings.line_monitor import BAUD, Port
from ..robot.link import START
from ..robot.state import JOINTS, State, not_running
from ..robot.vetting import LinkFaultError
from ..rod.rod import Rod
from ..session.session import Session
from ..simulated.process import SimulatedRig, SimulationError
from ..simulated_cell.cell import simulated_rig, with_cell
from .actors import GuidedRobot, Helper, MovedRobot, SimulatedHelper
from .arm_calibration import ArmKinematics, arm_kinematics
from .attendant import Attendant
from .check_data import CheckData
from .options import CheckOptions
from .planned_check import PlannedCheck
from .plans import Plans
from .preconditions import require_known_cell, require_revolute
from .procedure import Operator, run
from .readiness import Readiness
from .timing_check import scheduled_paces

# factor on time limits: a simulated rig shares the machine with the check
_REAL, _SIMULATED = 1.0, 100.0


@dataclass(frozen=True)
class LiveCheck:
    """A check of a setup on a rig."""

    name: str
    """Name of the setup, for display."""
    setup: Setup
    """The rings, rounded as in the proposal's file."""
    scene: Scene
    """The scene; for a simulated rig with its cell."""
    options: CheckOptions
    """What to do."""
    host: str | None
    """Name or address of the robot's controller; None starts a simulated rig."""
    warnings: tuple[str, ...] = ()
    """Why the kinematics of the scene may not be those of the arm."""
    paces: tuple[RingPace, ...] = ()
    """When each ring sends frames by the firing schedule; none: no schedule is expected."""

    @staticmethod
    def of(
        name: str, setup: Setup, scene: Scene, options: CheckOptions, host: str | None
    ) -> "LiveCheck":
        """Create a check and verify that it may run; read the calibration of a real arm.

        Raises:
            UserError: if ur-rtde does not support the robot, or the robot shall move in a cell that
                is not completely described, or the controller's arm is another robot or, if it
                shall move, not known; or if no firmware keeps the firing schedule.
        """
        scene = with_cell(scene) if host is None else scene
        require_revolute(scene.robot)
        if len(scene.robot.chain) != JOINTS:
            raise UserError(
                f"check: robot {scene.robot.name} has {len(scene.robot.chain)} joints; ur-rtde"
                f" supports only robots with {JOINTS}"
            )
        if options.moves:
            require_known_cell(scene)
        arm = ArmKinematics(scene) if host is None else arm_kinematics(scene, host, options.moves)
        setup = rounded(setup, scene.sensor)
        paces = scheduled_paces(setup, scene, options)
        return LiveCheck(name, setup, arm.scene, options, host, arm.warnings, paces)

    @property
    def moved(self) -> bool:
        """Whether the check moves the robot."""
        return self.options.move or self.host is None

    def record(
        self, plans: Plans, ports: Sequence[Port], folder: Path, attendant: Attendant
    ) -> CheckData:
        """Run the plans and record them, in a new file of ``folder``.

        Args:
            plans: what to do.
            ports: of the rings; a simulated rig uses its own instead.
            folder: for the recording.
            attendant: the person at the rig.

        Raises:
            UserError: if the check cannot start.
        """
        with ExitStack() as stack:
            rig = None
            if self.host is None:
                with attendant.working("starting the simulated rig"):
                    rig = stack.enter_context(self._started(folder))
                ports = [
                    Port(name=rig.ring(i), count=r.count, baud=BAUD, patience=_SIMULATED)
                    for i, r in enumerate(self.setup.groups)
                ]
            check = PlannedCheck.read("check", self._planned(plans, ports).header)
            recording = Recording(_free(folder), {"check": check.header})
            session = Session(
                *(rig.address if rig else str(self.host), check.ports, recording),
                limits=self.scene.link,
                patience=self._patience,
                thinned=True,
                robot=self.scene.robot,
            )
            try:
                self._follow(session, check, rig, attendant)
            except KeyboardInterrupt as error:  # before its first step
                session.say("ended", why=str(error) or "interrupted")
            finally:
                session.close()
        return CheckData(check, session.gathered, recording.wall, file=recording.path)

    @property
    def _patience(self) -> float:
        return _SIMULATED if self.host is None else _REAL

    def _started(self, folder: Path) -> SimulatedRig:
        options = self.options
        try:
            where, paces = (options.seed, folder, options.injected), self.paces
            return simulated_rig(self.scene, self.setup, *where, paces)
        except SimulationError as error:
            raise UserError(f"--rig sim: {error}") from error

    def _planned(self, plans: Plans, ports: Sequence[Port]) -> PlannedCheck:
        return PlannedCheck(
            name=self.name,
            proposal=ProposalFile.of(self.setup, self.scene),
            seed=self.options.seed,
            simulated=self.host is None,
            faults=self.options.injected,
            moved=self.moved,
            stale_s=self.scene.link.state_stale * self._patience,
            voxel=self.options.voxel,
            ports=tuple(ports),
            seconds=plans.seconds,
            wave=plans.wave,
            paces=self.paces,
            stops=plans.mount,
            trials=plans.rods,
            version=version("place-rings"),
        )

    def _follow(
        self,
        session: Session,
        check: PlannedCheck,
        rig: SimulatedRig | None,
        attendant: Attendant,
    ) -> None:
        """Run the plans; raise UserError if they cannot start."""
        setup, plans = check.setup, check.plans
        for warning in self.warnings:
            session.say("warning", text=warning)
        state = self._state(lambda: session.link.wait((START + 1) * session.patience))
        moves = self.moved and bool(plans.poses)
        if why := not moves and not_running(state.mode):
            session.say("warning", text=why)
        address = rig.address if rig else str(self.host)
        ready = Readiness(session, check, self.options, attendant, address, rig is None)
        ready.await_rings()
        if moves:
            state = self._state(session.link.latest)  # the rings may have taken long
            ready.require_controllable(state.mode)
        with ExitStack() as stack:
            view = attendant.view(session, setup)
            robot: MovedRobot | GuidedRobot = GuidedRobot(session, view.ask, check.settle_s)
            if moves:
                robot = ready.moved_robot(state.q, view.resume)
                stack.callback(robot.close)
            helper: Helper | SimulatedHelper = Helper(view.ask, setup, moves)
            if rig is not None:
                rod = plans.rods[0].rod if plans.rods else Rod()
                helper = SimulatedHelper(rig, setup, rod)
            stack.enter_context(view)
            before = ready.require_self_check if moves else lambda: None
            deeds = (robot.order, robot.stand, helper.put, helper.wave, view.show)
            run(session, plans, Operator(*deeds), before, [pace.frames for pace in check.paces])

    def _state(self, state: Callable[[], State]) -> State:
        """Return a state; raise UserError if the robot's link has none."""
        try:
            return state()
        except LinkFaultError as fault:
            raise UserError(f"--robot-host {self.host or 'sim'}: {fault}") from fault


def _free(folder: Path) -> Path:
    """Return the first unused name of a recording."""
    return next(
        p for p in (folder / f"recording-{i}.rig" for i in range(1, 100_000)) if not p.exists()
    )
