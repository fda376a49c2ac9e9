"""Motion: refused before it begins, stopped by whatever goes wrong, through the unmodified client
and a simulated robot.
"""

import os
import signal
import threading
import time

import numpy as np
import pytest
from place_rings.rig.recording.recording import Recording, RecordingReader
from place_rings.rig.rings.line_monitor import Port
from place_rings.rig.robot.link import Link
from place_rings.rig.robot.motion import MotionLimits, Mover, MoveRefusedError, MoveStoppedError
from place_rings.rig.robot.vetting import STALE, Ended, LinkFaultError
from place_rings.rig.session.gathering import replay
from place_rings.rig.session.session import Session
from place_rings.rig.simulated.process import SimulatedRig, command

pytest.importorskip("rtde_control")
pytestmark = pytest.mark.slow  # processes that wait for each other, each with a patience of its own
HOME = np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])
PATIENCE = 6.0  # a busy machine keeps processes waiting
LIMITS = MotionLimits(np.radians([[-200.0, 200.0]] * 6), np.radians(30), np.radians(60))


def rig(rings=1, sensors=4, rate=15.0):
    return SimulatedRig((("-m", "place_rings.rig.simulated"), command(rings, sensors, rate)))


@pytest.fixture(scope="module")
def robot():
    with rig() as simulated, Link(simulated.address, patience=PATIENCE) as link:
        link.wait()
        yield simulated, link


@pytest.fixture(scope="module")
def mover(robot):
    with Mover(robot[0].address, robot[1], LIMITS, patience=PATIENCE) as found:
        yield found


def later(do):
    timer = threading.Timer(0.2, do)
    timer.start()
    return timer


def at_rest(simulated):
    before = simulated.do("state")
    time.sleep(0.05)
    return np.abs(np.subtract(simulated.do("state")["q"], before["q"])).max() < 1e-3


def test_it_goes_where_it_is_told_no_faster_than_allowed(robot, mover):
    goal = HOME + np.array([0.1, 0.05, -0.1, 0, 0, 0.02])
    begin = robot[1].latest()
    mover.move(goal)
    np.testing.assert_allclose(robot[1].latest().q, goal, atol=2e-3)
    states = [s for s in robot[1]._states if s.time > begin.time]
    assert max(np.abs(s.speed).max() for s in states) <= LIMITS.speed + 1e-6
    assert len(states) > 10
    times = np.array([s.time for s in states[2:-2]]) + 0.001
    found = robot[1].joints(times)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found, [s.q for s in states[2:-2]], atol=0.01)


def test_a_near_reading_stops_it(robot, mover, monkeypatch):
    near = []
    monkeypatch.setattr(mover, "_danger", lambda: near[0] if near else None)
    timer = later(lambda: near.append("ring 1 reads 40 mm"))
    with pytest.raises(MoveStoppedError, match="ring 1 reads 40 mm"):
        mover.move(HOME + 1)
    timer.join()
    assert at_rest(robot[0])
    with pytest.raises(MoveRefusedError, match="ring 1"):
        mover.move(HOME)


def test_control_c_stops_it(robot, mover):
    timer = later(lambda: os.kill(os.getpid(), signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        mover.move(HOME + 1)
    timer.join()
    assert at_rest(robot[0])
    mover.move(robot[1].latest().q + 0.02)  # and it can go on


def test_a_killed_client_stops_it_by_the_robots_watchdog(robot, mover):
    """The last that the mover is good for."""
    timer = later(mover._control.kill)
    with pytest.raises(MoveStoppedError, match="the client's process ended"):
        mover.move(HOME - 1)
    timer.join()
    assert at_rest(robot[0])


def test_a_session_is_gathered_recorded_and_replayed_and_ends_by_its_fault(tmp_path):
    with rig(rings=2) as simulated:
        ports = [Port(simulated.ring(i), 4) for i in range(2)]
        with Session(
            simulated.address, ports, Recording(tmp_path / "file", {"rings": 2}), patience=PATIENCE
        ) as session:
            session.link.wait()
            with Mover(simulated.address, session.link, LIMITS, patience=PATIENCE) as mover:
                mover.move(HOME + 0.05)
                session.say("rod", place=[0.1, 0.2, 0.3])
                timer = later(lambda: simulated.do("close"))
                with pytest.raises(MoveStoppedError, match="closed"):
                    mover.move(HOME - 0.6)
                timer.join()
            assert session.trouble
            with pytest.raises(LinkFaultError):
                session.link.latest()
    gathered, recorded = session.gathered, RecordingReader(tmp_path / "file")
    found = replay(recorded, ports, STALE * PATIENCE)
    assert recorded.ended
    assert gathered.fault.why == found.fault.why == Ended.CLOSED
    assert [s for _, s in found.said] == [s for _, s in gathered.said]
    rows = gathered.rows(2)
    assert len(rows[0]) > 50
    for live, again in zip(rows, found.rows(2), strict=True):
        np.testing.assert_array_equal(live, again)
    time_, joints, ring, sensor, distance, _ = rows
    true = 1 + 0.3 * np.sin(joints @ np.arange(1, 7) + ring + sensor)
    still = np.abs(joints - HOME).max(axis=1) < 1e-4
    assert np.abs(distance - true)[still].max() < 0.02
    assert (np.diff(time_) > -1).all()
