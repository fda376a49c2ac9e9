"""The check as a whole: from a recording made by hand, and end to end on the simulated rig, live
and replayed.
"""

import io
import os
import pty
import re
import select
import signal
import subprocess
import sys
import threading
import time
from contextlib import nullcontext, suppress
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import psutil
import pytest
from place_rings.cli.app import app
from place_rings.cli.runs.check import check_live
from place_rings.cli.runs.check_confirmation import show_near_stops
from place_rings.coverage.targets import Target
from place_rings.formats.errors import UserError
from place_rings.formats.loader import read_proposal
from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.formats.schema.ring_models import ring_models
from place_rings.formats.schema.scene_models import SceneModel
from place_rings.formats.writing import to_toml
from place_rings.objectives.motion_limits import Motion
from place_rings.objectives.scene import Goal
from place_rings.reporting.terminal import Terminal
from place_rings.rig.check import live
from place_rings.rig.check.assessment import assess
from place_rings.rig.check.models import CheckResult, PortModel
from place_rings.rig.check.plans import CheckOptions, Plans
from place_rings.rig.check.preconditions import require_known_cell, require_near_stop
from place_rings.rig.check.procedure import Operator, run, skipped, spans
from place_rings.rig.mount.stop_plan import planned
from place_rings.rig.poses.near_stops import by_ring, near_stops
from place_rings.rig.recording.recording import Recording, RecordingReader
from place_rings.rig.rings.ports import RingReaders
from place_rings.rig.rings.protocol import Counts
from place_rings.rig.robot.motion import UNSEEN
from place_rings.rig.robot.vetting import STALE
from place_rings.rig.rod.rod import Rod
from place_rings.rig.rod.trial_plan import places, plan_rod
from place_rings.rig.session.gathering import replay
from place_rings.rig.session.session import Session
from place_rings.rig.simulated.process import SimulatedRig
from place_rings.rig.simulated_cell.cell import simulated_rig

from .about import about_file
from .cell import SCENE as CELL
from .cell import SETUP
from .tape import Tape, record

SCENE = replace(CELL, goals=(Goal(Target("V_S", 0.25)), Goal(Target("V_S", 0.2))))


def about(**more):
    targets = [goal.target for goal in SCENE.goals]
    plans = [
        plan_rod(SCENE, SETUP, t, n, where=places(SCENE, t, Rod(), 0.1))
        for t, n in zip(targets, (12, 8), strict=True)
    ]
    stops = planned(SCENE, SETUP, poses=10, frames=8, candidates=60)
    return about_file("small.toml", SCENE, SETUP, stops, plans, **more)


@pytest.fixture(scope="module")
def taped(tmp_path_factory):
    return record(tmp_path_factory.mktemp("check") / "tape.rig", about())


def call(words):
    app(words, exit_on_error=False, print_error=False, result_action="return_value")


def assessed(file, checked):
    recorded = RecordingReader(file)
    return assess(
        checked, replay(recorded, checked.ports, checked.about.stale_s), 0.0, recorded.damage
    )


def test_what_was_injected_is_found_and_said(taped):
    file, checked = taped
    found = assessed(file, checked)
    r = found.result
    assert (r.verdict, r.warnings) == ("differs", [])
    assert r.mount.injected_found == dict.fromkeys(
        ("reversed ring", "swapped pair", "dead sensor"), True
    )
    assert r.mount.stops == 10
    for one in r.mount.rings:
        assert all(abs(e.value - e.injected) < 2.5 * e.margin for e in one.errors)
    assert len(r.self_check.silent) == 1
    wires = np.concatenate(
        [[np.nan if w is None else w for w in one.seats] for one in r.self_check.waved]
    )
    seats = np.concatenate([np.arange(n.count) for n in SETUP.rings]).astype(float)[
        checked.injected.seat
    ]
    np.testing.assert_array_equal(wires, np.where(checked.injected.seat < 0, np.nan, seats))
    assert not any(one.missed for one in r.self_check.waved)
    assert any("by a hand: " in reason for reason in r.reasons)
    assert [(c.named, c.trials) for c in r.coverage] == [("V_S(0.25)", 12), ("V_S(0.2)", 8)]
    assert all(c.low_percent <= c.measured_percent <= c.high_percent for c in r.coverage)
    assert any("dead" in reason for reason in r.reasons)
    assert [line.frames for line in r.lines] == [r.lines[0].frames] * 2
    assert abs(r.lines[0].drift_ppm) < 1
    CheckResult.model_validate_json(r.model_dump_json())


def test_a_check_that_was_cut_off_is_unfinished_and_what_was_done_is_judged(taped, tmp_path):
    file, checked = taped
    data = file.read_bytes()
    (tmp_path / "torn").write_bytes(data[: len(data) * 2 // 5 + 7])
    r = assessed(tmp_path / "torn", checked).result
    assert r.verdict == "unfinished"
    assert "ended early: it was cut off" in r.reasons
    assert r.self_check is not None
    assert r.coverage == []
    assert any("coverage check: no trial was completed" in reason for reason in r.reasons)
    assert any("is damaged" in warning for warning in r.warnings)
    (tmp_path / "early").write_bytes(data[:20_000])
    r = assessed(tmp_path / "early", checked).result
    assert (r.verdict, r.mount) == ("unfinished", None)


def test_a_self_check_that_was_killed_is_judged_by_what_it_read(taped, tmp_path):
    _, checked = taped
    with Recording(
        tmp_path / "kill", {"check": checked.about.model_dump(mode="json")}
    ) as recording:
        tape = Tape(recording, checked)
        tape.say = lambda what, *args, **more: (
            Tape.say(tape, what, *args, **more) if what == "begin" else None
        )
        tape.stand(SCENE.poses[0].q, "self", 0, 20)
    r = assessed(tmp_path / "kill", checked).result
    assert r.verdict == "unfinished"
    assert not any("no reading" in reason for reason in r.reasons)
    assert "self check: cut off after 0.9 of 1 s" in r.reasons
    assert len(r.self_check.silent) == 1
    assert all(ring.frames >= 18 for ring in r.self_check.rings)


def test_stops_that_were_not_read_are_listed_with_the_reason(taped, tmp_path):
    _, checked = taped
    with Recording(tmp_path / "few", {"check": checked.about.model_dump(mode="json")}) as recording:
        tape = Tape(recording, checked)
        tape.stand(SCENE.poses[0].q, "self", 0, 20)
        for i, q in enumerate(checked.plans.mount.joints):
            if i in (2, 5):
                tape.say("skipped", tape.now, step="mount", number=i, why="no way")
            elif i == 3:
                tape.say("skipped", tape.now, step="mount", number=i, why="by the person")
            elif i < 8:
                tape.stand(q, "mount", i, 8)
        tape.say("ended", tape.now, why="")
    reasons = assessed(tmp_path / "few", checked).result.reasons
    assert (
        "mount check: 5 of 10 stops were read; stops 2, 5: no way; stop 3: by the person;"
        " stops 8, 9: not finished before the check ended"
    ) in reasons


def test_a_rig_without_errors_and_faults_is_as_proposed(tmp_path, capsys):
    asked = about(faults="none")
    record(tmp_path / "fine.rig", asked)
    with pytest.raises(SystemExit, match="0"):
        call(["check", "--replay", str(tmp_path / "fine.rig"), "--out", str(tmp_path / "out")])
    assert "small.toml: as proposed" in capsys.readouterr().out
    result = CheckResult.model_validate_json((tmp_path / "out" / "check.json").read_text())
    assert (result.verdict, result.reasons, result.faults) == ("as proposed", [], "none")
    assert "No error or fault was injected." in (tmp_path / "out" / "check.html").read_text()


def test_the_procedure_says_why_it_skips_a_stop(taped):
    _, checked = taped
    operator, session = Mock(spec=Operator), Mock(spec=Session)
    operator.order, operator.stand = lambda joints: [3, 1], lambda q, words: words[5] == "3"
    session.trouble, session.patience = "", 1.0
    session.rings = Mock(spec=RingReaders, counts=[Counts()])
    said = []
    session.say = lambda what, **more: said.append((0.0, {"what": what, **more}))
    plan = replace(checked.plans.mount, joints=checked.plans.mount.joints[:4], frames=-1)
    run(session, Plans(None, plan), operator)
    assert [s.number for s in spans(said)] == [3]
    assert skipped(said, "mount") == {
        0: "no way that keeps its distances leads there",
        1: "skipped by the person at the rig",
        2: "no way that keeps its distances leads there",
    }


def test_a_recording_that_says_what_cannot_be_is_judged_by_the_rest(taped, tmp_path):
    _, checked = taped
    with Recording(tmp_path / "odd", {"check": checked.about.model_dump(mode="json")}) as recording:
        tape = Tape(recording, checked)
        tape.stand(SCENE.poses[0].q, "self", 0, 20)
        for step, number in (
            ("mount", 99),
            ("mount", -1),
            ("wave", 7),
            ("trial", 500),
            ("before", 9),
            ("dance", 1),
        ):
            tape.stand(SCENE.poses[0].q, step, number, 2)
        tape.say("link ended", tape.now, why="BORED")
    r = assessed(tmp_path / "odd", checked).result
    assert (r.verdict, r.mount, r.robot.ended) == ("unfinished", None, "BORED")
    assert r.self_check is not None


def test_a_recording_of_other_ports_than_rings_is_refused(taped, tmp_path):
    _, checked = taped
    wrong = checked.about.model_dump(mode="json")
    wrong["ports"] = wrong["ports"][:1]
    with Recording(tmp_path / "odd", {"check": wrong}):
        pass
    with pytest.raises(
        UserError, match=r"ports: found .counts \[8\]., allowed: those of the rings, \[8, 6\]"
    ):
        call(["check", "--replay", str(tmp_path / "odd"), "--out", str(tmp_path / "out")])
    assert not (tmp_path / "out").exists()


def test_steps_that_were_not_ended_are_none():
    said = [
        (1.0, {"what": "begin", "step": "mount", "number": 4}),
        (2.0, {"what": "end"}),
        (3.0, {"what": "end"}),
    ]
    said += [
        (4.0, {"what": "begin", "step": "trial", "number": 0}),
        (5.0, {"what": "begin", "step": "trial", "number": 1}),
    ]
    assert spans(said) == [("mount", 4, 1.0, 2.0)]
    assert spans([*said, (6.0, {"what": "end"})])[1:] == [("trial", 1, 5.0, 6.0)]


def files_of(folder, *left_out):
    return {p.name: p.read_bytes() for p in folder.iterdir() if p.name not in left_out}


@pytest.mark.slow
def test_a_replay_gives_the_same_files_every_time(taped, tmp_path, capsys):
    file, _ = taped
    for name in ("a", "b"):
        with pytest.raises(SystemExit, match="1"):
            call(["check", "--replay", str(file), "--out", str(tmp_path / name)])
    first = files_of(tmp_path / "a")
    assert first == files_of(tmp_path / "b")
    assert set(first) == {"check.html", "check.json", "stops.csv", "trials.csv", "built.toml"}
    setup, scene, _ = read_proposal(tmp_path / "a" / "built.toml")
    assert len(setup.rings) == 2
    assert len(scene.obstacles) == 3
    out = capsys.readouterr().out
    assert "small.toml: differs" in out
    assert "no safety function" in out
    assert b"no safety function" in first["check.html"]
    with pytest.raises(UserError, match="allowed: a recording of other"):
        call(["check", "other", "--replay", str(file)])


def test_a_recording_of_something_else_is_refused(tmp_path):
    with Recording(tmp_path / "other.rig", {"rings": 2}):
        pass
    with pytest.raises(UserError, match=r"other.rig: found nothing, allowed: a table"):
        call(["check", "--replay", str(tmp_path / "other.rig"), "--out", str(tmp_path / "out")])
    assert not (tmp_path / "out").exists()


PROPOSAL = to_toml(ProposalFile.of(SETUP, SCENE))


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ([], "give exactly one of --rig sim, --robot-host HOST, --replay FILE"),
        (["--rig", "sim", "--replay", "x"], "give exactly one of --rig sim"),
        (["--robot-host", ""], '--robot-host: found ""'),
        (["--rig", "sim", "--move"], "--move: allowed only with --robot-host"),
        (["--replay", "x", "--stops", "8"], "--stops: not allowed with --replay FILE, whose"),
        (["--replay", "x", "--radius", "0.5"], "--radius: not allowed with --replay FILE"),
        (["--replay", "x", "--seed", "5"], "--seed: not allowed with --replay FILE"),
        (["--replay", "x", "--voxel", "0.05"], "--voxel: not allowed with --replay FILE"),
        (["--replay", "x", "--part", "self"], "--part: not allowed with --replay FILE"),
        (["--joints", "x", "--rod-mm", "9x90"], "--rod-mm: not allowed with --joints FILE: the"),
        (["--joints", "x", "--wave"], "--wave: not allowed with --joints FILE"),
        (["--robot-host", "h"], "--ring: no port for forearm, tool; add --ring NAME=PORT"),
        (["--robot-host", "h", "--ring", "tool"], "allowed: NAME=PORT"),
        (
            ["--robot-host", "h", "--ring", "hand=/dev/x"],
            'found "hand", allowed: each ring once; still without a port: forearm, tool',
        ),
        (
            ["--robot-host", "h", "--ring", "0=/dev/x", "--ring", "forearm=/dev/y"],
            'found "forearm", allowed: each ring once; still without a port: tool',
        ),
        (["--robot-host", "h", "--ring", "tool=/dev/x,morse"], "allowed: place-rings, esp32, text"),
        (
            ["--robot-host", "h", "--ring", "0=gone", "--ring", "tool=gone"],
            '--ring forearm: port "gone" does not exist; give one that does',
        ),
        (
            ["--robot-host", "h", "--ring", "0=/dev/null", "--ring", "tool=/dev/./null"],
            '--ring tool: port "/dev/./null" is that of forearm; give each ring a port of its own',
        ),
        (
            ["--robot-host", "h", "--allow-reduced-near-stop"],
            "--allow-reduced-near-stop: allowed only with --move",
        ),
        (
            ["--robot-host", "h", "--injected", "none"],
            "--injected: allowed only with --rig sim",
        ),
        (["--rig", "sim", "--rod-mm", "370x70"], "allowed: THICKNESSxLENGTH"),
        (["--rig", "sim", "--part", "mount", "--wave"], "--wave: allowed only with --part self"),
        (
            ["--rig", "sim", "--target", "V_S", "--radius", "0.1"],
            "--radius: found 0.1, allowed: above 0.15",
        ),
        (["--replay", "small.toml"], "not a recording of a rig"),
    ],
)
def test_bad_input_is_one_line(tmp_path, monkeypatch, words, text):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(PROPOSAL)
    before = files_of(tmp_path)
    with pytest.raises(UserError) as error:
        call(["check", *([] if "small.toml" in words else ["small.toml"]), *words])
    assert text in str(error.value)
    assert files_of(tmp_path) == before


def proposal(motion, obstacles=SCENE.obstacles):
    """A proposal in a scene with such a motion and cell, as TOML."""
    scene = replace(SCENE, motion=motion, obstacles=obstacles)
    return to_toml(
        ProposalFile(rings=ring_models(SETUP, SCENE.sensor), scene=SceneModel.from_domain(scene))
    )


@pytest.mark.parametrize("part", ["mount", "coverage"])
@pytest.mark.parametrize(
    ("motion", "obstacles", "lacks"),
    [
        (Motion(), SCENE.obstacles[1:], ("floor = ", "cell_complete = true")),
        (Motion(cell_complete=True), SCENE.obstacles[1:], ("floor = ",)),
        (Motion(), SCENE.obstacles, ("cell_complete = true",)),
    ],
)
def test_a_real_robot_is_not_moved_in_a_cell_that_is_not_known(
    tmp_path, monkeypatch, part, motion, obstacles, lacks
):
    pytest.importorskip("rtde_control")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(proposal(motion, obstacles))
    (tmp_path / "port").touch()
    (tmp_path / "other").touch()
    before = files_of(tmp_path)
    rings = ["--ring", "forearm=port", "--ring", "tool=other"]
    with pytest.raises(UserError) as error:
        call(["check", "small.toml", "--robot-host", "h", *rings, "--move", "--part", part])
    found = str(error.value)
    assert found.startswith("--move: the cell is not known; add to the scene: ")
    assert [word in found for word in ("floor = ", "cell_complete = true")] == [
        word in lacks for word in ("floor = ", "cell_complete = true")
    ]
    assert files_of(tmp_path) == before


def test_a_robot_without_bodies_is_not_moved():
    bare = replace(SCENE, robot=replace(SCENE.robot, bodies=()), motion=Motion(cell_complete=True))
    require_known_cell(replace(SCENE, motion=Motion(cell_complete=True)))
    with pytest.raises(UserError, match="add to the scene: a robot with bodies"):
        require_known_cell(bare)


def test_a_simulated_rig_needs_no_statement_and_says_so(tmp_path, monkeypatch, capsys):
    pytest.importorskip("rtde_control")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(proposal(Motion(), ()))

    def started(*_):
        raise UserError("enough")

    monkeypatch.setattr(live, "_started", started)
    with pytest.raises(UserError, match="enough"):
        call(["check", "small.toml", "--rig", "sim", "--part", "self"])
    assert "A real robot does not." in capsys.readouterr().err


@pytest.mark.parametrize("key", ["near_m", "cell_m", "self_m", "speed_deg_s"])
def test_a_distance_of_nothing_is_refused(tmp_path, monkeypatch, key):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(f"[motion]\n{key} = 0.0\n")
    with pytest.raises(
        UserError, match=rf"scene.toml: motion.{key}: found 0.0, allowed: a number from"
    ):
        call(["check", "n2_16_25", "--rig", "sim", "--scene", "scene.toml"])


def test_too_few_sensors_with_a_near_stop_are_refused_unless_waived():
    joints = np.random.default_rng(0).uniform(-2, 2, (6, 6))
    stops = near_stops(SCENE, SETUP, joints)
    strict, lax = (
        replace(SCENE, motion=Motion(near_share=share))
        for share in (stops.share + 0.01, stops.share)
    )
    with pytest.raises(
        UserError,
        match=r"--move: .*near_share.*rings_as_proposed = true.*--allow-reduced-near-stop",
    ):
        require_near_stop(stops, strict, False)
    require_near_stop(stops, strict, True)
    require_near_stop(stops, lax, False)
    console = Terminal(record=True, width=140, file=io.StringIO())
    show_near_stops(stops, SETUP, SCENE, console)
    text, rings = console.export_text(), by_ring(stops, SETUP, [b.name for b in SCENE.robot.bodies])
    for name, ring in zip(("forearm", "tool"), rings, strict=True):
        row = next(line for line in text.splitlines() if line.strip(" │┃|").startswith(name))
        cells = [c.strip() for c in re.split(r"[│┃]", row.strip(" │┃"))]
        assert [int(c) for c in cells[1:6]] == [
            *(ring.sensors, ring.always_full, ring.sometimes_less, ring.sometimes_none),
            round(100 * ring.share),
        ]
        assert all(body in cells[6] for body, _ in ring.why)


@pytest.mark.parametrize(("host", "patience"), [("h", 1.0), (None, 100.0)])
def test_the_limits_of_a_real_rig_never_relax_and_those_of_a_simulated_one_do_together(
    tmp_path, monkeypatch, host, patience
):
    pytest.importorskip("rtde_control")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(proposal(Motion()))
    (tmp_path / "port").touch()
    (tmp_path / "other").touch()
    told = {}

    def session(address, ports, recording, **more):
        told.update(more, stale=recording.path, ports=[p.patience for p in ports])
        recording.close()
        raise UserError("enough")

    rig = Mock(spec=SimulatedRig, address="a", ring=lambda i: "port")
    monkeypatch.setattr(live, "Session", session)
    monkeypatch.setattr(live, "_started", lambda *_: nullcontext(rig))
    rings = ["--ring", "forearm=port", "--ring", "tool=other"]
    words = ["--robot-host", host, *rings] if host else ["--rig", "sim"]
    with pytest.raises(UserError, match="enough"):
        call(["check", "small.toml", *words, "--part", "self"])
    assert told["patience"] == patience
    assert told["ports"] == [patience] * 2
    assert RecordingReader(told["stale"]).about["check"]["stale_s"] == pytest.approx(
        STALE * patience
    )


def test_what_is_missing_is_said_before_anything_is_done(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(PROPOSAL)
    monkeypatch.setattr("place_rings.formats.optional_dependencies.find_spec", lambda name: None)
    with pytest.raises(UserError, match=r"pip install 'place-rings\[rig\]'"):
        call(["check", str(tmp_path / "small.toml"), "--rig", "sim"])
    assert [file.name for file in tmp_path.iterdir()] == ["small.toml"]


def test_a_process_that_is_gone_does_not_end_the_check_with_it(tmp_path, monkeypatch):
    """The command lets a broken pipe end it, for ``| head``: the check's moving client, once
    killed, must not.
    """
    pytest.importorskip("rtde_control")
    (tmp_path / "small.toml").write_text(PROPOSAL)
    before, told = signal.signal(signal.SIGPIPE, signal.SIG_DFL), []

    def started(*_):
        told.append(signal.getsignal(signal.SIGPIPE))
        raise UserError("enough")

    monkeypatch.setattr(live, "_started", started)
    try:
        with pytest.raises(UserError, match="enough"):
            call(
                [
                    "check",
                    str(tmp_path / "small.toml"),
                    "--rig",
                    "sim",
                    "--part",
                    "self",
                    "--out",
                    str(tmp_path / "out"),
                ]
            )
        told.append(signal.getsignal(signal.SIGPIPE))
    finally:
        signal.signal(signal.SIGPIPE, before)
    assert told == [signal.SIG_IGN, signal.SIG_DFL]


def test_a_robot_that_ur_rtde_does_not_know_is_refused(tmp_path):
    pytest.importorskip("rtde_control")
    (tmp_path / "arm.toml").write_text('robot = "iiwa14"')
    words = [
        "check",
        "n1_8_0",
        "--rig",
        "sim",
        "--scene",
        str(tmp_path / "arm.toml"),
        "--out",
        str(tmp_path / "out"),
    ]
    with pytest.raises(UserError, match="iiwa14 has 7 joints; ur-rtde supports only robots with 6"):
        call(words)


@pytest.mark.slow
def test_end_to_end_on_the_simulated_rig_and_its_replay(tmp_path):
    """Through unmodified ur-rtde and pyserial, in processes of their own."""
    pytest.importorskip("rtde_control")
    (tmp_path / "small.toml").write_text(PROPOSAL)
    words = [
        "check",
        str(tmp_path / "small.toml"),
        "--rig",
        "sim",
        "--stops",
        "12",
        "--trials",
        "8",
        "--voxel",
        "0.05",
    ]
    run = [sys.executable, "-m", "place_rings.cli.entry"]
    live, again = tmp_path / "live", tmp_path / "again"
    done = subprocess.run([*run, *words, "--out", str(live)], capture_output=True, text=True)
    assert done.returncode == 1, done.stderr
    result = CheckResult.model_validate_json((live / "check.json").read_text())
    assert result.verdict == "differs", done.stdout
    assert result.mount.injected_found == dict.fromkeys(
        ("reversed ring", "swapped pair", "dead sensor"), True
    )
    assert [(c.named, c.trials) for c in result.coverage] == [("V_S(0.25)", 4), ("V_S(0.2)", 4)]
    recording = str(live / "recording-1.rig")
    assert (
        subprocess.run(
            [*run, "check", "--replay", recording, "--out", str(again)], capture_output=True
        ).returncode
        == 1
    )
    plans = (
        "recording-1.rig",
        "world.toml",
        "stops.toml",
        "trials-V_S-0.25.toml",
        "trials-V_S-0.2.toml",
        "trials.pdf",
    )
    assert files_of(again) == files_of(live, *plans)


@pytest.mark.slow
def test_a_rig_at_an_address_is_read_and_moves_only_once_a_person_said_yes(tmp_path, monkeypatch):
    """As on a real rig, with the limits and the questions of one, and on the move more patience
    than a real one has.
    """
    pytest.importorskip("rtde_control")
    motion = Motion(np.radians(60), np.radians(120), cell_complete=True, rings_as_proposed=True)
    scene = replace(SCENE, motion=motion)
    model = ProposalFile.of(SETUP, scene)
    (tmp_path / "small.toml").write_text(to_toml(model))

    def run(rig, *words, said=""):
        rings = [f"--ring={name}={rig.ring(i)}" for i, name in enumerate(("forearm", "tool"))]
        call = [
            sys.executable,
            "-m",
            "place_rings.cli.entry",
            "check",
            "small.toml",
            "--robot-host",
            rig.address,
        ]
        more = ["--voxel", "0.1", "--seconds", "2", *words]
        wide = {**os.environ, "COLUMNS": "140"}
        return subprocess.run(
            [*call, *rings, *more],
            input=said,
            capture_output=True,
            text=True,
            cwd=tmp_path,
            env=wide,
        )

    with simulated_rig(scene, SETUP, 0, tmp_path) as rig:
        looked = run(rig, "--part", "self", "--out", "looked")
        assert looked.returncode == 1, looked.stderr
        assert "never answer" in looked.stdout
        refused = run(
            rig, "--part", "mount", "--stops", "3", "--move", "--out", "refused", said="no\n"
        )
        assert refused.returncode == 2
        assert 'not confirmed (type "yes"); the robot was not moved' in refused.stderr
        assert "no safety function" in refused.stderr
        for word in (
            "Near stop along the route",
            "always full",
            "sometimes none",
            "forearm",
            "tool",
        ):
            assert word in refused.stderr
        left = run(rig, "--part", "mount", "--stops", "3", "--out", "left", said="s\ns\n")
        assert left.returncode == 3
        assert "ended by the user" in left.stdout
        np.testing.assert_allclose(rig.do("state")["q"], SCENE.poses[0].q)
        asked = []
        monkeypatch.setattr(live, "_REAL", 25.0)
        monkeypatch.setattr("builtins.input", lambda *_: asked.append(1) or "yes")
        ports = [
            PortModel(name=rig.ring(i), count=r.count, baud=460800, patience=8.0)
            for i, r in enumerate(SETUP.rings)
        ]
        wanted = CheckOptions(("mount",), 1.0, False, 3, 2, Rod(), True, False, 0.1, 0)
        out, quiet = tmp_path / "moved", {"bag": False, "as_json": False}
        check_live("small.toml", SETUP, scene, wanted, rig.address, ports, out, **quiet)
        assert asked == [1]
        assert np.abs(np.subtract(rig.do("state")["q"], SCENE.poses[0].q)).max() > 0.1
    result = CheckResult.model_validate_json((tmp_path / "moved" / "check.json").read_text())
    assert (result.simulated, result.mount is None or result.mount.stops) in (
        (False, True),
        (False, 3),
    )
    assert result.mount is None or result.mount.injected_found is None


# becomes Python with what follows, its input the terminal of its session: JAX forbids a fork here
_IN_TERMINAL = (
    "import fcntl, os, sys, termios;"
    "fcntl.ioctl(0, termios.TIOCSCTTY, 0);"
    "os.execv(sys.executable, [sys.executable, *sys.argv[1:]])"
)


@pytest.mark.slow
@pytest.mark.parametrize("end", ["SIGINT", "SIGTERM", "hang-up"])
def test_signals_end_a_moving_check_in_order(tmp_path, end):
    """In a terminal of its own, which goes with the hang-up: the robot is stopped, what was read is
    judged and written, no process and no folder stays."""
    pytest.importorskip("rtde_control")
    (tmp_path / "small.toml").write_text(PROPOSAL)
    (tmp_path / "temporary").mkdir()
    words = [
        "check",
        "small.toml",
        "--rig",
        "sim",
        "--part",
        "mount",
        "--stops",
        "24",
        "--voxel",
        "0.1",
    ]
    master, slave = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", _IN_TERMINAL, "-m", "place_rings.cli.entry", *words],
        cwd=tmp_path,
        env={**os.environ, "TMPDIR": str(tmp_path / "temporary")},
        stdin=slave,
        stdout=slave,
        stderr=slave,
        start_new_session=True,
    ) as process:
        os.close(slave)
        ended = threading.Event()
        threading.Thread(target=_drained, args=(master, ended), daemon=True).start()
        recording = tmp_path / "place-rings-check" / "recording-1.rig"
        while process.poll() is None and not (
            recording.exists() and b'"near stop"' in recording.read_bytes()
        ):
            time.sleep(0.1)
        time.sleep(2.0)
        family = psutil.Process(process.pid).children(recursive=True)
        assert len(family) == 3
        if end == "hang-up":
            ended.set()  # upon which the master is closed
        else:
            process.send_signal(getattr(signal, end))
        assert process.wait(300) == 3
    ended.set()
    psutil.wait_procs(family, 30)
    assert not any(p.is_running() for p in family)
    assert list((tmp_path / "temporary").glob("*rig*")) == []
    result = CheckResult.model_validate_json((recording.parent / "check.json").read_text())
    why = {"SIGINT": "interrupted", "SIGTERM": "ended by SIGTERM", "hang-up": "ended by SIGHUP"}[
        end
    ]
    assert result.verdict == "unfinished"
    assert any(why in reason and UNSEEN not in reason for reason in result.reasons), result.reasons


def _drained(terminal, ended):
    """Read what is written to a terminal until ``ended``, then hang it up."""
    while not ended.is_set():
        if select.select([terminal], [], [], 0.1)[0]:
            with suppress(OSError):
                os.read(terminal, 4096)
    os.close(terminal)
