"""What a mover allows, asks for and tells, with a link and a process that do what the test says."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from place_rings.rig.check.actors import MovedRobot
from place_rings.rig.recording.records import Kind, Record, RecordReader
from place_rings.rig.robot import motion
from place_rings.rig.robot.link import Link
from place_rings.rig.robot.motion import (
    UNSEEN,
    MotionLimits,
    MoveHeldError,
    Mover,
    MoveRefusedError,
    MoveStoppedError,
)
from place_rings.rig.robot.motion_process import LEAVE, SIGN
from place_rings.rig.robot.state import State, pack_move
from place_rings.rig.robot.vetting import Ended, LinkFaultError

from ..support.refusals import refused

HOME = np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])
LIMITS = MotionLimits(np.radians([[-200.0, 200.0]] * 6), np.radians(30), np.radians(60))
PATIENCE = 40.0  # nothing here measures a time
CHILD = """
import os, sys, time
from pathlib import Path
from place_rings.rig.recording.records import Kind, Record, RecordReader
tell = lambda word: os.write(1, Record(Kind.DONE, 0, 0.0, word.encode()).pack())
tell("ready")
reader, log = RecordReader(), Path(sys.argv[1])
while data := os.read(0, 4096):
    for record in reader.feed(data):
        if record.kind != Kind.ALIVE:
            with log.open("a") as file: file.write(record.kind.name + chr(10))
        if record.kind == Kind.MOVE and log.with_name("dies").exists(): os._exit(3)
        tell({Kind.MOVE: "moving", Kind.STOP: "stopping"}.get(record.kind, "alive"))
"""


class Told(Link):
    """A link whose robot is at the next place whenever it is asked, and stays at the last."""

    robot = fault = None

    def __init__(self):
        self.path, self.fault, self.clock = [HOME], None, 0.0

    def latest(self):
        if self.fault and len(self.path) == 1:
            raise self.fault
        self.clock += 0.008
        return State(
            time.monotonic(),
            self.clock,
            self.path.pop(0) if len(self.path) > 1 else self.path[0],
            np.zeros(6),
        )


@pytest.fixture
def rig(tmp_path):
    link, asked = Told(), []
    log = tmp_path / "log"
    log.touch()

    def make(**more):
        words = (sys.executable, "-c", CHILD, str(log))
        asked.append(Mover("127.0.8.1", link, LIMITS, patience=PATIENCE, command=words, **more))
        return asked[-1]

    yield link, make, log
    for mover in asked:
        mover.close()


def told(log: Path) -> list[str]:
    return log.read_text().split()


def test_it_waits_until_the_robot_is_there(rig):
    link, make, log = rig
    goal = HOME + 0.1
    link.path = [HOME, HOME, HOME, HOME + 0.05, goal]
    with make() as mover:
        mover.move(goal)
    assert told(log) == ["MOVE", "STOP"]
    assert len(link.path) == 1


@pytest.mark.parametrize(
    ("q", "parts"),
    [
        (HOME[:5], ("5 joint angles",)),
        (HOME * np.nan, ("finite",)),
        (HOME + np.radians([0, 0, 0, 0, 0, 300]), ("joint 5", "300°", "-200°", "200°")),
        (HOME[None], ("6 joint angles",)),
    ],
)
def test_what_may_not_be_is_refused_and_nothing_moves(rig, q, parts):
    _, make, log = rig
    with refused(*parts, error=MoveRefusedError):
        make().move(q)
    assert told(log) == []


def test_danger_on_the_way_there_or_now_is_refused(rig):
    link, make, log = rig
    half, wrong = HOME[0] + 0.25, "the tool near the forearm"
    with refused(wrong, error=MoveRefusedError):
        make(fault_at=lambda q: wrong if abs(q[0] - half) < 0.02 else None).move(HOME + 0.5)
    with refused("ring 1 reads 40 mm", error=MoveRefusedError):
        make(danger=lambda: "ring 1 reads 40 mm").move(HOME)
    link.fault, link.path = LinkFaultError(Ended.STALE), [HOME]
    with refused(Ended.STALE.value, error=MoveRefusedError):
        make().move(HOME)
    assert told(log) == []


def test_whatever_ends_a_motion_stops_the_robot_first(rig):
    link, make, log = rig
    near = iter([None, None, "ring 1 reads 40 mm"])
    with refused("ring 1 reads 40 mm", error=MoveStoppedError):
        make(danger=lambda: next(near)).move(HOME + 0.1)

    turns = iter([None, None])

    def control_c():
        for turn in turns:
            return turn
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make(danger=control_c).move(HOME + 0.1)
    link.path, link.fault = [HOME] * 4, LinkFaultError(Ended.CLOSED)
    with refused(Ended.CLOSED.value, error=MoveStoppedError):
        make().move(HOME + 0.1)
    assert told(log) == ["MOVE", "STOP"] * 3


def test_a_process_that_dies_is_a_stop_and_one_that_never_was_ready_a_refusal(rig):
    _, make, log = rig
    log.with_name("dies").touch()
    with refused("3", error=MoveStoppedError):
        make().move(HOME + 0.1)
    with refused("nowhere", "5", error=MoveRefusedError):
        Mover("nowhere", Told(), LIMITS, command=(sys.executable, "-c", "raise SystemExit(5)"))


@pytest.mark.parametrize("speed", [0.0, -1.0, 1.1, np.nan, np.inf])
def test_limits_are_low(speed):
    with refused("speed", f"{speed:g}", error=ValueError):
        MotionLimits(LIMITS.joints, speed)
    assert MotionLimits(LIMITS.joints).speed <= np.radians(20)


SILENT = """
import os, sys, time
from place_rings.rig.recording.records import Kind, Record
tell = lambda word: os.write(1, Record(Kind.DONE, 0, 0.0, word.encode()).pack())
tell("ready")
os.read(0, 4096)
tell("moving")
os.read(0, 4096)
time.sleep(60)
"""


def test_a_process_that_says_nothing_any_more_and_a_robot_that_is_not_seen_to_stand_are_told():
    link = Told()
    # it moves, whatever it is told
    link.latest = lambda: State(time.monotonic(), time.monotonic(), HOME, np.full(6, 0.3))
    words, alarms = (sys.executable, "-c", SILENT), []
    stopping = pytest.raises(MoveStoppedError)
    with (
        Mover("127.0.8.1", link, LIMITS, alarm=alarms.append, command=words) as mover,
        stopping as stopped,
    ):
        mover.move(HOME + 1)
    assert alarms == [str(stopped.value)]
    assert str(stopped.value).endswith(UNSEEN)


def test_a_check_that_was_held_up_itself_says_so(rig):
    _, make, _ = rig
    with make(danger=lambda: time.sleep(0.3)) as mover:
        mover._patience = 1.0
        with refused(f"{SIGN:g} s", error=MoveStoppedError):
            mover.move(HOME + 1)


@pytest.mark.parametrize("way", [0.0, 0.03])
def test_a_robot_that_something_holds_is_stopped(rig, monkeypatch, way):
    """It must not go on by itself once its slider is released: at its start, or on its way."""
    monkeypatch.setattr(motion, "HELD", 0.1 / PATIENCE)
    link, make, log = rig
    link.path = [HOME, HOME, HOME + way]
    with make() as mover, pytest.raises(MoveHeldError):
        mover.move(HOME + 0.5)
    assert told(log) == ["MOVE", "STOP"]


def test_a_robot_that_creeps_is_not_held(rig, monkeypatch):
    monkeypatch.setattr(motion, "HELD", 0.1 / PATIENCE)
    link, make, log = rig
    goal = HOME + 0.2
    link.path = [HOME, HOME, *(HOME + 0.2 * i / 40 for i in range(40)), goal]
    with make() as mover:
        mover.move(goal)
    assert told(log) == ["MOVE", "STOP"]


@pytest.mark.parametrize(
    ("answers", "moves", "ends"),
    [([True], 2, False), ([True, True], 3, False), ([False], 1, True), (None, 1, True)],
)
def test_a_robot_that_was_held_goes_on_only_if_a_person_says_so(answers, moves, ends):
    tried, asked, held = [], iter(answers or []), MoveHeldError("it stood still")
    robot = MovedRobot.__new__(MovedRobot)
    robot._session = Mock()
    robot._ask = None if answers is None else lambda words: next(asked)

    def move(node):
        tried.append(node)
        if len(tried) <= len(answers or [None]):
            raise held

    robot._move = move
    if ends:
        with pytest.raises(MoveHeldError):
            robot._reach(3)
    else:
        robot._reach(3)
    assert tried == [3] * moves


CLIENT = """
import sys, time, types
from place_rings.rig.robot import motion_process

class RTDEControlInterface:
    def __init__(self, host): self.program = True
    def setWatchdog(self, hz): return True
    def isConnected(self): return {connected}
    def kickWatchdog(self): {kick}
    def moveJ(self, *words): {move}
    def stopJ(self, *words): {stop}
    def stopScript(self): pass

sys.modules["rtde_control"] = types.SimpleNamespace(RTDEControlInterface=RTDEControlInterface)
sys.argv = ["", "host", "{patience}"]
motion_process.main()
"""
HANGS, WELL = "time.sleep(600)", "return True"


@contextmanager
def serving(patience=0.2, **deeds):
    """The process that moves a robot, through a client that does what is said."""
    code = CLIENT.format(
        patience=patience,
        **({"connected": "True", "kick": WELL, "move": WELL, "stop": WELL} | deeds),
    )
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=pipe, stdout=pipe, bufsize=0
    ) as process:
        yield process
        process.kill()


def heard(process):
    """All that it says until it ends."""
    return [r.data.decode() for r in RecordReader().feed(process.stdout.read())]


MOVE = Record(Kind.MOVE, 0, 0.0, pack_move(HOME, 0.1, 0.1)).pack()


@pytest.mark.parametrize(
    "deeds", [{"stop": HANGS}, {"kick": HANGS}, {"move": HANGS}, {"stop": "raise OSError('gone')"}]
)
def test_it_ends_once_the_check_is_gone_whatever_the_controller_does(deeds):
    with serving(**deeds) as process:
        process.stdin.write(MOVE)
        process.stdin.close()
        process.stdin = None
        assert process.wait(60) is not None


def test_a_call_that_hangs_as_the_check_goes_is_part_of_the_time_it_has_to_leave():
    with serving(patience=1.0, kick="time.sleep(1.5); return True", stop=HANGS) as process:
        assert b"ready" in os.read(process.stdout.fileno(), 4096)
        time.sleep(0.2)  # it hangs in its first sign of life
        process.stdin.close()
        process.stdin, gone = None, time.monotonic()
        process.wait(60)
        assert time.monotonic() - gone < LEAVE + 0.5


def test_it_stops_the_robot_where_the_check_is_silent_during_a_motion_and_only_then():
    with serving(patience=1.0, stop="self.stopped = True; return True") as process:
        time.sleep(3 * SIGN)  # at rest nothing is expected
        process.stdin.write(MOVE)
        reader, said = RecordReader(), []
        while not any("sign of life" in word for word in said):
            said += [r.data.decode() for r in reader.feed(os.read(process.stdout.fileno(), 4096))]
        assert said[:2] == ["ready", "moving"]
        process.stdin.close()
        process.stdin = None
        assert process.wait(60) == 0


@pytest.mark.parametrize(
    ("deeds", "said"),
    [
        ({"connected": "False"}, "closed"),
        ({"kick": "return False"}, "pendant"),
        ({"kick": "time.sleep(0.1); return False"}, "watchdog"),
        ({"move": "return False"}, "refused"),
    ],
)
def test_what_ends_a_motion_is_named(deeds, said):
    with serving(**deeds) as process:
        process.stdin.write(MOVE)
        process.stdin.close()
        process.stdin = None
        assert any(said in word for word in heard(process))


def test_a_robot_that_is_about_to_move_does_not_stand_still(rig):
    """States of before the stop, however still, are no proof: only those that come after it."""
    link, make, _ = rig
    begun = time.monotonic()
    link.latest = lambda: State(begun, link.clock, HOME, np.zeros(6))  # the last one, for ever
    with make() as mover:
        mover._patience = 0.1
        assert not mover._stands(link)


def test_signals_during_a_motion_are_noted_and_end_it_once(rig):
    """Two signals at once raise nothing while the robot is being stopped."""
    _, make, log = rig
    # a shell starts what it runs in the background with SIGINT ignored
    kept = signal.signal(signal.SIGINT, signal.default_int_handler)
    before, calls = signal.getsignal(signal.SIGINT), []

    def strike():
        calls.append(1)
        if len(calls) > 1:  # the first is asked before the motion begins
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)

    try:
        with make(danger=strike) as mover, pytest.raises(KeyboardInterrupt):
            mover.move(HOME + 0.5)  # long enough that the second strike comes on the way
        assert told(log) == ["MOVE", "STOP"]
        assert signal.getsignal(signal.SIGINT) is before
    finally:
        signal.signal(signal.SIGINT, kept)
