"""The calibration that a controller states: read from its primary interface, used by the check, and
compared with the file that the user gave.
"""

import asyncio
import os
import socket
import struct
import threading
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.robots.built_in import ROBOTS, calibrated_chain, controller_table
from place_rings.coverage.robots.calibration import DhTable, dh_table
from place_rings.coverage.robots.kinematics import forward
from place_rings.objectives.scene import Scene
from place_rings.rig.check import arm_calibration
from place_rings.rig.check.arm_calibration import arm_kinematics
from place_rings.rig.mount.fit import fit_mount
from place_rings.rig.poses.clear import drawn
from place_rings.rig.robot import dashboard as dashboard_server
from place_rings.rig.robot import primary_interface
from place_rings.rig.robot.controller_line import UnreadError
from place_rings.rig.robot.dashboard import read_model
from place_rings.rig.robot.primary_interface import packed, read_kinematics, unpacked
from place_rings.rig.sensing.readings import at_stops
from place_rings.rig.simulated.arm import Arm
from place_rings.rig.simulated.controller import PERIOD, Controller
from place_rings.rig.simulated_cell.world import World
from place_rings.simulation.twin.noise import Noise

from ..support.refusals import refused
from ..support.sockets import serve_once
from .cell import SCENE, SETUP

RNG = np.random.default_rng(4)
DELTAS = DhTable(*1e-3 * RNG.uniform(-1, 1, (4, 6)) * [[1], [2], [2], [1]])


def calibrated(robot, source="calibration.conf"):
    chain = robot.nominal.chain
    return robot.calibrated(calibrated_chain(chain, (dh_table(chain) + DELTAS).origin), source)


OWN = replace(SCENE, robot=calibrated(SCENE.robot))


def served(monkeypatch, data):
    """Let a port that sends ``data`` and closes be the controller's; return its host."""
    port = serve_once(lambda line: line.sendall(data))
    monkeypatch.setattr(primary_interface, "PORT", port)
    return "127.0.0.1"


def framed(kind, data):
    return struct.pack(">iB", 5 + len(data), kind) + data


def test_the_bytes_are_those_of_the_protocol():
    """225 bytes with the header: 6 checksums, 4 times 6 doubles, and the status, big-endian."""
    data = framed(5, packed(DELTAS))
    assert len(data) == 225
    assert struct.unpack_from(">i", data) == (225,)
    for row, values in enumerate((DELTAS.theta, DELTAS.a, DELTAS.d, DELTAS.alpha)):
        assert struct.unpack_from(">6d", data, 29 + 48 * row) == tuple(values)
    assert struct.unpack_from(">I", data, 221) == (2,)


@pytest.mark.parametrize("more", [b"", framed(20, b"text"), framed(16, framed(0, b"\0" * 40))])
def test_kinematics_are_found_among_other_packages(monkeypatch, more):
    host = served(monkeypatch, more + framed(16, framed(3, b"abc") + framed(5, packed(DELTAS))))
    assert np.array_equal(read_kinematics(host, 5.0).d, DELTAS.d)


@pytest.mark.parametrize(
    ("data", "size"),
    [
        (b"", ""),
        (b"\0\0", ""),
        (struct.pack(">iB", 3, 16), "3 bytes"),
        (struct.pack(">iB", -1, 16), "-1 bytes"),
        (struct.pack(">iB", 1 << 30, 16), "1073741824 bytes"),
        (framed(16, struct.pack(">iB", 400, 5)), "400 bytes"),
        (framed(16, struct.pack(">iB", 0, 5)), "0 bytes"),
        (framed(16, framed(5, b"\0" * 40)), "40 bytes"),
        (framed(16, framed(5, b"\xff" * 220)), "finite"),
        (framed(16, framed(5, b"\x7f" * 220)), "finite"),
    ],
)
def test_damaged_packages_are_refused(monkeypatch, data, size):
    host = served(monkeypatch, data)
    with refused(size, error=UnreadError):
        read_kinematics(host, 5.0)


@given(st.binary(min_size=220, max_size=260))
def test_any_bytes_are_finite_kinematics_or_refused(data):
    try:
        table = unpacked(data)
    except UnreadError:
        return
    assert np.isfinite(table.origin).all()
    assert packed(table)[24:216] == data[24:216]


def test_a_port_that_is_closed_or_silent_gives_a_reason(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as server:
        monkeypatch.setattr(primary_interface, "PORT", server.getsockname()[1])
        with refused(primary_interface.PORT, "timed out", error=UnreadError):
            read_kinematics("127.0.0.1", 0.1)
    with refused("refused", error=UnreadError):
        read_kinematics("127.0.0.1", 5.0)


@pytest.mark.parametrize("piece", [b"", bytes(3), bytes(60_000)])
@pytest.mark.parametrize("kind", [16, 20])
def test_a_port_that_never_ends_gives_a_reason_in_time(monkeypatch, kind, piece):
    """However small or large its packages are: bounded in time and in bytes."""
    ended, most, sent = threading.Event(), 50 << 20, []
    package = framed(kind, framed(0, piece) if piece and kind == 16 else piece)

    def talk(line):
        while not ended.is_set() and sum(sent) < most:
            sent.append(line.send(package * max(1, 4096 // len(package))))

    monkeypatch.setattr(primary_interface, "PORT", serve_once(talk))
    with refused(primary_interface.PORT, error=UnreadError):
        read_kinematics("127.0.0.1", 0.3)
    ended.set()
    assert sum(sent) < most


@pytest.fixture
def stated(monkeypatch):
    """What the controller states, in place of one."""
    answers = {"info": None, "model": None}

    def model(host, seconds):
        if answers["model"] is None:
            raise UnreadError("port 29999: timed out")
        return answers["model"]

    monkeypatch.setattr(arm_calibration, "read_model", model)

    def read(host, seconds):
        if answers["info"] is None:
            raise UnreadError("port 30001: timed out")
        return answers["info"]

    monkeypatch.setattr(arm_calibration, "read_kinematics", read)
    return answers


@pytest.mark.parametrize("own", [OWN, SCENE])
def test_the_check_takes_the_controllers_calibration(stated, own):
    """A model without differences has none."""
    stated["info"] = controller_table(own.robot)
    arm = arm_kinematics(SCENE, "192.0.2.7")
    assert arm.warnings == ()
    calibration = arm.scene.robot.calibration
    assert (calibration and calibration.source) == ("controller 192.0.2.7" if own is OWN else None)
    q = np.array([0.3, -1.0, 0.8, 0.2, 1.1, -0.4])
    frames = [forward(s.robot.chain, q) for s in (arm.scene, own)]
    assert np.allclose(*frames, rtol=0, atol=1e-8)


def test_an_unread_calibration_is_a_warning_unless_a_file_is_given(stated):
    arm = arm_kinematics(SCENE, "192.0.2.7")
    (warning,) = arm.warnings
    assert "port 30001: timed out" in warning
    assert "--calibration FILE" in warning
    assert arm.scene is SCENE
    assert arm_kinematics(OWN, "192.0.2.7").warnings == ()


@pytest.mark.parametrize("own", [OWN, SCENE])
def test_an_arm_that_nobody_names_is_not_moved(stated, own):
    """Neither its kinematics nor its model: a file of the user's does not prove whose arm it is."""
    with refused("--move", "192.0.2.7", "30001", "29999", "ur10"):
        arm_kinematics(own, "192.0.2.7", move=True)
    stated["model"] = "ur5e"
    with refused("--move", "192.0.2.7", "ur5e", "ur10"):
        arm_kinematics(own, "192.0.2.7", move=True)
    stated["model"] = "ur10"
    arm = arm_kinematics(own, "192.0.2.7", move=True)
    assert len(arm.warnings) == (own is SCENE)
    stated["info"] = controller_table(own.robot)
    stated["model"] = None
    assert arm_kinematics(own, "192.0.2.7", move=True).warnings == ()


def test_a_robot_that_no_controller_of_universal_robots_has_is_not_moved(stated):
    stated["info"] = controller_table(SCENE.robot)
    panda = Scene(robot="panda")
    with refused("--move", "panda"):
        arm_kinematics(panda, "192.0.2.7", move=True)


def dashboard(monkeypatch, answers):
    """Let a server with these answers be the controller's dashboard; return its host."""

    def talk(line):
        line.sendall(b"Connected: Universal Robots Dashboard Server\n")
        for asked in line.makefile("rb"):
            line.sendall(answers.get(asked.decode().strip().lower(), b"could not\n"))

    monkeypatch.setattr(dashboard_server, "PORT", serve_once(talk))
    return "127.0.0.1"


@pytest.mark.parametrize(
    ("model", "version", "name"),
    [
        (b"UR10\n", b"URSoftware 5.11.0.108249 (Jan 01 2021)\n", "ur10e"),
        (b"UR10\n", b"3.15.8.106339 (May 04 2022)\n", "ur10"),
        (b"UR5e\r\n", b"URSoftware 5.4.3.530 (Jan 01 2020)\r\n", "ur5e"),
        (b"UR20\n", b"URSoftware 5.14.0.1 (Jan 01 2023)\n", "ur20"),
        (b"could not understand\n", b"3.15\n", None),
        (b"UR10\n", b"?\n", None),
        (b"x" * 9000, b"3.15\n", None),
        (b"UR10", b"", None),
    ],
)
def test_the_dashboard_names_the_model(monkeypatch, model, version, name):
    answers = {"get robot model": model, "polyscopeversion": version}
    host = dashboard(monkeypatch, answers)
    if name:
        assert read_model(host, 5.0) == name
    else:
        with refused(dashboard_server.PORT, error=UnreadError):
            read_model(host, 0.3)


def test_a_file_that_differs_from_the_controller_is_a_warning(stated):
    stated["info"] = controller_table(OWN.robot)
    assert arm_kinematics(OWN, "192.0.2.7").warnings == ()
    stated["info"] = controller_table(SCENE.robot)
    (warning,) = arm_kinematics(OWN, "192.0.2.7").warnings
    assert "calibration.conf" in warning


def test_a_controller_of_another_robot_is_refused(stated):
    stated["info"] = controller_table(ROBOTS["ur5e"])
    with refused("192.0.2.7", "ur10"):
        arm_kinematics(SCENE, "192.0.2.7")


def test_the_mount_check_sees_the_calibration_of_the_arm():
    """Rings as proposed on a calibrated arm: exact with its kinematics, off with the model's."""
    joints = drawn(SCENE, 12, 0)
    world = World(OWN, SETUP, noise=Noise(0.0, 0.0, 0.0, 0.0))
    readings = world.readings(np.random.default_rng(0), joints, 1)
    stops = at_stops(readings, SETUP, joints)
    own, model = (fit_mount(scene, SETUP, stops) for scene in (OWN, SCENE))
    for fit in own:
        assert np.abs(fit.values).max() < 1e-6
    assert max(np.abs(fit.values).max() for fit in model) > 1e-3


def test_the_simulated_controller_states_the_robot_of_its_world():
    address = f"127.{os.getpid() % 250 + 1}.8.1"

    async def read():
        arm, own = Arm(SCENE.poses[0].q, PERIOD), controller_table(OWN.robot)
        controller = Controller(arm, address, kinematics=own)
        await controller.open()
        try:
            return await asyncio.to_thread(arm_kinematics, SCENE, address)
        finally:
            controller.close()

    arm = asyncio.run(read())
    assert arm.warnings == ()
    q = np.array([pose.q for pose in SCENE.poses])
    frames = [forward(s.robot.chain, q) for s in (arm.scene, OWN)]
    assert np.allclose(*frames, rtol=0, atol=1e-8)
