"""The command that checks a proposed setup on a rig, real, simulated or recorded."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
from jaxtyping import Float
from pydantic import ValidationError

from ..coverage.rings.ring import Setup
from ..coverage.rings.rounding import rounded
from ..formats.convert.scenes import ring_models, scene_model
from ..formats.errors import UserError, explain
from ..formats.schema.proposal_models import ProposalFile
from ..formats.writing import output_folder
from ..objectives.scene import Scene
from ..reporting.terminal import Terminal, say
from ..rig.check_models import AboutFile, PortModel
from ..rig.checked import Checked
from ..rig.judge import judge
from ..rig.listening.gathering import replay
from ..rig.listening.session import Session
from ..rig.mount.plan import FRAMES, planned
from ..rig.operators import (
    Crew,
    GuidedRobot,
    Helper,
    Itinerary,
    MovedRobot,
    SimulatedHelper,
    hurried,
)
from ..rig.plan_files import mount_plan_model, rod_plan_model, write_mount_plan, write_rod_plan
from ..rig.poses.routes import SLACK, Clearance
from ..rig.procedure import Part, Plans, run
from ..rig.recording.recording import Recording, RecordingReader
from ..rig.rings.health import BAUD
from ..rig.robot.link import START
from ..rig.robot.motion import MoveRefusedError
from ..rig.robot.state import JOINTS
from ..rig.robot.vetting import STALE, LinkFaultError
from ..rig.rod.page import write_rod_pages
from ..rig.rod.plan import plan_rod
from ..rig.rod.rod import Rod
from ..rig.simulated.process import SimulatedRig, SimulationError
from ..rig.simulated_cell.cell import simulated_rig, with_cell
from .check_before import EXEMPT, confirm, require_known_cell, require_near_stop, show_near_stops
from .check_page import write_files
from .check_talk import tell
from .check_view import View
from .pipes import ended_by_signals, gone_is_an_error
from .rig_options import ring_names

# patience: a real rig's limits of time hold, a simulated one shares its machine
_REAL, _SIMULATED = 1.0, 100.0
_FIRST = 3.0  # s, for the rings to be heard
_LAST = 1e11  # s since 1970, that a time can be


@dataclass(frozen=True)
class Asked:
    """What is to be done: parts, s of the self check, whether a hand is passed over the sensors,
    stops, trials, the rod, whether the robot may be moved, also where most sensors keep no near
    stop, side of a voxel m, seed."""

    parts: tuple[Part, ...]
    seconds: float
    wave: bool
    stops: int
    trials: int
    rod: Rod
    move: bool
    reduced_near_stop: bool
    voxel: float
    seed: int


def check_live(
    name: str,
    setup: Setup,
    scene: Scene,
    asked: Asked,
    host: str | None,
    ports: Sequence[PortModel],
    out: Path,
    as_json: bool,
) -> int:
    """Check ``setup`` on the robot at ``host`` and the rings at ``ports``; on a simulated rig where
    ``host`` is None.

    Returns:
        the exit code of the verdict.
    """
    console, patience = Terminal(stderr=True), _SIMULATED if host is None else _REAL
    if host is None:
        scene = with_cell(scene)
        console.print(EXEMPT, highlight=False, soft_wrap=True)
    if len(scene.robot.chain) != JOINTS:
        raise UserError(
            f"check: found robot {scene.robot.name}, allowed: one of {JOINTS} joints, as ur-rtde"
            " knows no other"
        )
    setup, moved = rounded(setup, scene.sensor), asked.move or host is None
    if asked.move and {"mount", "coverage"} & set(asked.parts):
        require_known_cell(scene)
    with console.status("planning"):
        plans = _plans(setup, scene, asked, moved)
    folder = output_folder(out)
    files = _write_plans(scene, plans, folder)
    with ExitStack() as stack:
        stack.enter_context(gone_is_an_error())
        stack.enter_context(ended_by_signals())
        rig = None
        if host is None:
            with console.status("starting the simulated rig"):
                rig = stack.enter_context(_started(scene, setup, asked.seed, folder))
            ports = [
                PortModel(name=rig.ring(i), count=r.count, baud=BAUD, patience=_SIMULATED)
                for i, r in enumerate(setup.rings)
            ]
        about = AboutFile(
            setup=name,
            proposal=ProposalFile(rings=ring_models(setup, scene.sensor), scene=scene_model(scene)),
            seed=asked.seed,
            injected=rig is not None,
            moved=moved,
            stale_s=STALE * patience,
            voxel=asked.voxel,
            ports=list(ports),
            seconds=plans.seconds,
            wave=plans.wave,
            stops=mount_plan_model(plans.mount) if plans.mount else None,
            trials=[rod_plan_model(p) for p in plans.rods],
            version=version("place-rings"),
        )
        checked = Checked.of(_read_about("about", about.model_dump(mode="json")))
        file = _free(folder)
        recording = Recording(file, {"check": about.model_dump(mode="json")})
        session = Session(host or _of(rig).address, checked.ports, recording, patience=patience)
        try:
            _work(session, checked, rig, asked, host, console)
        finally:
            session.close()
    try:
        with console.status("judging"):
            judged = judge(checked, session.gathered, _wall(RecordingReader(file)))
        return tell(
            judged, [*write_files(checked, judged, folder), *files, file.name], folder, as_json
        )
    except KeyboardInterrupt:
        say(f"place-rings: interrupted; {file} is whole, and check --replay judges it", error=True)
        raise SystemExit(130) from None


def check_replay(subject: str | None, path: Path, out: Path, as_json: bool) -> int:
    """The report of a recording, anew, and the exit code of its verdict. ``subject``: what it must
    be of.
    """
    recorded = RecordingReader(path)
    checked = Checked.of(_read_about(str(path), recorded.about.get("check")))
    if subject is not None and subject != checked.about.setup:
        raise UserError(
            f"{path}: found a recording of {checked.about.setup}, allowed: one of {subject}"
        )
    folder = output_folder(out)
    with Terminal(stderr=True).status("judging"):
        gathered = replay(recorded, checked.ports, checked.about.stale_s)
        judged = judge(checked, gathered, _wall(recorded), recorded.damage)
    return tell(judged, write_files(checked, judged, folder), folder, as_json)


def _read_about(name: str, found: object) -> AboutFile:
    try:
        return AboutFile.model_validate(found)
    except ValidationError as error:
        raise explain(name, error, AboutFile) from error


def _wall(recorded: RecordingReader) -> float:
    """When it was recorded, s since 1970; 0 where that is not told."""
    found = recorded.about.get("wall")
    return found if isinstance(found, float) and 0 <= found < _LAST else 0.0


def _started(scene: Scene, setup: Setup, seed: int, folder: Path) -> SimulatedRig:
    try:
        return simulated_rig(scene, setup, seed, folder)
    except SimulationError as error:
        raise UserError(f"--rig sim: {error}") from error


def _of(rig: SimulatedRig | None) -> SimulatedRig:
    assert rig is not None
    return rig


def _free(folder: Path) -> Path:
    """The first name of a recording that is free."""
    return next(
        p for p in (folder / f"recording-{i}.rig" for i in range(1, 100_000)) if not p.exists()
    )


def _plans(setup: Setup, scene: Scene, asked: Asked, moved: bool) -> Plans:
    """What is to be done. The trials are shared evenly among the targets."""
    good, targets = (
        Clearance(scene, setup).of if moved else None,
        [goal.target for goal in scene.goals],
    )
    each = -(-asked.trials // len(targets))
    try:
        return Plans(
            asked.seconds if "self" in asked.parts else None,
            (
                planned(scene, setup, asked.stops, FRAMES, seed=asked.seed, good=good)
                if "mount" in asked.parts
                else None
            ),
            tuple(
                plan_rod(scene, setup, t, each, asked.rod, seed=asked.seed)
                for t in targets
                if "coverage" in asked.parts
            ),
            asked.wave,
        )
    except ValueError as error:
        raise UserError(f"check: {error}") from error


def _write_plans(scene: Scene, plans: Plans, folder: Path) -> list[str]:
    files = []
    if plans.mount is not None:
        write_mount_plan(folder / "stops.toml", plans.mount)
        files.append("stops.toml")
    for plan in plans.rods:
        radius = "" if plan.target.radius is None else f"-{plan.target.radius:g}"
        files.append(f"trials-{plan.target.name}{radius}.toml")
        write_rod_plan(folder / files[-1], plan)
    if plans.rods:
        write_rod_pages(folder / "trials.pdf", scene, plans.rods)
        files.append("trials.pdf")
    return files


def _work(
    session: Session,
    checked: Checked,
    rig: SimulatedRig | None,
    asked: Asked,
    host: str | None,
    console: Terminal,
) -> None:
    """Do what is planned; UserError where it cannot begin."""
    setup, plans = checked.setup, checked.plans
    try:
        start = session.link.wait((START + 1) * session.patience).q
    except LinkFaultError as fault:
        raise UserError(f"--robot-host {host or 'sim'}: {fault}") from fault
    session.rings.wait(_FIRST * session.patience)
    ranges = [r.sensor.range_m for r in setup.rings]
    moves = checked.about.moved and bool(plans.parts)
    with ExitStack() as stack:
        view = View(session, ring_names(setup), ranges, console)
        robot: MovedRobot | GuidedRobot = GuidedRobot(session, view.ask)
        if moves:
            robot = _moved_robot(session, checked, rig, asked, host, start, console)
            stack.callback(robot.close)
        rod = plans.rods[0].rod if plans.rods else Rod()
        helper = (
            Helper(view.ask, ring_names(setup), moves)
            if rig is None
            else SimulatedHelper(rig, setup, rod)
        )
        stack.enter_context(view)
        run(session, plans, Crew(robot, helper, view.show))


def _moved_robot(
    session: Session,
    checked: Checked,
    rig: SimulatedRig | None,
    asked: Asked,
    host: str | None,
    start: Float[np.ndarray, " J"],
    console: Terminal,
) -> MovedRobot:
    """The robot, ready to be moved, once a person has said yes; UserError where it may not be."""
    scene, setup = checked.scene if rig is None else hurried(checked.scene), checked.setup
    if wrong := Clearance(scene, setup).fault(start, SLACK):
        raise UserError(
            f"--move: the robot stands where nothing may begin: {wrong}; bring it to a clear pose"
        )
    with console.status("planning the route"):
        itinerary = Itinerary(scene, setup, start, checked.plans.parts, checked.about.seed)
        stops = itinerary.near_stops()
    show_near_stops(stops, setup, scene, console)
    if rig is None:
        require_near_stop(stops, scene, asked.reduced_near_stop)
        confirm(scene, checked.plans, itinerary, console)
    session.say(
        "near stop",
        share=stops.share,
        waived=asked.reduced_near_stop and stops.share < scene.motion.near_share,
    )
    try:
        return MovedRobot(
            host or _of(rig).address,
            scene,
            session,
            itinerary,
            lambda text: say(f"ATTENTION: {text}", error=True),
        )
    except (MoveRefusedError, LinkFaultError) as error:
        raise UserError(f"--move: {error}") from error
