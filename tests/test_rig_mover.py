"""What a mover allows, asks for and tells, with a link and a process that do what the test says."""

import sys
from pathlib import Path

import numpy as np
import pytest
from place_rings.rig.robot import motion
from place_rings.rig.robot.motion import Limits, Mover, MoveRefusedError, MoveStoppedError
from place_rings.rig.robot.state import State
from place_rings.rig.robot.vetting import Ended, LinkFaultError

HOME = np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])
LIMITS = Limits(np.radians([[-200.0, 200.0]] * 6), np.radians(30), np.radians(60))
CHILD = """
import os, sys, time
from pathlib import Path
from place_rings.rig.recording.records import Kind, Record, RecordReader
tell = lambda word: os.write(1, Record(Kind.DONE, 0, 0.0, word.encode()).pack())
tell("ready")
reader, log = RecordReader(), Path(sys.argv[1])
while data := os.read(0, 4096):
    for record in reader.feed(data):
        with log.open("a") as file: file.write(record.kind.name + chr(10))
        if record.kind == Kind.MOVE and log.with_name("dies").exists(): os._exit(3)
        tell("moving" if record.kind == Kind.MOVE else "stopping")
"""


class Told:
    """A link whose robot is at the next place whenever it is asked, and stays at the last."""

    def __init__(self):
        self.path, self.fault = [HOME], None

    def latest(self):
        if self.fault and len(self.path) == 1:
            raise self.fault
        return State(0.0, 0.0, self.path.pop(0) if len(self.path) > 1 else self.path[0], np.zeros(6))


@pytest.fixture
def rig(tmp_path, monkeypatch):
    monkeypatch.setattr(motion, "_TOLD", 20.0)  # s: nothing here measures a time
    link, asked = Told(), []
    log = tmp_path / "log"
    log.touch()

    def make(**more):
        asked.append(Mover("127.0.8.1", link, LIMITS, command=(sys.executable, "-c", CHILD, str(log)), **more))
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
    make().move(goal)
    assert told(log) == ["MOVE"]
    assert len(link.path) == 1


@pytest.mark.parametrize(
    ("q", "text"),
    [
        (HOME[:5], "found 5 joint angles"),
        (HOME * np.nan, "not finite"),
        (HOME + np.radians([0, 0, 0, 0, 0, 300]), "joint 5: found 300°, allowed: -200° to 200°"),
        (HOME[None], "found 6 joint angles, allowed: 6"),
    ],
)
def test_what_may_not_be_is_refused_and_nothing_moves(rig, q, text):
    _, make, log = rig
    with pytest.raises(MoveRefusedError, match=text):
        make().move(q)
    assert told(log) == []


def test_danger_on_the_way_there_or_now_is_refused(rig):
    link, make, log = rig
    half = HOME[0] + 0.25
    with pytest.raises(MoveRefusedError, match="of the way: the tool near the forearm"):
        make(fault_at=lambda q: "the tool near the forearm" if abs(q[0] - half) < 0.02 else None).move(HOME + 0.5)
    with pytest.raises(MoveRefusedError, match="ring 1 reads 40 mm"):
        make(danger=lambda: "ring 1 reads 40 mm").move(HOME)
    link.fault, link.path = LinkFaultError(Ended.STALE), [HOME]
    with pytest.raises(MoveRefusedError, match="no new state"):
        make().move(HOME)
    assert told(log) == []


def test_whatever_ends_a_motion_stops_the_robot_first(rig):
    link, make, log = rig
    near = iter([None, None, "ring 1 reads 40 mm"])
    with pytest.raises(MoveStoppedError, match="ring 1 reads 40 mm"):
        make(danger=lambda: next(near)).move(HOME + 0.1)

    turns = iter([None, None])

    def control_c():
        for turn in turns:
            return turn
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make(danger=control_c).move(HOME + 0.1)
    link.path, link.fault = [HOME] * 4, LinkFaultError(Ended.CLOSED)
    with pytest.raises(MoveStoppedError, match="closed"):
        make().move(HOME + 0.1)
    assert told(log) == ["MOVE", "STOP"] * 3


def test_a_process_that_dies_is_a_stop_and_one_that_never_was_ready_a_refusal(rig):
    _, make, log = rig
    log.with_name("dies").touch()
    with pytest.raises(MoveStoppedError, match="the client's process ended"):
        make().move(HOME + 0.1)
    with pytest.raises(MoveRefusedError, match="cannot be controlled: the client's process ended by 5"):
        Mover("nowhere", Told(), LIMITS, command=(sys.executable, "-c", "raise SystemExit(5)"))


@pytest.mark.parametrize("speed", [0.0, -1.0, 1.1, np.nan, np.inf])
def test_limits_are_low(speed):
    with pytest.raises(ValueError, match="speed: found"):
        Limits(LIMITS.joints, speed)
    assert Limits(LIMITS.joints).speed <= np.radians(20)
