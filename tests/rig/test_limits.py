"""Limits of a check's links: who keeps them, and how far the robot travels within them."""

import io
import math
import signal
import sys
import time
from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.robot import BASE
from place_rings.objectives.link_limits import USUAL_LIMITS, LinkLimits
from place_rings.objectives.motion_limits import Motion
from place_rings.reporting.terminal import Terminal
from place_rings.rig.check.attendant import Attendant
from place_rings.rig.check.stopping import (
    UNDETECTED,
    bounds_of_route,
    lever,
    slow_enough,
    stop_bounds,
    travelled,
)
from place_rings.rig.poses.near_stops import STEP
from place_rings.rig.poses.routes import straight
from place_rings.rig.recording.recording import Recording, RecordingReader
from place_rings.rig.recording.records import Kind, Record
from place_rings.rig.rings.line_monitor import Line, Port
from place_rings.rig.rings.protocol import Frame, encode
from place_rings.rig.robot.link import Link
from place_rings.rig.robot.motion import MotionLimits, Mover, MoveRefusedError
from place_rings.rig.robot.motion_process import MotionProcess
from place_rings.rig.robot.vetting import Ended
from place_rings.rig.sensing.expected import beams_at
from place_rings.rig.session.gathering import replay

from ..support.refusals import refused
from .cell import SCENE, SETUP
from .commands import call
from .tape import about_file

HOME = SCENE.poses[0].q
COUNT = 5
LONG = LinkLimits(200.0, 0.3, 0.6, 0.3, 0.25, 0.15)
TIMES = ("state_stale", "ring_silent", "ring_late", "sign_of_life", "watchdog")
NOTE = """
import sys, time
from place_rings.rig.recording.records import Kind, Record
text = " ".join(sys.argv[1:]).encode()
sys.stdout.buffer.write(Record(Kind.NOTE, 0, time.monotonic(), text).pack())
sys.stdout.buffer.flush()
time.sleep(9)
"""
TELLS_ITS_WORDS = (sys.executable, "-c", NOTE)
times = st.floats(0.05, 0.5)
limits = st.builds(
    lambda late, more, **other: LinkLimits(ring_late=late, ring_silent=late + more, **other),
    late=times,
    more=times,
    state_stale=times,
    sign_of_life=times,
    watchdog=times,
)


@given(
    limits,
    st.lists(
        st.tuples(st.floats(0.02, 0.4), st.floats(0, 0.6) | st.just(0.0)), min_size=1, max_size=60
    ),
)
def test_no_reading_that_counts_as_fresh_is_older_than_the_limits_say(link, frames):
    """Frames are measured at any rate and arrive in order, with any delay."""
    line = Line(0, Port("", COUNT), 0.0, link)
    begin = [(0.05, 0.0)] * 3  # the quickest arrivals are known
    measured = np.cumsum([gap for gap, _ in [*begin, *frames]])
    delay = np.array([late for _, late in [*begin, *frames]])
    arrival, last = np.maximum.accumulate(measured + delay), None
    for i, (m, a) in enumerate(zip(measured, arrival, strict=True)):
        data = encode(i, float(m), np.full(COUNT, 0.5), np.zeros(COUNT, int))
        for each in line.take(data, float(a)):
            if isinstance(each, Frame):
                last = measured[i]
                # fresh for ring_silent from now on, as RingReader.latest has it
                assert a + link.ring_silent - last <= link.oldest_reading + 0.01
    assert last is not None


@given(st.floats(0.01, 1.0), st.floats(0.0, 2.0), st.floats(0.1, 3.0))
def test_the_speed_that_is_slow_enough_is_the_one_that_travels_as_far(speed, seconds, reach):
    far = travelled(speed, seconds, reach)
    assert slow_enough(far, seconds, reach) == pytest.approx(speed, rel=1e-6)
    # a body that moves on, and then loses 2 rad/s each second, step by step
    left, path, step = speed, reach * speed * seconds, 1e-4
    while left > 0:
        path += reach * left * step
        left -= 2.0 * step
    assert far == pytest.approx(path, abs=2 * reach * speed * step)


@given(limits, st.sampled_from(TIMES), st.floats(0.01, 0.4))
def test_a_longer_limit_never_stops_the_robot_sooner(link, name, more):
    most = {"ring_silent": 1.0}.get(name, 0.5)
    value = min(getattr(link, name) + more, most, link.ring_silent if name == "ring_late" else 1.0)
    assume(value > getattr(link, name))
    longer = replace(link, **{name: value})
    assert longer.longer_than(link)
    assert not link.longer_than(longer)
    before, after = (stop_bounds(one, Motion(), 1.0) for one in (link, longer))
    assert any(b.seconds > a.seconds for a, b in zip(before, after, strict=True))
    for a, b in zip(before, after, strict=True):
        assert (a.event, a.seconds <= b.seconds, a.metres <= b.metres) == (b.event, True, True)


def test_the_usual_limits_give_these_times():
    """0.1 + 0.25 s until the reading is seen, then 0.2 and 0.2 s of programs held up, 0.03 s; of a
    frozen ring, six times 0.25 s. A reading may be a cycle older in a ring that fires in slots."""
    seconds = [bound.seconds for bound in stop_bounds(USUAL_LIMITS, Motion(), 1.0)]
    np.testing.assert_allclose(seconds, [0.78, 0.78, 2.03, 0.78, 0.59, 0.43, 0.2])
    slotted = [bound.seconds for bound in stop_bounds(USUAL_LIMITS, Motion(), 1.0, cycle=0.2)]
    np.testing.assert_allclose(np.subtract(slotted, seconds), [0.2] * 3 + [0] * 4, atol=1e-12)
    first = stop_bounds(USUAL_LIMITS, Motion(speed=0.5), 2.0)[0]
    assert first.metres == pytest.approx(2.0 * (0.5 * 0.78 + 0.5**2 / 4))


@given(st.integers(0, 2**32 - 1))
def test_no_point_of_the_robot_moves_farther_than_its_lever(seed):
    """Points on the surfaces of all bodies, and the sensors, between poses of a route."""
    rng = np.random.default_rng(seed)
    joints = straight(HOME, HOME + rng.uniform(-1, 1, 6), STEP)
    most, frames = lever(SCENE, SETUP, joints), np.asarray(forward(SCENE.robot.chain, joints))
    leading = np.abs(np.diff(joints, axis=0)).max(axis=1)
    farthest = 0.0
    for body in SCENE.robot.bodies:
        if body.frame == BASE:
            continue
        start, end = np.asarray(body.capsule.start), np.asarray(body.capsule.end)
        away = rng.normal(size=(200, 3))
        away *= body.capsule.radius / np.linalg.norm(away, axis=1, keepdims=True)
        points = start + rng.random((200, 1)) * (end - start) + away
        T = frames[:, body.frame]
        world = np.einsum("pij,nj->pni", T[:, :3, :3], points) + T[:, None, :3, 3]
        moved = np.linalg.norm(np.diff(world, axis=0), axis=-1).max(axis=1)
        farthest = max(farthest, float((moved / leading).max()))
    apex = np.asarray(beams_at(SCENE, SETUP, joints).apex).reshape(len(joints), -1, 3)
    moved = np.linalg.norm(np.diff(apex, axis=0), axis=-1).max(axis=1)
    farthest = max(farthest, float((moved / leading).max()))
    assert farthest <= most + 1e-9
    assert farthest >= 0.7 * most


@given(st.floats(0.01, 0.07))
def test_a_robot_that_turns_about_its_base_alone_has_its_reach_as_lever(turn):
    joints = np.array([HOME, HOME + turn * np.eye(6)[0]])
    apex = np.asarray(beams_at(SCENE, SETUP, joints[:1]).apex)
    frames = np.asarray(forward(SCENE.robot.chain, joints[0]))
    ends = [np.hypot(*apex[:, :2].T).max()]
    for body in SCENE.robot.bodies:
        T = np.eye(4) if body.frame == BASE else frames[body.frame]
        for point in (body.capsule.start, body.capsule.end):
            x, y, _ = T[:3, :3] @ np.asarray(point) + T[:3, 3]
            ends.append(math.hypot(x, y) + body.capsule.radius)
    assert lever(SCENE, SETUP, joints) == pytest.approx(max(ends), rel=1e-3)


def test_a_robot_that_stands_has_none():
    assert lever(SCENE, SETUP, np.array([HOME, HOME])) == 0.0
    bounds, warning = bounds_of_route(SCENE, SETUP, np.array([HOME]), True)
    assert [bound.metres for bound in bounds] == [0.0] * len(bounds)
    assert warning is None


ROUTE = straight(HOME, HOME + np.radians([60, 20, 0, 0, 0, 0]), STEP)


@pytest.mark.parametrize("name", TIMES[1:])
def test_a_limit_that_does_not_keep_the_near_stop_is_refused_with_one_that_does(name):
    longer = replace(USUAL_LIMITS, **{name: getattr(USUAL_LIMITS, name) + 0.1})
    scene = replace(SCENE, link=longer)
    with refused("--move", "near_m = 0.15") as error:
        bounds_of_route(scene, SETUP, ROUTE, True)
    assert bounds_of_route(scene, SETUP, ROUTE, False)[1] is None  # a simulated robot
    # what the line says keeps the distance does
    words = str(error.value).replace(",", " ").split()
    speed, near = (float(words[words.index(key) + 2]) for key in ("speed_deg_s", "near_m"))
    near = float(words[len(words) - words[::-1].index("near_m") + 1])
    for motion in (Motion(near=near), Motion(speed=math.radians(speed))):
        kept = bounds_of_route(replace(scene, motion=motion), SETUP, ROUTE, True)
        assert kept[1] is None


@given(st.floats(0.0175, 1.0), st.integers(2, 100), st.floats(0.1, 3.0), limits)
def test_a_frozen_ring_stops_it_within_its_bound(speed, frames, reach, link):
    """By the slowest frames that are not silent, at any share of the speed; the programs are held
    up once."""
    bound = stop_bounds(link, Motion(speed=speed, frozen_frames=frames), reach)[2]
    held = link.sign_of_life + link.watchdog + 0.03
    for share in (1.0, 0.3, 0.05):
        seconds = max(frames * link.ring_silent + link.ring_late, np.radians(1) / (share * speed))
        turned = share * speed * (seconds + held) + (share * speed) ** 2 / 4
        assert bound.metres >= reach * turned - 1e-9
    assert bound.seconds == pytest.approx(frames * link.ring_silent + link.ring_late + held)


@pytest.mark.parametrize(
    ("key", "value", "default"), [("frozen_frames", 100, "6"), ("failed_share", 0.4, "0.25")]
)
def test_a_rule_for_rings_laxer_than_its_default_is_refused_where_it_travels_too_far(
    key, value, default
):
    lax = replace(SCENE, motion=replace(SCENE.motion, **{key: value}))
    with refused("--move", f"{key} = {default}"):
        bounds_of_route(lax, SETUP, ROUTE, True)
    assert bounds_of_route(lax, SETUP, ROUTE, False)[1] is None  # a simulated robot
    near = replace(lax, motion=replace(lax.motion, near=4.0, speed=math.radians(1)))
    assert bounds_of_route(near, SETUP, ROUTE, True)[1] is None


def test_the_usual_limits_are_warned_of_and_shown():
    bounds, warning = bounds_of_route(SCENE, SETUP, ROUTE, True)
    console = Terminal(record=True, width=140, file=io.StringIO())
    Attendant(console).show_stopping(bounds, warning)
    text = console.export_text()
    for bound in bounds:
        row = next(line for line in text.splitlines() if bound.event in line)
        assert f"{1000 * bound.seconds:.0f}" in row
        assert f"{1000 * bound.metres:.0f}" in row
    assert warning in text
    assert UNDETECTED in " ".join(text.split())


@pytest.mark.parametrize(
    ("table", "parts"),
    [
        ("ring_silent_s = 5.0", ("link.ring_silent_s", "5.0", "0.1", "1")),
        ("state_stale_s = 0.6", ("link.state_stale_s", "0.6")),
        ("sign_of_life_s = 0.01", ("link.sign_of_life_s", "0.01")),
        ("watchdog_s = nan", ("link.watchdog_s",)),
        ("rate_hz = 20", ("link.rate_hz", "20", "50", "500")),
        ("state_stale_s = 0.02", ("rate_hz = 125", "0.024 s")),
        ("ring_late_s = 0.3", ("link.ring_late_s", "0.3", "ring_silent_s = 0.25")),
        ("stale = 0.1", ("link.stale",)),
    ],
)
def test_limits_that_make_no_sense_are_refused(tmp_path, table, parts):
    (tmp_path / "scene.toml").write_text(f"[link]\n{table}\n")
    with refused("scene.toml", *parts):
        call("check", "n2_16_25", "--rig", "sim", "--scene", tmp_path / "scene.toml")


def test_the_links_process_is_given_the_rate_and_the_link_waits_as_long_as_stated():
    with Link("nowhere", LONG, command=TELLS_ITS_WORDS) as link:
        while link.fault is None:
            time.sleep(0.005)
        assert (link.fault.why, link.fault.detail) == (Ended.REFUSED, "nowhere 200.0 1.0")
        assert link._stale == link._vetting._stale == LONG.state_stale


def test_the_process_that_moves_is_given_its_limits():
    some = MotionLimits(np.radians([[-200.0, 200.0]] * 6))
    with refused("127.0.8.1 1.0 0.25 0.15", error=MoveRefusedError):
        Mover("127.0.8.1", Mock(spec=Link), some, signs=LONG, command=TELLS_ITS_WORDS)


@pytest.mark.parametrize(("patience", "hz"), [(1.0, 1 / 0.15), (2.0, 1 / 0.3)])
def test_the_robots_watchdog_is_set_to_the_limit(monkeypatch, patience, hz):
    monkeypatch.setattr(signal, "setitimer", lambda *_: None)
    rates = []
    client = SimpleNamespace(setWatchdog=lambda rate: rates.append(rate))
    process = MotionProcess(client, 1, patience, LONG.sign_of_life, LONG.watchdog)
    with refused(error=RuntimeError):
        process.serve()
    assert rates == [pytest.approx(hz)]
    assert process._sign == pytest.approx(LONG.sign_of_life * patience)


@pytest.mark.parametrize(("link", "used"), [(USUAL_LIMITS, 19), (LONG, 20)])
def test_a_replay_uses_the_limits_of_the_check(tmp_path, link, used):
    """A frame that is 0.2 s late is used where the scene allows it."""
    checked = about_file("small.toml", replace(SCENE, link=link), SETUP, None, [])
    path = tmp_path / "file"
    with Recording(path, {}) as recording:
        for i in range(20):
            data = encode(i, i / 10, np.full(8, 0.5), np.zeros(8, int))
            recording.put(Record(Kind.BYTES, 0, 100 + i / 10 + 0.2 * (i == 19), data))
    gathered = replay(RecordingReader(path).records(), checked.ports, None, link)
    assert len(gathered.frames) == used
    assert (gathered.late, gathered.patience) == (link.ring_late, 1.0)
