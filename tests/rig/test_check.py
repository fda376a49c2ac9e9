"""The check as a whole, from a recording made in simulated time; and what it refuses."""

import io
import re
import signal
import time
from collections import Counter
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from unittest.mock import MagicMock, Mock

import numpy as np
import pytest
from place_rings.formats.loader import read_proposal
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.writing import to_toml
from place_rings.objectives.link_limits import USUAL_LIMITS, LinkLimits
from place_rings.objectives.motion_limits import Motion
from place_rings.reporting.terminal import Terminal
from place_rings.rig.check import live, readiness
from place_rings.rig.check import plans as check_plans
from place_rings.rig.check.actors import MovedRobot
from place_rings.rig.check.assessment import assess
from place_rings.rig.check.attendant import Attendant
from place_rings.rig.check.models import CheckResult
from place_rings.rig.check.options import CheckOptions
from place_rings.rig.check.planned_check import PlannedCheck
from place_rings.rig.check.plans import Plans, plan_check
from place_rings.rig.check.preconditions import (
    require_boards,
    require_known_cell,
    require_near_stop,
)
from place_rings.rig.check.procedure import EndedError, Operator, run, skipped, spans
from place_rings.rig.check.readiness import Readiness
from place_rings.rig.check.records import warnings_of
from place_rings.rig.check.report import write_files
from place_rings.rig.poses.near_stops import NOBODY, NearStops, by_ring, near_stops
from place_rings.rig.recording.recording import Recording, RecordingReader
from place_rings.rig.rings.line_monitor import Event, Happened, Port
from place_rings.rig.rings.ports import RingReaders
from place_rings.rig.rings.protocol import Counts, encode
from place_rings.rig.robot.state import RobotMode, State
from place_rings.rig.rod.trial_plan import RodPlan
from place_rings.rig.session.gathering import Gathered
from place_rings.rig.session.session import Session
from place_rings.rig.simulated.process import SimulatedRig

from ..support.refusals import refused
from .cell import SETUP
from .cell import SHELLS as SCENE
from .commands import call, result_of
from .still import checked_still
from .tape import Tape, assessed, record, recording_of

PROPOSAL = to_toml(ProposalFile.of(SETUP, SCENE))


def files_of(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir()}


@contextmanager
def retold(file, checked):
    """A tape of the check; its self check is done."""
    with recording_of(file, checked) as recording:
        tape = Tape(recording, checked)
        tape.stand(SCENE.poses[0].q, "self", 0, 20)
        yield tape


def test_what_was_injected_is_found(taped):
    checked, r = taped.checked, taped.found.result
    assert (r.verdict, r.warnings) == ("differs", [])
    assert r.mount.injected_found == dict.fromkeys(
        ("reversed ring", "swapped pair", "dead sensor"), True
    )
    assert r.mount.stops == 10
    for one in r.mount.rings:
        assert all(abs(e.value - e.injected) < 2.5 * e.margin for e in one.errors)
    assert len(r.self_check.silent) == 1
    waved = [np.nan if w is None else w for one in r.self_check.waved for w in one.seats]
    seat = checked.injected.seat
    seats = np.concatenate([np.arange(n.count) for n in SETUP.rings]).astype(float)[seat]
    np.testing.assert_array_equal(waved, np.where(seat < 0, np.nan, seats))
    assert not any(one.missed for one in r.self_check.waved)
    for word in ("hand", "dead"):
        assert any(word in reason for reason in r.reasons)
    assert [(c.named, c.trials) for c in r.coverage] == [("V_S(0.25)", 12), ("V_S(0.2)", 8)]
    assert all(c.low_percent <= c.measured_percent <= c.high_percent for c in r.coverage)
    assert [line.frames for line in r.lines] == [r.lines[0].frames] * 2
    assert abs(r.lines[0].drift_ppm) < 1
    CheckResult.model_validate_json(r.model_dump_json())


def test_a_check_that_was_cut_off_is_unfinished_and_what_was_done_is_judged(taped, tmp_path):
    data = taped.file.read_bytes()
    (tmp_path / "torn").write_bytes(data[: len(data) * 2 // 5 + 7])
    r = assessed(tmp_path / "torn", taped.checked).result
    assert (r.verdict, r.coverage, len(r.warnings)) == ("unfinished", [], 1)
    assert r.self_check is not None
    assert any("cut off" in reason for reason in r.reasons)
    assert any("coverage check" in reason for reason in r.reasons)
    (tmp_path / "early").write_bytes(data[:20_000])
    r = assessed(tmp_path / "early", taped.checked).result
    assert (r.verdict, r.mount) == ("unfinished", None)


def test_a_self_check_that_was_killed_is_judged_by_what_it_read(taped, tmp_path):
    with recording_of(tmp_path / "kill", taped.checked) as recording:
        tape = Tape(recording, taped.checked)
        tape.say = lambda what, *args, **more: (
            Tape.say(tape, what, *args, **more) if what == "begin" else None
        )
        tape.stand(SCENE.poses[0].q, "self", 0, 20)
    r = assessed(tmp_path / "kill", taped.checked).result
    assert r.verdict == "unfinished"
    (reason,) = [reason for reason in r.reasons if "self check" in reason]
    assert "0.9 of 1 s" in reason
    assert len(r.self_check.silent) == 1
    assert all(ring.frames >= 18 for ring in r.self_check.rings)


def test_stops_that_were_not_read_are_listed_with_the_reason(taped, tmp_path):
    why = {2: "no way", 5: "no way", 3: "by the person"}
    with retold(tmp_path / "few", taped.checked) as tape:
        for i, q in enumerate(taped.checked.plans.mount.joints[:8]):
            if i in why:
                tape.say("skipped", tape.now, step="mount", number=i, why=why[i])
            else:
                tape.stand(q, "mount", i, 8)
        tape.say("ended", tape.now, why="")
    reasons = assessed(tmp_path / "few", taped.checked).result.reasons
    (line,) = [reason for reason in reasons if "5 of 10 stops" in reason]
    parts = ("2, 5: no way", "3: by the person", "8, 9: ")
    assert [part for part in parts if part not in line] == []


def test_a_rig_without_errors_and_faults_is_as_proposed(taped, tmp_path):
    record(tmp_path / "fine.rig", replace(taped.checked, faults="none"))
    out = tmp_path / "out"
    assert call("check", "--replay", tmp_path / "fine.rig", "--out", out) == 0
    result = result_of(out)
    assert (result.verdict, result.reasons, result.faults) == ("as proposed", [], "none")


def test_the_procedure_says_why_it_skips_a_stop(taped):
    session, stand = Mock(spec=Session), lambda q, words: words[5] == "3"
    operator = Operator(lambda joints: [3, 1], stand, Mock(), Mock(), Mock())
    session.trouble, session.patience = "", 0.0
    session.rings = Mock(spec=RingReaders, counts=[Counts()])
    said = []
    session.say = lambda what, **more: said.append((0.0, {"what": what, **more}))
    mount = taped.checked.plans.mount
    run(session, Plans(None, replace(mount, stops=mount.stops[:4])), operator)
    assert [s.number for s in spans(said)] == [3]
    why = skipped(said, "mount")
    assert why.keys() == {0, 1, 2}
    assert why[0] == why[2] != why[1]


def test_a_recording_that_says_what_cannot_be_is_judged_by_the_rest(taped, tmp_path):
    odd = {"mount": (99, -1), "wave": (7,), "trial": (500,), "before": (9,), "dance": (1,)}
    with retold(tmp_path / "odd", taped.checked) as tape:
        for step, numbers in odd.items():
            for number in numbers:
                tape.stand(SCENE.poses[0].q, step, number, 2)
        tape.say("link ended", tape.now, why="BORED")
    r = assessed(tmp_path / "odd", taped.checked).result
    assert (r.verdict, r.mount, r.robot.ended) == ("unfinished", None, "BORED")
    assert r.self_check is not None


def test_a_recording_of_something_else_is_refused(taped, tmp_path):
    wrong = taped.checked.header
    wrong["ports"] = wrong["ports"][:1]
    odd, out = tmp_path / "odd.rig", tmp_path / "out"
    for about, parts in (({"check": wrong}, ("ports", "[8]", "[8, 6]")), ({"rings": 2}, ())):
        with Recording(odd, about):
            pass
        with refused("odd.rig", *parts):
            call("check", "--replay", odd, "--out", out)
        odd.unlink()
    with refused("small.toml", "other"):
        call("check", "other", "--replay", taped.file, "--out", out)
    assert not out.exists()


def test_steps_that_were_not_ended_are_none():
    def begin(time, step, number):
        return time, {"what": "begin", "step": step, "number": number}

    said = [begin(1.0, "mount", 4), (2.0, {"what": "end"}), (3.0, {"what": "end"})]
    said += [begin(4.0, "trial", 0), begin(5.0, "trial", 1)]
    assert spans(said) == [("mount", 4, 1.0, 2.0)]
    assert spans([*said, (6.0, {"what": "end"})])[1:] == [("trial", 1, 5.0, 6.0)]


@pytest.mark.slow
def test_a_replay_gives_the_same_files_every_time(taped, tmp_path):
    """As the first assessment did."""
    assert call("check", "--replay", taped.file, "--out", tmp_path / "a") == 1
    (tmp_path / "b").mkdir()
    write_files(taped.checked, taped.found, tmp_path / "b")
    first = files_of(tmp_path / "a")
    assert first == files_of(tmp_path / "b")
    pictures = {f"check-{name}.png" for name in ("rings", "readings", "trials-0", "trials-1")}
    texts = {"check.html", "check.json", "stops.csv", "trials.csv", "built.toml"}
    assert set(first) == texts | pictures
    assert first["check.html"].count(b'src="data:image/png') == len(pictures)
    setup, scene, _ = read_proposal(tmp_path / "a" / "built.toml")
    assert (len(setup.rings), len(scene.obstacles)) == (2, 3)


H, R = "--robot-host h", "--replay x"


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        ("", ("--rig", "--robot-host", "--replay", "--joints")),
        ("--rig sim --replay x", ("--rig", "--replay")),
        ("--robot-host ", ("--robot-host",)),
        ("--rig sim --move", ("--move", "--robot-host")),
        (f"{R} --stops 8", ("--stops", "--replay")),
        (f"{R} --radius 0.5", ("--radius", "--replay")),
        (f"{R} --seed 5", ("--seed", "--replay")),
        (f"{R} --voxel 0.05", ("--voxel", "--replay")),
        (f"{R} --part self", ("--part", "--replay")),
        ("--joints x --rod-mm 9x90", ("--rod-mm", "--joints")),
        ("--joints x --wave", ("--wave", "--joints")),
        (H, ("--ring", "forearm, tool")),
        (f"{H} --ring tool", ("--ring", "NAME=PORT")),
        (f"{H} --ring hand=/dev/x", ("hand", "forearm, tool")),
        (f"{H} --ring 0=/dev/x --ring forearm=/dev/y", ('"forearm"', "tool")),
        (f"{H} --ring tool=/dev/x,morse", ("place-rings, esp32, text",)),
        (f"{H} --ring 0=gone --ring tool=gone", ("--ring forearm", '"gone"')),
        (f"{H} --ring 0=/dev/null --ring tool=/dev/./null", ("--ring tool", "/dev/./null")),
        (f"{H} --allow-reduced-near-stop", ("--allow-reduced-near-stop", "--move")),
        (f"{H} --allow-differing-self-check", ("--allow-differing-self-check", "--move")),
        (f"{H} --injected none", ("--injected", "--rig sim")),
        ("--rig sim --rod-mm 370x70", ("THICKNESSxLENGTH",)),
        ("--rig sim --part mount --wave", ("--wave", "--part self")),
        ("--rig sim --target V_S --radius 0.1", ("--radius", "0.1", "0.15")),
        ("--replay small.toml", ("small.toml",)),
        ("--joints a --rig sim", ("--rig", "--joints")),
        ("--joints a --move", ("--move", "--robot-host")),
        ("--joints a --ring tool=b", ("--ring", "--robot-host")),
        ("--rig sim --readings a", ("--readings", "--joints")),
        ("--rig sim --map a=b", ("--map", "--joints")),
        ("--plan-only --plan a", ("--plan", "--joints")),
        ("--plan-only --part self", ("--plan-only", "--part self")),
        ("--joints a.csv", ("a.csv",)),
        ("--joints a.mcap", ("a.mcap",)),
        ("--dry-run --bag", ("--bag", "--rig sim", "--robot-host", "--replay")),
        ("--plan-only --bag", ("--bag",)),
        ("--joints rig.mcap --bag", ("--bag",)),
        ("--rig sim --dry-run", ("--rig", "--dry-run")),
        (f"{R} --scheduled", ("--scheduled", "--replay")),
        ("--rig sim --part mount --scheduled", ("--scheduled", "--part self")),
        ("--plan-only --scheduled", ("--scheduled", "--plan-only")),
        ("--dry-run --scheduled", ("--scheduled", "--dry-run")),
        ("--rig sim --injected late", ("--injected", "--scheduled")),
        ("--rig sim --no-browser", ("--no-browser", "--dry-run")),
    ],
)
def test_options_that_do_not_fit_are_refused(tmp_path, monkeypatch, words, parts):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(PROPOSAL)
    before = files_of(tmp_path)
    subject = [] if words == "--replay small.toml" else ["small.toml"]
    with refused(*parts):
        call("check", *subject, *words.split(" ") if words else ())
    assert files_of(tmp_path) == before


def proposal(motion, obstacles, link=USUAL_LIMITS):
    """A proposal in a scene with such a motion, cell and limits, as TOML."""
    scene = replace(SCENE, motion=motion, obstacles=obstacles, link=link)
    return to_toml(ProposalFile.of(SETUP, scene))


@pytest.fixture
def at_hand(tmp_path, monkeypatch):
    """The words of a check at an address, in a folder with a proposal and ports."""
    pytest.importorskip("rtde_control")
    monkeypatch.chdir(tmp_path)
    for name in ("port", "other"):
        (tmp_path / name).touch()
    (tmp_path / "small.toml").write_text(PROPOSAL)
    ports = ["--ring", "forearm=port", "--ring", "tool=other"]
    return ["check", "small.toml", "--robot-host", "h", *ports]


STATEMENTS = ("floor = ", "cell_complete = true")


@pytest.mark.parametrize("part", ["mount", "coverage"])
@pytest.mark.parametrize(
    ("motion", "obstacles", "lacks"),
    [
        (Motion(), SCENE.obstacles[1:], STATEMENTS),
        (Motion(cell_complete=True), SCENE.obstacles[1:], STATEMENTS[:1]),
        (Motion(), SCENE.obstacles, STATEMENTS[1:]),
    ],
)
def test_a_real_robot_is_not_moved_in_a_cell_that_is_not_known(
    tmp_path, at_hand, part, motion, obstacles, lacks
):
    (tmp_path / "small.toml").write_text(proposal(motion, obstacles))
    before = files_of(tmp_path)
    with refused("--move") as error:
        call(*at_hand, "--move", "--part", part)
    assert tuple(word for word in STATEMENTS if word in str(error.value)) == lacks
    assert files_of(tmp_path) == before


def test_a_robot_without_bodies_is_not_moved():
    known = replace(SCENE, motion=Motion(cell_complete=True))
    require_known_cell(known)
    with refused("--move", "bodies"):
        require_known_cell(replace(known, robot=replace(SCENE.robot, bodies=())))


@pytest.mark.parametrize("key", ["near_m", "cell_m", "self_m", "speed_deg_s"])
def test_a_distance_of_nothing_is_refused(tmp_path, key):
    (tmp_path / "scene.toml").write_text(f"[motion]\n{key} = 0.0\n")
    with refused(f"scene.toml: motion.{key}", "0.0"):
        call("check", "n2_16_25", "--rig", "sim", "--scene", tmp_path / "scene.toml")


@pytest.mark.parametrize("asked", [0.0, 0.2, 0.49, 0.5])
def test_a_scene_cannot_waive_the_near_stop(asked):
    """Only the option can; a scene may ask for more."""
    least = np.array([[0.15, 0.0, 0.15, 0.1, 0.15]])  # three of five keep all of it
    scene = replace(SCENE, motion=Motion(near_share=asked))
    for full, share in ((0.15, 0.6), (0.2, 0.0)):
        stops = NearStops(full, np.zeros((1, 6)), least, np.full(least.shape, NOBODY))
        assert stops.share == share
        if share >= 0.5:
            require_near_stop(stops, scene, False)
        else:
            with refused("--move", "near_share", "50 %", "--allow-reduced-near-stop"):
                require_near_stop(stops, scene, False)
            require_near_stop(stops, scene, True)


@pytest.mark.parametrize("asked", [0.0, 0.2, 0.5, 0.7])
@pytest.mark.parametrize(("keeping", "full"), [(1, False), (3, True)])
def test_a_waived_near_stop_is_recorded_whatever_the_scene_asks(monkeypatch, asked, keeping, full):
    """A value below the default counts as the default, in the report as before the motion."""
    least = np.array([[0.15] * keeping + [0.0] * (5 - keeping)])
    stops = NearStops(0.15, np.zeros((1, 6)), least, np.full(least.shape, NOBODY))
    monkeypatch.setattr(readiness, "Clearance", Mock(**{"return_value.fault.return_value": None}))
    itinerary = Mock(**{"return_value.near_stops.return_value": stops})
    monkeypatch.setattr(readiness, "Itinerary", itinerary)
    monkeypatch.setattr(
        readiness, "bounds_of_route", lambda *_: ([Mock(seconds=1, metres=1)], None)
    )
    monkeypatch.setattr(MovedRobot, "__init__", lambda *_: None)
    scene, said = replace(SCENE, motion=Motion(near_share=asked)), {}
    session = Mock(spec=Session, say=lambda what, **more: said.update({what: more}))
    options = replace(MOVING, allow_reduced_near_stop=True)
    check = Mock(spec=PlannedCheck, setup=SETUP, scene=scene, plans=Mock(), seed=0)
    person = MagicMock(spec=Attendant)
    Readiness(session, check, options, person, "192.0.2.7", True).moved_robot(
        SCENE.poses[0].q, Mock()
    )
    assert said["near stop"]["waived"] == (not full or asked > 0.6)


def test_the_robot_is_judged_as_it_is_once_the_rings_have_begun():
    """They may take seconds, in which a person may move it or switch it off."""
    early = State(0.0, 0.0, np.zeros(6), np.zeros(6))
    late = replace(early, q=np.ones(6), mode=RobotMode.POWER_OFF)
    link = Mock(wait=lambda _: early, latest=lambda: late)
    session = Mock(
        spec=Session, link=link, rings=Mock(starting=[], counts=[Counts(), Counts()]), patience=1.0
    )
    poses = [np.zeros((1, 6))]
    check = Mock(spec=PlannedCheck, setup=SETUP, plans=Mock(poses=poses), ports=[])
    moved = live.LiveCheck("small.toml", SETUP, SCENE, MOVING, "192.0.2.7")
    with refused("--move", RobotMode.POWER_OFF.name):
        moved._follow(session, check, None, Mock(spec=Attendant))


def test_a_board_that_the_proposal_does_not_name_is_refused():
    own, other = "51D0000000000000", "51D00000000000FF"
    setup = replace(SETUP, rings=(replace(SETUP.rings[0], serial=own), SETUP.rings[1]))

    def boards(*serials):
        return [Counts(serials=Counter(serials)), Counts(serials=Counter([other]))]

    require_boards(setup, boards(own))
    require_boards(setup, boards())  # it says none
    for serials in ([other], [own, other]):
        with refused("--ring forearm", own, other):
            require_boards(setup, boards(*serials))


MOVING = CheckOptions(part=("self", "mount"), seconds=2.0, stops=10, trials=4, move=True, voxel=0.1)


def ready(session, check, allowed=False, real=True, attendant=None):
    """A rig whose robot a check would move, and may move whatever its self check found."""
    options = replace(MOVING, allow_differing_self_check=allowed)
    attendant = attendant or Mock(spec=Attendant)
    return Readiness(session, check, options, attendant, "192.0.2.7", real)


@pytest.mark.parametrize("parts", [("mount",), ("coverage",), ("mount", "coverage"), ("self",)])
def test_no_real_robot_moves_without_a_self_check(monkeypatch, parts):
    """Whichever parts are chosen; a person who moves it needs none."""
    monkeypatch.setattr(check_plans, "planned", Mock(return_value=None))
    monkeypatch.setattr(check_plans, "plan_rod", Mock(return_value=Mock(spec=RodPlan)))
    options = replace(MOVING, part=parts)
    assert plan_check(SETUP, SCENE, options, moved=False).seconds == MOVING.seconds
    guided = plan_check(SETUP, SCENE, replace(options, move=False), moved=False)
    assert (guided.seconds is None) == ("self" not in parts)


def test_a_self_check_that_differs_moves_no_robot(taped):
    """Unless a named option says so, and then the report says it; a simulated one moves."""
    said = []
    session = Mock(
        spec=Session,
        gathered=taped.gathered,
        rings=Mock(counts=taped.gathered.counts),
        say=lambda what, **more: said.append((what, more)),
    )
    with refused("self check", "--allow-differing-self-check", error=EndedError) as ended:
        ready(session, taped.checked).require_self_check()
    dead = taped.found.result.self_check.silent
    assert dead
    assert all(name in str(ended.value) for name in dead)
    ready(session, taped.checked, real=False).require_self_check()
    assert said == []
    ready(session, taped.checked, allowed=True).require_self_check()
    ((what, more),) = said
    assert what == "warning"
    assert "--allow-differing-self-check" in more["text"]


def test_a_self_check_without_readings_moves_no_robot(taped):
    """Nothing was read: nothing is known."""
    session = Mock(spec=Session, gathered=Gathered(), rings=Mock(counts=[Counts(), Counts()]))
    with refused("self check", error=EndedError):
        ready(session, taped.checked).require_self_check()


def test_nothing_moves_before_the_self_check_is_judged(taped):
    """The poses come after it, and not at all where it says so."""
    session, order = Mock(spec=Session, trouble=""), []
    operator = Operator(lambda joints: order.append("order") or [], *(Mock() for _ in range(4)))
    session.say.side_effect = lambda what, **more: order.append(what)
    mount = taped.checked.plans.mount
    assert run(session, Plans(0.0, mount), operator, lambda: order.append("judged")) == ""
    assert order.index("judged") < order.index("order")
    assert order.index("end") < order.index("judged")

    def differs():
        raise EndedError("it differs")

    order.clear()
    assert run(session, Plans(0.0, mount), operator, differs) == "it differs"
    assert "order" not in order


class Starting:
    """Rings of which one sends its first frame after a while, or is no ring."""

    def __init__(self, frames_after, bound=1.0):
        self.counts, self.asked, self._left = [], 0, frames_after

    def wait(self, seconds):
        return self.starting == []

    @property
    def starting(self):
        self.asked += 1
        return [1] if self.asked <= self._left else []


@pytest.mark.parametrize(("after", "told"), [(0, 0), (5, 1), (10**9, 1)])
def test_a_ring_that_starts_is_waited_for_and_told(monkeypatch, after, told):
    """As boards that load their sensors' firmware for seconds; SparkFun VL53L5CX PR 9."""
    monkeypatch.setattr(readiness, "_STARTING", readiness._FIRST + 0.2)
    monkeypatch.setattr(readiness, "_HELLO", 0.0)
    rings, notes, said = Starting(after), [], []
    session = Mock(
        spec=Session, rings=rings, patience=1.0, say=lambda what, **more: said.append((what, more))
    )
    began, check = time.monotonic(), Mock(spec=PlannedCheck, setup=SETUP, ports=[])
    ready(session, check, attendant=Mock(spec=Attendant, note=notes.append)).await_rings()
    assert len(notes) == len(said) == told
    assert all("tool" in line for line in notes)
    assert said in ([], [("starting", {"rings": [1]})])
    assert time.monotonic() - began < 5


def test_an_interrupt_before_the_first_step_is_assessed_and_names_the_recording(
    tmp_path, monkeypatch
):
    """As while a ring is waited for: what arrived until then is recorded."""
    said = []
    session = Mock(
        spec=Session,
        gathered=Gathered(counts=[Counts(), Counts()]),
        say=lambda what, **more: said.append((what, more)),
        link=Mock(wait=Mock(side_effect=KeyboardInterrupt("ended by SIGTERM"))),
        patience=1.0,
    )
    monkeypatch.setattr(live, "Session", lambda *words, **more: session)
    checked = live.LiveCheck("small.toml", SETUP, SCENE, MOVING, "192.0.2.7")
    ports = [Port(name=f"/dev/{i}", count=r.count, baud=9600) for i, r in enumerate(SETUP.rings)]
    record = checked.record(Plans(1.0, None), ports, tmp_path, Mock())
    assert said == [("ended", {"why": "ended by SIGTERM"})]
    assert session.close.called
    record.gathered.note(0.0, {"what": "ended", "why": "ended by SIGTERM"})
    assessment = assess(record)
    assert assessment.result.verdict == "unfinished"
    assert any("SIGTERM" in reason for reason in assessment.result.reasons)
    assert "check.json" in write_files(record.check, assessment, tmp_path)


def test_a_recording_from_before_the_robot_mode_was_asked_for_gives_the_same_report(tmp_path):
    """Its states have no mode."""

    def sent(ring, n):
        count = SETUP.groups[ring].count
        return encode(n, n / 25, np.full(count, 0.5 + n % 3 / 1000), np.zeros(count, int))

    now, before = (
        checked_still(tmp_path / str(mode), SCENE, SETUP, sent, mode=mode)
        for mode in (RobotMode.RUNNING, None)
    )
    for _, told in (now, before):
        del told["recorded"]
        assert told["robot"]["states"] == 300
    assert now == before


def test_the_silence_of_a_ring_that_started_is_no_warning():
    """Of one that never came it is, and of a ring that fell silent later."""
    events = [
        *(Event(0, Happened.SILENT, 1.0), Event(0, Happened.GARBLED, 2.0)),
        *(Event(0, Happened.BACK, 12.0), Event(1, Happened.SILENT, 1.0)),
    ]
    said = [(3.0, {"what": "starting", "rings": [0, 1]})]
    (line,) = warnings_of(SETUP, Gathered(events=events, said=said), "", [])
    assert Happened.SILENT.value in line
    assert SETUP.group_name(1) in line
    later = [*events, Event(0, Happened.SILENT, 20.0)]
    assert len(warnings_of(SETUP, Gathered(events=later, said=said), "", [])) == 2
    assert len(warnings_of(SETUP, Gathered(events=events), "", [])) == 3


def test_too_few_sensors_with_a_near_stop_are_refused_unless_waived():
    joints = np.random.default_rng(0).uniform(-2, 2, (6, 6))
    stops = near_stops(SCENE, SETUP, joints)
    strict, lax = (
        replace(SCENE, motion=Motion(near_share=share))
        for share in (max(stops.share, 0.5) + 0.01, 0.5)
    )
    with refused("--move", "near_share", "rings_as_proposed", "--allow-reduced-near-stop"):
        require_near_stop(stops, strict, False)
    require_near_stop(stops, strict, True)
    require_near_stop(replace(stops, least=np.full_like(stops.least, stops.full)), lax, False)
    console = Terminal(record=True, width=140, file=io.StringIO())
    Attendant(console).show_near_stops(stops, SETUP, SCENE)
    text, rings = console.export_text(), by_ring(stops, SETUP, [b.name for b in SCENE.robot.bodies])
    for name, ring in zip(("forearm", "tool"), rings, strict=True):
        row = next(line for line in text.splitlines() if line.strip(" │┃|").startswith(name))
        cells = [c.strip() for c in re.split(r"[│┃]", row.strip(" │┃"))]
        assert [int(c) for c in cells[1:6]] == [
            *(ring.sensors, ring.always_full, ring.sometimes_less, ring.sometimes_none),
            round(100 * ring.share),
        ]
        assert all(body in cells[6] for body, _ in ring.why)


class EnoughError(Exception):
    """Ends a check before it begins."""


LONG = LinkLimits(200.0, 0.3, 0.6, 0.3, 0.25, 0.15)


@pytest.mark.parametrize("limits", [USUAL_LIMITS, LONG])
@pytest.mark.parametrize(("host", "patience"), [("h", 1.0), (None, 100.0)])
def test_the_limits_of_a_real_rig_are_its_scenes_and_those_of_a_simulated_one_relax_together(
    tmp_path, monkeypatch, at_hand, host, patience, limits
):
    """A simulated rig needs no statement about its cell."""
    (tmp_path / "small.toml").write_text(proposal(Motion(), (), limits))
    told = {}

    def session(address, ports, recording, **more):
        told.update(more, ports=ports, path=recording.path)
        recording.close()
        raise EnoughError

    rig = Mock(spec=SimulatedRig, address="a", ring=lambda i: "port")
    monkeypatch.setattr(live, "Session", session)
    monkeypatch.setattr(live.LiveCheck, "_started", lambda *_: nullcontext(rig))
    words = at_hand if host else ["check", "small.toml", "--rig", "sim"]
    with pytest.raises(EnoughError):
        call(*words, "--part", "self")
    assert (told["limits"], told["patience"]) == (limits, patience)
    assert {p.patience for p in told["ports"]} == {patience}
    stored = RecordingReader(told["path"]).about["check"]
    assert stored["stale_s"] == pytest.approx(limits.state_stale * patience)
    again = PlannedCheck.read("again", stored)
    assert (again.scene.link, again.ports) == (limits, told["ports"])


def test_what_is_missing_is_said_before_anything_is_done(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(PROPOSAL)
    monkeypatch.setattr("place_rings.formats.optional_dependencies.find_spec", lambda name: None)
    with refused("pip install 'place-rings[rig]'"):
        call("check", "small.toml", "--rig", "sim")
    assert [file.name for file in tmp_path.iterdir()] == ["small.toml"]


def test_a_process_that_is_gone_does_not_end_the_check_with_it(monkeypatch, at_hand):
    """The command lets a broken pipe end it, for ``| head``: the check's moving client, once
    killed, must not.
    """
    before, told = signal.signal(signal.SIGPIPE, signal.SIG_DFL), []

    def started(*_):
        told.append(signal.getsignal(signal.SIGPIPE))
        raise EnoughError

    monkeypatch.setattr(live.LiveCheck, "_started", started)
    try:
        with pytest.raises(EnoughError):
            call("check", "small.toml", "--rig", "sim", "--part", "self", "--out", "out")
        told.append(signal.getsignal(signal.SIGPIPE))
    finally:
        signal.signal(signal.SIGPIPE, before)
    assert told == [signal.SIG_IGN, signal.SIG_DFL]


def test_a_robot_that_ur_rtde_does_not_know_is_refused(tmp_path):
    pytest.importorskip("rtde_control")
    (tmp_path / "arm.toml").write_text('robot = "iiwa14"')
    with refused("iiwa14", "7", "6"):
        call("check", "n1_8_0", "--rig", "sim", "--scene", tmp_path / "arm.toml")
