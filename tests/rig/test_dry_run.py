"""Dry run of a check: the motion is that of the check, its page plays it, and what to set on the
controller is stated.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.cli.commands.check import check
from place_rings.cli.runs import dry_run as dry_run_page
from place_rings.cli.runs.dry_run import described, planned_dry_run
from place_rings.coverage.rings.ring_kinematics import sensor_axes
from place_rings.coverage.robots.kinematics import forward
from place_rings.objectives.motion_limits import Motion
from place_rings.rig.check.dry_run import DryRun, Stop, dry_run, fastest
from place_rings.rig.check.options import CheckOptions, RigOptions
from place_rings.rig.poses.routes import STEP, Clearance
from place_rings.viewer.motion_page import Clock, MotionSession, PlannedMotion
from place_rings.viewer.server import Server

from ..support.refusals import refused
from ..support.viser_client import Client
from .cell import SCENE, SETUP

OPTIONS = CheckOptions(part=("mount",), stops=8, trials=4, voxel=0.1)


@pytest.fixture(scope="module")
def run(plans):
    return dry_run(SCENE, SETUP, replace(plans, rods=()), 0)


def test_it_drives_every_reachable_pose_on_clear_ways_at_the_scenes_speed(plans, run):
    assert np.array_equal(run.joints[0], SCENE.poses[0].q)
    names = [stop.name for stop in run.stops]
    assert names[0] == "start"
    assert sorted(names[1:]) == [f"mount {i}" for i in range(10)]
    assert run.unreachable == ()  # before, of eight stops two to four had no clear way
    assert Clearance(SCENE, SETUP).of(plans.mount.joints).all()
    for stop in run.stops[1:]:
        (row,) = np.flatnonzero(np.isclose(run.time, stop.time))[:1]
        wanted = plans.mount.joints[int(stop.name.split()[1])]
        np.testing.assert_allclose(run.joints[row], wanted, atol=1e-12)
    steps = np.abs(np.diff(run.joints, axis=0)).max(axis=1)
    assert steps.max() <= STEP + 1e-9
    np.testing.assert_allclose(steps, np.diff(run.time) * SCENE.motion.speed, atol=1e-12)
    assert Clearance(SCENE, SETUP).of(run.joints[1:]).all()


def test_the_fastest_point_is_that_of_a_dense_motion(run):
    rows = np.linspace(0, run.time[-1], 4000)
    q = np.stack([np.interp(rows, run.time, joint) for joint in run.joints.T], axis=1)
    frames = forward(SCENE.robot.chain, q)
    points = np.concatenate([frames[..., :3, 3], sensor_axes(SCENE.robot, SETUP, frames)[0]], 1)
    dense = np.linalg.norm(np.diff(points, axis=0), axis=-1).max() / np.diff(rows)[0]
    assert fastest(SCENE, SETUP, run) == pytest.approx(dense, rel=0.02)
    still = DryRun(np.zeros(1), run.joints[:1], (Stop("start", 0.0),), ())
    assert fastest(SCENE, SETUP, still) == 0.0


def test_what_to_set_before_a_first_move_is_stated(run):
    text = "\n".join(described(SCENE, SETUP, run, True))
    low, high = np.degrees(run.ranges[0])
    for part in (
        "forearm, tool",
        "15°/s",
        f"{fastest(SCENE, SETUP, run):.2f} m/s",
        f"shoulder_pan {low:.0f} to {high:.0f}",
        "-0.75 m",
        "table, box",
    ):
        assert part in text
    assert "\n".join(described(SCENE, SETUP, run, False)) != text
    still = DryRun(np.zeros(1), run.joints[:1], (Stop("start", 0.0),), ("mount 0",))
    text = "\n".join(described(SCENE, SETUP, still, True))
    assert "mount 0" in text
    assert not any(part in text for part in ("°/s", "m/s", "shoulder_pan"))  # no limits


@given(st.floats(0, 1))
def test_the_pose_at_a_time_is_interpolated(share):
    ends = np.array([[0.0, 1.0], [1.0, -1.0]])
    motion = PlannedMotion(np.array([0.0, 2.0]), ends, (("start", 0.0), ("mount 0", 2.0)))
    np.testing.assert_allclose(motion.pose(2 * share), ends[0] + share * (ends[1] - ends[0]))
    assert motion.stop(2 * share) == (share > 1e-9)


def test_the_clock_plays_at_its_rate_and_stops_at_the_end():
    clock = Clock(10.0)
    assert not clock.advance(1.0)
    clock.play()
    assert clock.advance(1.0)
    clock.rate = 0.1
    clock.advance(1.0)
    assert clock.at == pytest.approx(1.1)
    clock.jump(99.0)
    assert clock.at == 10.0
    clock.advance(1.0)
    assert not clock.playing
    clock.play()
    assert clock.at == 0.0


def above(eye, look_at) -> bool:
    x, y, z = np.subtract(eye, look_at)
    return z > 100 * np.hypot(x, y)


def test_the_page_plays_the_motion_and_goes_to_a_pose(run):
    stops = tuple((stop.name, stop.time) for stop in run.stops)
    motion = PlannedMotion(run.time, run.joints, stops)
    room = MotionSession(SCENE, SETUP, motion, ("Set the <payload>.",), "Dry run")
    with Server(room) as server:
        assert server.url.startswith("http://127.0.0.1:")
        page = Client(server.url)
        page.until(lambda: "at pose 0: start" in page.words, "the page does not come")
        assert "Set the <payload>." in page.words
        assert any("Dry run" in script for script in page.scripts)
        assert {"/cell/obstacle1", "/link5/body", "/link6/ring1"} <= page.drawn
        page.set("Pose", f"1: {stops[1][0]}")
        page.until(lambda: f"at pose 1: {stops[1][0]}" in page.words, "the pose is not shown")
        assert page.value("Time, s") == pytest.approx(stops[1][1], abs=0.01)
        page.set("A tenth of the speed", True)
        page.set("Time, s", 0.0)
        page.set("Play", True)
        page.until(lambda: 0 < page.value("Time, s") < stops[1][1], "it does not play")
        page.set("Pose", "no such pose")
        page.set("Time, s", float("nan"))
        page.until(lambda: "on the way to" in page.words, "it has stopped")
        page.set("View from", "Top")
        page.until(lambda: above(page.eye, page.look_at), "the view is not from above")
        page.close()


def test_links_are_drawn_where_forward_puts_them(run):
    """The vertices of each link, moved by its frame, are those of the robot drawn as a whole."""
    from place_rings.viewer.triangle_meshes import bodies

    motion = PlannedMotion(run.time, run.joints, (("start", 0.0),))
    room, at = MotionSession(SCENE, SETUP, motion), float(run.time[-1]) / 3
    frames = room.frames(at)
    whole = bodies(SCENE.robot, forward(SCENE.robot.chain, motion.pose(at)))[0]
    parts = []
    for frame, items in room.links.items():
        if "body" in items:
            T = np.eye(4) if frame < 0 else frames[frame]
            parts.append(items["body"].vertices @ T[:3, :3].T + T[:3, 3])
    drawn_ = np.concatenate(parts)
    assert len(drawn_) == len(whole)
    for extreme in (np.min, np.max):
        np.testing.assert_allclose(extreme(drawn_, 0), extreme(whole, 0), atol=2e-3)


def test_a_dry_run_needs_a_part_with_poses_and_a_clear_start():
    """Otherwise no way leads anywhere, and the limits to set are those of a robot at rest."""
    with refused("--dry-run", "--part self"):
        planned_dry_run(SETUP, SCENE, replace(OPTIONS, part=("self",)))
    near = replace(SCENE, motion=Motion(near=1.0))
    with refused("1060 mm"):
        planned_dry_run(SETUP, near, OPTIONS)


def test_the_command_shows_the_dry_run_of_a_part(monkeypatch):
    shown = []
    monkeypatch.setattr(dry_run_page, "show_dry_run", lambda *given: shown.append(given))
    rig, asked = RigOptions(dry_run=True, browser=False), CheckOptions(part=("mount",))
    with pytest.raises(SystemExit):
        check("n1_8_0", rig=rig, options=asked)
    ((_, _, options, browser),) = shown
    assert options.parts == ("mount",)
    assert browser is False
