"""Live: simulated rigs in processes of their own, through unmodified ur-rtde and pyserial."""

import os
import pty
import random
import re
import select
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import psutil
import pytest
from place_rings.cli.options import rig as rig_options
from place_rings.cli.runs import check as check_runs
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import effective
from place_rings.objectives.motion_limits import Motion
from place_rings.rig.check import live
from place_rings.rig.check.plans import Plans
from place_rings.rig.recording.recording import Recording, RecordingReader
from place_rings.rig.rings.line_monitor import SILENT, Port
from place_rings.rig.robot.link import Link
from place_rings.rig.robot.motion import UNSEEN, MotionLimits, Mover, MoveStoppedError
from place_rings.rig.robot.motion_process import LEAVE, SIGN, WATCHDOG
from place_rings.rig.robot.vetting import STALE, Ended, LinkFaultError
from place_rings.rig.session.gathering import replay
from place_rings.rig.session.session import Session
from place_rings.rig.simulated.process import SimulatedRig, command
from place_rings.rig.simulated_cell.cell import simulated_rig

from ..support.refusals import refused
from .cell import SCENE, SETUP, SHELLS
from .commands import call, proposed, result_of
from .moving import FAULTS, RINGS, STILL, TRIES, MovingCheck, struck
from .tape import rows

HOME = np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])
PATIENCE = 6.0  # a busy machine keeps processes waiting
WAKE = 0.5  # s that a thread may take to wake on a busy machine


def rig(rings=1, sensors=4, seed=0):
    words = command(rings, sensors, seed=seed)
    return SimulatedRig((("-m", "place_rings.rig.simulated"), words))


def results(names):
    """What went wrong by each fault, on a rig of its own."""
    found, check = {}, None
    with rig(RINGS, 16) as simulated, ExitStack() as checks:
        for name in names:
            for _ in range(TRIES):
                if check is None or not check.ready():
                    check = MovingCheck(simulated)
                    checks.callback(check.close)
                outcome = struck(simulated, check, name, random.Random(name).uniform(0.1, 0.6))
                disturbed = outcome is None or outcome.disturbed
                found[name] = None if disturbed else outcome.wrong()
                simulated.do("heal")
                for ring in range(RINGS):
                    simulated.do("cure", ring=ring)
                if found[name] is not None:
                    break
    return found


@pytest.mark.slow
def test_each_fault_is_reported_and_stops_a_moving_robot():
    """In time, or the report says that it was not seen to; and no process is left."""
    pytest.importorskip("rtde_control")
    # the last of each rig end the check's process
    names = sorted(FAULTS, key=lambda n: n.startswith(("SIGKILL to the check", "the end of input")))
    with ThreadPoolExecutor() as rigs:  # they mostly wait
        parts = rigs.map(results, (names[i::3] for i in range(3)))
        found = {name: wrong for part in parts for name, wrong in part.items()}
    assert {name: wrong for name, wrong in found.items() if wrong != []} == {}
    assert found.keys() == FAULTS.keys()


def test_the_docs_list_what_makes_it_stop_and_its_limits():
    text = (Path(__file__).parents[2] / "docs" / "rig.md").read_text()
    section = text.partition("### What makes it stop")[2].partition("\n#")[0]
    rows = re.findall(r"^\| ([^|]+) \| ([^|]+) \|$", section, re.MULTILINE)[2:]
    assert [name for name, _ in rows] == [*FAULTS]
    for name, stops in rows:
        fault = FAULTS[name]
        assert ("nothing" in stops) == (fault.moves or not fault.stops), name
    for limit in (STILL, LEAVE, WATCHDOG, SIGN, SILENT):
        assert f" {limit:g} s" in section
    assert f"{1000 * STALE:g} ms" in section
    assert UNSEEN in section


CLIENTS_FAULTS = {
    "close": Ended.CLOSED,
    "stall": Ended.STALE,
    "zero": Ended.ABORTED,
    "stop": Ended.STOPPED,
    "short": None,
    "once short": None,
    "garbage": Ended.GARBLED,
    "jump": Ended.GARBLED,
    "nan": Ended.GARBLED,
    "frozen clock": Ended.STALE,
    "late": Ended.LATE,
}


def spoiled(simulated, name):
    """A link's fault and the seconds until it was found; None if a busy machine was before it."""
    with Link(simulated.address) as link:
        link.wait()
        time.sleep(0.1)
        if link.fault:
            return None
        how = {"do": name} if name in ("close", "stall", "zero", "stop") else {"how": name}
        done = simulated.do(**{"do": "spoil", **how})["time"]
        until = time.monotonic() + 1
        while link.fault is None and time.monotonic() < until:
            time.sleep(0.005)
        return link.fault, link.fault and link.fault.time - done


@pytest.mark.slow
def test_the_links_own_ways_to_fail_are_found_in_time():
    pytest.importorskip("rtde_receive")
    with rig() as simulated:
        for name, why in CLIENTS_FAULTS.items():
            for _ in range(TRIES):
                found = spoiled(simulated, name)
                simulated.do("heal")
                # a busy machine finds that no state comes before it finds out why
                if found and not (why == Ended.CLOSED and found[0].why == Ended.STALE):
                    break
            if name == "once short" and found == (None, None):
                continue  # what was cut off did no harm
            assert why in (None, found[0].why), name
            assert found[1] < STALE + WAKE + (0.15 if name == "late" else 0), name
        for do, why in (("refuse", Ended.REFUSED), ("mute", Ended.SILENT)):
            simulated.do(do)
            began = time.monotonic()
            with Link(simulated.address, start=1.0) as link:
                with pytest.raises(LinkFaultError):
                    link.wait()
                assert link.fault.why == why
                assert link.fault.time - began < 1.0 + WAKE
            simulated.do("heal")


@pytest.mark.slow
def test_a_robot_moves_within_its_limits_and_its_session_is_recorded_as_it_was(tmp_path):
    """It can go on after Ctrl-C, and ends by the first fault."""
    pytest.importorskip("rtde_control")
    limits = MotionLimits(np.radians([[-200.0, 200.0]] * 6), np.radians(30), np.radians(60))
    with rig(2) as simulated:
        ports, file = [Port(simulated.ring(i), 4) for i in range(2)], tmp_path / "file"
        with (
            Session(
                simulated.address, ports, Recording(file, {"rings": 2}), patience=PATIENCE
            ) as session,
            Mover(simulated.address, session.link, limits, patience=PATIENCE) as mover,
        ):
            link, begin = session.link, session.link.wait()
            goal = HOME + np.array([0.1, 0.05, -0.1, 0, 0, 0.02])
            mover.move(goal)
            np.testing.assert_allclose(link.latest().q, goal, atol=2e-3)
            states = [s for s in link._states if s.time > begin.time]
            assert max(np.abs(s.speed).max() for s in states) <= limits.speed + 1e-6
            # a shell starts what it runs in the background with SIGINT ignored
            kept = signal.signal(signal.SIGINT, signal.default_int_handler)
            timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
            timer.start()
            with pytest.raises(KeyboardInterrupt):
                mover.move(HOME + 1)
            signal.signal(signal.SIGINT, kept)
            session.say("rod", place=[0.1, 0.2, 0.3])
            mover.move(link.latest().q + 0.02)
            timer = threading.Timer(0.2, simulated.do, ("close",))
            timer.start()
            with pytest.raises(MoveStoppedError, match=Ended.CLOSED.value):
                mover.move(HOME - 0.6)
            timer.join()
            assert session.trouble
            with pytest.raises(LinkFaultError):
                link.latest()
    gathered, recorded = session.gathered, RecordingReader(file)
    found = replay(recorded.records(), ports, STALE * PATIENCE)
    assert recorded.ended
    assert gathered.fault.why == found.fault.why == Ended.CLOSED
    assert [s for _, s in found.said] == [s for _, s in gathered.said]
    told = rows(gathered)
    assert len(told[0]) > 50
    for now, again in zip(told, rows(found), strict=True):
        np.testing.assert_array_equal(now, again)
    time_, joints, ring, sensor, distance, _ = told
    true = 1 + 0.3 * np.sin(joints @ np.arange(1, 7) + ring + sensor)
    still = np.abs(joints - HOME).max(axis=1) < 1e-4
    assert np.abs(distance - true)[still].max() < 0.02
    assert (np.diff(time_) > -1).all()


ZONED = Setup(
    (SETUP.rings[0], replace(SETUP.rings[1], sensor=effective(Use("vl53l5cx-4x4")).sensor))
)
SERIALS = ("51D0000000000000", "51D0000000000001")  # of the simulated rings' boards


@pytest.mark.slow
def test_a_check_of_the_simulated_rig_and_its_replay_find_what_was_injected(
    tmp_path, monkeypatch, plans
):
    """Of a ring of single zones and a ring of sixteen."""
    pytest.importorskip("rtde_control")
    scene = replace(SCENE, targets=SHELLS.targets[1:])
    small, out = proposed(tmp_path, ZONED, scene), tmp_path / "live"
    monkeypatch.setattr(check_runs, "plan_check", lambda *_: plans)
    words = ["--rig", "sim", "--voxel", "0.1", "--bag"]
    assert call("check", small, *words, "--out", out) == 1
    result = result_of(out)
    assert result.verdict == "differs"
    assert all(result.mount.injected_found.values())
    assert [(c.named, c.trials) for c in result.coverage] == [("V_S(0.2)", 4)]
    assert [line.corrupt for line in result.lines] == [0, 0]
    recording = out / "recording-1.rig"
    assert call("check", "--replay", recording, "--out", tmp_path / "again") == 1
    for file in (tmp_path / "again").iterdir():
        assert file.read_bytes() == (out / file.name).read_bytes(), file.name


@pytest.mark.slow
def test_a_rig_at_an_address_is_read_and_moves_only_once_a_person_said_yes(
    tmp_path, monkeypatch, plans
):
    """As on a real rig, with its questions, but with more patience than a real one has."""
    pytest.importorskip("rtde_control")
    patient = partial(monkeypatch.setattr, live, "_REAL")
    motion = Motion(np.radians(60), np.radians(120), cell_complete=True, rings_as_proposed=True)
    scene, q, answers = replace(SCENE, motion=motion), SCENE.poses[0].q, []
    setup = Setup(tuple(replace(r, serial=s) for r, s in zip(SETUP.rings, SERIALS, strict=True)))
    small = proposed(tmp_path, setup, scene)
    monkeypatch.setattr(rig_options, "Port", partial(Port, patience=25.0))
    few = replace(plans.mount, stops=plans.mount.stops[:4])  # three hardly suffice for the tool
    monkeypatch.setattr(
        check_runs,
        "plan_check",
        lambda setup, scene, options, moved: Plans(
            1.0, None if options.parts == ("self",) else few
        ),
    )
    monkeypatch.setattr("builtins.input", lambda *_: answers.pop(0))
    with simulated_rig(scene, setup, 0, tmp_path, "none") as rig:
        words = ["check", small, "--robot-host", rig.address, "--voxel", "0.1"]
        mount = ["--part", "mount"]
        one, other = rig.ring(1), rig.ring(0)
        swapped = ["--ring", f"forearm={one}", "--ring", f"tool={other}"]
        patient(5.0)  # as long as it waits for each ring's frames, three seconds times this
        with refused(one, other, "forearm", "tool") as error:
            call(*words, *swapped, "--part", "self", "--out", tmp_path / "swapped")
        right = re.search(r"(--ring \S+=\S+ --ring \S+=\S+)", str(error.value))[1].split()
        words += right
        patient(25.0)
        assert call(*words, "--part", "self", "--out", tmp_path / "looked") == 0
        answers += ["no"]
        with refused("yes"):
            call(*words, *mount, "--move", "--out", tmp_path / "refused")
        answers += ["s", "q"]
        assert call(*words, *mount, "--out", tmp_path / "left") == 3
        np.testing.assert_allclose(rig.do("state")["q"], q)
        answers += ["yes"]
        assert call(*words, *mount, "--move", "--out", tmp_path / "moved") in (0, 1)
        assert np.abs(np.subtract(rig.do("state")["q"], q)).max() > 0.1
    assert answers == []
    moved = result_of(tmp_path / "moved")
    assert (moved.simulated, moved.warnings) == (False, [])
    assert (moved.mount.stops, moved.mount.injected_found) == (4, None)


@pytest.mark.slow
def test_a_robot_that_cannot_move_is_refused_before_the_question(tmp_path, monkeypatch, plans):
    """Nobody is asked, and nothing moves."""
    pytest.importorskip("rtde_control")
    monkeypatch.setattr(live, "_REAL", 25.0)
    monkeypatch.setattr(rig_options, "Port", partial(Port, patience=25.0))
    monkeypatch.setattr(check_runs, "plan_check", lambda *_: Plans(None, plans.mount))
    monkeypatch.setattr("builtins.input", Mock(side_effect=AssertionError))
    scene = replace(SCENE, motion=Motion(cell_complete=True, rings_as_proposed=True))
    named = Setup(tuple(replace(r, serial=s) for r, s in zip(SETUP.rings, SERIALS, strict=True)))
    small = proposed(tmp_path, named, scene)
    faults = {
        "POWER_OFF": {"do": "mode", "how": "POWER_OFF"},
        "IDLE": {"do": "mode", "how": "IDLE"},
        "input_double_register_3": {"do": "hold", "inputs": ["input_double_register_3"]},
        "30001": {"do": "mute"},  # it does not state which arm it moves
        SERIALS[1]: {"do": "exchange", "ring": 1, "serial": 5},
    }
    with simulated_rig(scene, named, 0, tmp_path, "none") as rig:
        words = ["check", small, "--robot-host", rig.address, "--part", "mount", "--move"]
        words += [f"--ring={name}={rig.ring(i)}" for i, name in enumerate(("forearm", "tool"))]
        before = rig.do("state")["q"]
        for n, (part, fault) in enumerate(faults.items()):
            rig.do(**fault)
            with refused(part):
                call(*words, "--out", tmp_path / str(n))
            rig.do("heal")
        assert rig.do("state")["q"] == before


# becomes Python with what follows, its input the terminal of its session: JAX forbids a fork here
_IN_TERMINAL = (
    "import fcntl, os, sys, termios;"
    "fcntl.ioctl(0, termios.TIOCSCTTY, 0);"
    "os.execv(sys.executable, [sys.executable, *sys.argv[1:]])"
)


@pytest.mark.slow
def test_a_terminal_that_hangs_up_ends_a_moving_check_in_order(tmp_path):
    """The robot is stopped, what was read is judged and written, no process and no folder stays."""
    pytest.importorskip("rtde_control")
    proposed(tmp_path, SETUP, SCENE)
    (tmp_path / "temporary").mkdir()
    words = ["check", "small.toml", "--rig", "sim", "--part", "mount", "--stops", "4"]
    master, slave = pty.openpty()
    with subprocess.Popen(
        [
            sys.executable,
            "-c",
            _IN_TERMINAL,
            "-m",
            "place_rings.cli.entry",
            *words,
            "--voxel",
            "0.1",
        ],
        cwd=tmp_path,
        env={**os.environ, "TMPDIR": str(tmp_path / "temporary")},
        stdin=slave,
        stdout=slave,
        stderr=slave,
        start_new_session=True,
    ) as process:
        os.close(slave)
        recording = tmp_path / "place-rings-check" / "recording-1.rig"
        while process.poll() is None and not (
            recording.exists() and b'"near stop"' in recording.read_bytes()
        ):
            if select.select([master], [], [], 0.05)[0]:
                with suppress(OSError):
                    os.read(master, 4096)
        time.sleep(0.7)
        family = psutil.Process(process.pid).children(recursive=True)
        assert len(family) == 3
        os.close(master)
        assert process.wait(300) == 3
    assert psutil.wait_procs(family, 30)[1] == []
    assert list((tmp_path / "temporary").glob("*rig*")) == []
    result = result_of(recording.parent)
    assert result.verdict == "unfinished"
    assert any("SIGHUP" in reason and UNSEEN not in reason for reason in result.reasons)
