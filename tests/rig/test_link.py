"""The link to the robot: states that cannot be true, stale or late are never given; every end is a
fault of its kind. How soon the client's own faults are found stands in test_live.
"""

import itertools
import os
import struct
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from place_rings.rig.check.preconditions import require_free_inputs
from place_rings.rig.recording.records import Kind, Record
from place_rings.rig.robot.link import Link
from place_rings.rig.robot.motion import MotionLimits, Mover, MoveRefusedError
from place_rings.rig.robot.rtde_requests import INPUTS, PORT, inputs_in_use, refusal
from place_rings.rig.robot.state import RobotMode, State
from place_rings.rig.robot.vetting import STALE, Ended, LinkFaultError, Vetting, between
from place_rings.rig.simulated.process import SimulatedRig, command

from ..support.refusals import refused
from ..support.sockets import serve_once

HOME = np.radians([0.0, -45.0, 60.0, -105.0, -90.0, 0.0])
PATIENT = 0.6  # s, that states may be apart where they are not
PATIENCE = PATIENT / STALE
joint = st.integers(0, 5)


def state(n, q=HOME, speed=None, **more):
    """The n-th of 125 states a second."""
    return replace(
        State(100 + n / 125, 7 + n / 125, np.array(q), np.zeros(6) if speed is None else speed),
        **more,
    )


def taken(states):
    """How many states are taken before a fault, and why it ended."""
    vetting = Vetting()
    for count, each in enumerate(states):
        try:
            vetting.take(Record(Kind.STATE, 0, each.time, each.pack()))
        except LinkFaultError as fault:
            return count, fault.why
    return len(states), None


def good(n=10):
    return [state(i) for i in range(n)]


@given(st.integers(0, 2**32 - 1), st.floats(-2e-4, 2e-4))
def test_a_robot_that_moves_as_it_may_is_believed(seed, drift):
    rng = np.random.default_rng(seed)
    q, speed, states, delay = HOME.copy(), np.zeros(6), [], rng.uniform(0, 0.02, 80)
    for n in range(80):
        before = speed
        speed = np.clip(speed + rng.uniform(-40, 40, 6) / 125, -3.1, 3.1) * (np.abs(q) < 5)
        q = q + (before + speed) / 2 / 125
        states.append(State(50 + n / 125 + delay[n], 3 + (1 + drift) * n / 125, q, speed))
    assert taken(states) == (80, None)


def spoiled(at, value, by=HOME):
    q = by.copy()
    q[at] = value
    return q


impossible = st.sampled_from([np.nan, np.inf, -np.inf, 6.5, -1e300, 1e-310 + 7])
jumps = st.floats(2, 300) | st.floats(-300, -2)


@given(
    st.builds(spoiled, joint, impossible)
    | st.builds(lambda at, by: spoiled(at, HOME[at] + np.radians(by)), joint, jumps)
    | st.binary(min_size=48, max_size=48).map(np.frombuffer)
)
def test_joint_angles_that_cannot_follow_are_never_taken(q):
    assume(not np.allclose(q, HOME, rtol=0, atol=0.01))
    assert taken([*good(), state(10, q)]) == (10, Ended.GARBLED)


@given(joint, impossible)
def test_speeds_that_cannot_be_are_never_taken(at, value):
    assume(not abs(value) < 6.4)
    last = state(10, speed=spoiled(at, value, np.zeros(6)))
    assert taken([*good(), last])[1] == Ended.GARBLED


@pytest.mark.parametrize("clock", [np.nan, 0, 1e9, 1e200, 1.7e308, 9, 7 + 9 / 125, 7.2])
def test_a_clock_that_jumps_ends_it(clock):
    assert taken([*good(), state(10, clock=float(clock))]) == (10, Ended.GARBLED)


@given(st.floats(STALE + 0.002, 10))
def test_a_state_that_came_late_is_never_taken(delay):
    assert taken([*good(), replace(state(10), time=100 + 10 / 125 + delay)]) == (10, Ended.LATE)


def test_a_delay_that_creeps_in_ends_it_before_it_is_too_long():
    states = [replace(state(n), time=100 + 1.1 * n / 125) for n in range(500)]
    count, why = taken(states)
    assert why == Ended.LATE
    assert 0.1 * count / 125 == pytest.approx(STALE, abs=0.02)


@given(st.floats(1.05, 1000), st.floats(0, 1e6))
def test_a_clock_that_runs_fast_ends_it_before_a_delay_can_hide(rate, start):
    states = [replace(state(n), clock=start + rate * n / 125) for n in range(400)]
    count, why = taken(states)
    assert why == Ended.GARBLED
    assert (rate - 1.02) * (count - 2) / 125 <= STALE


@pytest.mark.parametrize("bits", [0] + [1 << n for n in range(2, 11)] + [1 | 1 << 2, 1 | 1 << 7])
def test_a_safety_stop_ends_it(bits):
    assert taken([*good(), state(10, safety=bits)]) == (10, Ended.STOPPED)
    assert taken([*good(), state(10, safety=2)]) == (11, None)
    vetting, stopped = Vetting(through_stops=True), state(0, safety=bits)
    assert vetting.take(Record(Kind.STATE, 0, stopped.time, stopped.pack())).safety == bits


@given(st.binary(max_size=200))
def test_a_record_of_another_length_is_garbled(data):
    assume(len(data) != len(state(0).pack()))
    with pytest.raises(LinkFaultError) as fault:
        Vetting().take(Record(Kind.STATE, 0, 0.0, data))
    assert fault.value.why == Ended.GARBLED


@given(
    st.lists(st.floats(0.001, 0.12), min_size=2, max_size=30),
    st.lists(st.floats(-0.2, 4), min_size=1, max_size=30),
)
def test_between_fresh_neighbours_alone_it_interpolates(steps, times):
    known = np.cumsum(steps)
    states = [State(t, t, np.full(6, 3 * t), np.zeros(6)) for t in known]
    found = between(states, np.array(times))
    for t, q in zip(times, found, strict=True):
        after = np.searchsorted(known, t)
        inside = known[0] <= t <= known[-1]
        fresh = inside and (t in known or known[after] - known[after - 1] <= 0.05)
        if np.isfinite(q).all():
            assert inside
            np.testing.assert_allclose(q, 3 * t, atol=1e-9)
        else:
            assert not fresh or t in known


def child(code):
    """A process in the place of the client's, with states to say."""
    begin = """
import sys, time, numpy as np
from place_rings.rig.recording.records import Kind, Record
from place_rings.rig.robot.state import State
def say(n, count):
    for i in range(n, n + count):
        now = time.monotonic()
        record = Record(Kind.STATE, 0, now, State(now, now, np.zeros(6), np.zeros(6)).pack()).pack()
        sys.stdout.buffer.write(record); sys.stdout.buffer.flush(); time.sleep(0.008)
say(0, 10)
"""
    return sys.executable, "-c", begin + code


SAYS = "sys.stdout.buffer.write({}); sys.stdout.buffer.flush(); time.sleep(9)"


@pytest.mark.parametrize(
    ("code", "why"),
    [
        ("time.sleep(9)", Ended.STALE),
        ("import os; os.abort()", Ended.ABORTED),
        (SAYS.format("b'x' * 99"), Ended.GARBLED),
        (SAYS.format("Record(Kind.CLOSED, 0, 0.0).pack()"), Ended.CLOSED),
    ],
)
def test_whatever_the_process_does_is_a_fault(code, why):
    faults = []
    with Link("nowhere", command=child(code), on_fault=faults.append, patience=PATIENCE) as link:
        link.wait()
        while link.fault is None:
            time.sleep(0.005)
        assert link.fault.why == why
        for ask in (link.latest, link.wait):
            with pytest.raises(LinkFaultError):
                ask()
    assert [fault.why for fault in faults] == [why]


def test_a_state_that_grew_old_is_not_given_even_before_its_fault_is_found():
    with Link("nowhere", command=child("say(10, 900)"), patience=PATIENCE) as link:
        link.wait()
        with link._changed:  # the link's thread is held up
            time.sleep(PATIENT + 0.02)
            assert link.fault is None
            with pytest.raises(LinkFaultError) as fault:
                link.latest()
        assert fault.value.why == Ended.STALE


def test_nobody_there_is_one_line():
    pytest.importorskip("rtde_receive")
    with Link("127.0.0.1") as link:
        with refused(error=LinkFaultError):
            link.wait()
        assert link.fault.why == Ended.REFUSED


_HOSTS = itertools.count(1)  # an address of its own for each controller


def controller(talk):
    """Serve a controller at its port of a new loopback address; return the address."""
    address = f"127.{os.getpid() % 250 + 1}.7.{next(_HOSTS)}"
    serve_once(talk, address, PORT)
    return address


def answering(*answers):
    """Serve a controller's packages; return its address."""

    def talk(client):
        assert client.recv(100) == struct.pack(">HBH", 5, ord("V"), 2)
        for kind, data in answers:
            client.sendall(struct.pack(">HB", 3 + len(data), ord(kind)) + data)

    return controller(talk)


@pytest.mark.parametrize(
    ("answers", "refuses"),
    [
        ([("V", b"\1")], False),
        ([("V", b"\0")], True),
        ([("M", b"a message"), ("M", b"one more"), ("V", b"\0")], True),
        ([], False),
    ],
)
def test_a_controller_that_refuses_the_version_is_named(answers, refuses):
    said = refusal(answering(*answers), 20.0)
    assert bool(said) == refuses
    assert not refuses or "version 2" in said


def holding(held):
    """Serve a controller whose ``held`` inputs another client has; return its address."""

    def answer(line):
        while head := line.read(3):
            size, kind = struct.unpack(">HB", head)
            data = line.read(size - 3)
            if kind == ord("V"):
                yield kind, b"\1"
            else:
                names = data.decode().split(",")
                some = any(name in held for name in names)
                kinds = ["IN_USE" if n in held else "INT32" for n in names]
                yield ord("M"), b"a message"
                yield kind, bytes([not some]) + ",".join(kinds).encode()

    def talk(client):
        for kind, data in answer(client.makefile("rb")):
            client.sendall(struct.pack(">HB", 3 + len(data), kind) + data)

    return controller(talk)


@settings(max_examples=10, deadline=None)
@given(st.sets(st.sampled_from(INPUTS)))
def test_inputs_that_another_client_holds_are_named(held):
    """As EtherNet/IP or a second client would; RTDE client #15."""
    found = inputs_in_use(holding(held), 20.0)
    assert found == [name for name in INPUTS if name in held]
    if held:
        with refused("--move", *held):
            require_free_inputs(holding(held), 20.0)


def test_inputs_of_a_controller_that_does_not_answer_are_not_known():
    assert inputs_in_use(answering(("V", b"\0")), 20.0) == []
    assert inputs_in_use("127.0.0.1", 0.2) == []


@pytest.mark.parametrize("asks", [refusal, inputs_in_use])
@pytest.mark.parametrize("size", [3, 60000])
def test_a_controller_that_answers_byte_by_byte_is_left_in_time(asks, size):
    """Each byte comes in time, the answer does not."""

    def talk(client):
        for byte in struct.pack(">HB", size, ord("M")) * 10000:
            client.sendall(bytes([byte]))
            time.sleep(0.05)

    address = controller(talk)
    began = time.monotonic()
    assert not asks(address, 0.3)
    assert time.monotonic() - began < 2


def test_a_state_keeps_its_mode_and_an_old_one_has_none():
    """Records of earlier versions have no mode."""
    for mode in (*RobotMode, 42, None):
        one = state(3, mode=mode)
        data = one.pack()
        assert len(data) == 112 + 4 * (mode is not None)
        assert State.unpack(one.time, data).mode == mode
    with pytest.raises(ValueError, match="114"):
        State.unpack(0.0, bytes(114))


WITHOUT_DASHBOARD = """
from place_rings.rig.simulated import controller
from place_rings.rig.simulated.__main__ import main
controller.DASHBOARD_PORT = 29998  # nothing listens where a dashboard server would
main()
"""


def test_a_robot_without_a_dashboard_server_is_read_and_not_moved():
    """As one with PolyScope X."""
    pytest.importorskip("rtde_control")
    words = (("-c", WITHOUT_DASHBOARD), command(rings=1))
    with SimulatedRig(words) as rig, Link(rig.address, patience=40.0) as link:
        assert np.isfinite(link.wait(60.0).q).all()
        limits = MotionLimits(np.tile([-6.0, 6.0], (6, 1)), 0.5, 1.0)
        with refused("port 29999", "PolyScope X", "--move", error=MoveRefusedError):
            Mover(rig.address, link, limits, patience=40.0)
        assert link.fault is None
