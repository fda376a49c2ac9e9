"""Joints that turn without end (UniversalRobots/Universal_Robots_ROS2_Description, issue 174): any
number of full turns is the same pose, in files, live, in plans and on routes; other joints keep
their limits.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.joint_values import angles_apart
from place_rings.coverage.robots.kinematics import Mimic
from place_rings.coverage.robots.robot import Robot
from place_rings.formats.recorded_motion import read_record, with_record
from place_rings.formats.robots.urdf import read_urdf
from place_rings.formats.robots.urdf_chain import pick_chain
from place_rings.formats.writing import to_toml
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.trajectory import Thinning
from place_rings.rig.check.offline import file_check
from place_rings.rig.check.options import CheckOptions, FileOptions
from place_rings.rig.check.procedure import skipped
from place_rings.rig.mount.stop_plan import MountPlanFile
from place_rings.rig.poses.itinerary import Itinerary
from place_rings.rig.recording.records import Kind, Record
from place_rings.rig.robot.state import State
from place_rings.rig.robot.vetting import Ended, LinkFaultError, Vetting
from place_rings.rig.sensing.readings import Readings, at_stops
from place_rings.rig.sources.joint_track import JointTrack
from place_rings.rig.sources.messages import JointMessage

from ..support.refusals import refused
from .cell import SCENE, SETUP, SHELLS

ENDLESS = ("ur3", "ur3e")
LIMITED = [
    (name, joint)
    for name in ("ur3", "ur3e", "ur5", "ur5e", "ur10", "ur10e", "ur16e")
    for joint in range(6)
    if not (name in ENDLESS and joint == 5)
]
turns = st.integers(-300, 300)


def tracked(robot, time, q):
    """The track of a file's states."""
    track = JointTrack(robot, {name: i for i, name in enumerate(robot.chain.joints)})
    for t, row in zip(time, q, strict=True):
        track.take("f.csv", JointMessage("f.csv", float(t), math.nan, robot.chain.joints, row))
    track.close("f.csv")
    return track


@given(st.sampled_from(ENDLESS), turns, st.floats(-800, 800), st.booleans())
def test_a_joint_without_end_may_turn_any_number_of_times(name, whole, by, wrapped):
    robot, time = ROBOTS[name], np.arange(200) / 50
    q = np.tile(robot.rest, (200, 1))
    q[:, 5] = np.radians(np.linspace(0, by, 200)) + math.tau * whole
    stated = q.copy()
    if wrapped:  # as some drivers state it
        stated[:, 5] = np.remainder(q[:, 5] + math.pi, math.tau) - math.pi
    track = tracked(robot, time, stated)
    assert track.left_out == []
    assert angles_apart(track.q, q).max() < 1e-6
    assert np.abs(np.diff(track.q, axis=0)).max() <= np.radians(800) / 199 + 1e-6


@given(st.sampled_from(LIMITED), st.sampled_from([-1, 1]), st.floats(366, 1e5))
def test_every_other_joint_beyond_a_turn_is_named(case, sign, degrees):
    robot, joint = ROBOTS[case[0]], case[1]
    q = np.tile(robot.rest, (60, 1))
    q[:, joint] = sign * math.radians(degrees)
    found = f"{robot.chain.joints[joint]} at {q[0, joint]:g} rad"
    with refused("f.csv", found):
        tracked(robot, np.arange(60) / 50, q)


def vetted(robot, q):
    """The last state of a robot that stands there."""
    vetting = Vetting(robot=robot)
    for n in range(3):
        state = State(100 + n / 125, 7 + n / 125, q, np.zeros(6))
        seen = vetting.take(Record(Kind.STATE, 0, state.time, state.pack()))
    return seen


@given(st.sampled_from(ENDLESS), turns)
def test_a_live_robot_may_stand_after_any_number_of_turns(name, whole):
    q = ROBOTS[name].rest + math.tau * whole * np.eye(6)[5]
    np.testing.assert_array_equal(vetted(ROBOTS[name], q).q, q)


@given(st.sampled_from(LIMITED), st.sampled_from([-1, 1]), st.floats(366, 1e5))
def test_every_other_joint_of_a_live_robot_beyond_a_turn_is_named(case, sign, degrees):
    robot, joint = ROBOTS[case[0]], case[1]
    q = robot.rest.copy()
    q[joint] = sign * math.radians(degrees)
    with pytest.raises(LinkFaultError) as fault:
        vetted(robot, q)
    assert fault.value.why == Ended.GARBLED
    assert fault.value.detail.startswith(f"{robot.chain.joints[joint]} at {sign * degrees:.4g}°")


@given(st.integers(0, 2**32 - 1))
def test_readings_belong_to_a_stop_after_any_number_of_turns(seed):
    rng = np.random.default_rng(seed)
    stops, n = rng.uniform(-3, 3, (3, 6)), 60
    stop = rng.integers(0, 3, n)
    some = Readings(
        np.arange(n) / 10,
        stops[stop] + rng.normal(0, 1e-3, (n, 6)),
        np.zeros(n, int),
        rng.integers(0, 8, n),
        rng.uniform(0.1, 1, n),
        np.zeros(n, int),
    )
    turned = replace(some, joints=some.joints + math.tau * rng.integers(-3, 4, (n, 6)))
    plain, found = (at_stops(each, SETUP, stops) for each in (some, turned))
    for key in vars(plain):
        np.testing.assert_allclose(getattr(found, key), getattr(plain, key), atol=1e-9)


def test_stops_of_a_plan_are_found_a_turn_away(stops, tmp_path):
    """Each joint of a UR10 but the elbow is a full turn farther, where its limits allow."""
    (tmp_path / "stops.toml").write_text(to_toml(stops, file=MountPlanFile))
    there = stops.joints - math.tau * np.sign(stops.joints) * np.array([1, 1, 0, 1, 1, 1])
    time = np.concatenate([3 * k + np.arange(100) / 50 for k in range(len(there))])
    written(tmp_path / "joints.csv", SCENE.robot, np.repeat(there, 100, axis=0), time)
    rows = [f"{t},tof_{ring}_{k},1" for t in time[::10] for ring, k in SETUP.labels]
    (tmp_path / "readings.csv").write_text("\n".join(["time,sensor,range_m", *rows]))
    files = FileOptions(tmp_path / "joints.csv", tmp_path / "readings.csv", plan=tmp_path)
    options = CheckOptions(part=("mount",), voxel=0.1)
    done = file_check("small", SETUP, SHELLS, files, options)
    assert skipped(done.gathered.said, "mount") == {}
    notes = [note for _, note in done.gathered.said if note["what"] == "step"]
    assert {note["number"] for note in notes} == set(range(len(there)))


@pytest.mark.parametrize("degrees", [-900, 170])
def test_a_route_starts_at_the_turn_where_the_robot_stands(degrees):
    """No path turns a joint back by full turns, and none turns another joint farther."""
    robot = ROBOTS["ur3e"]
    scene = Scene.paper(robot=robot, poses=(Pose(robot.rest),))
    goals = robot.rest + np.radians([[20, 0, 0, 0, 0, 150], [0, -20, 0, 0, 0, -150]])
    start = robot.rest + np.radians([0, 0, 0, 0, 0, degrees])
    route = Itinerary(scene, SETUP, start, [goals], 0)
    for q in goals:
        there = route.map.nodes[route.node(q)]
        assert angles_apart(there, q).max() < 1e-9
        np.testing.assert_allclose(there[:5], q[:5], atol=1e-12)
    assert np.abs(route.map.nodes[:, 5] - start[5]).max() <= math.pi + 1e-9


def written(path, robot, q, time=None):
    """A CSV file of states, by default 50 a second."""
    time = np.arange(len(q)) / 50 if time is None else time
    rows = [",".join(["time", *robot.chain.joints])]
    rows += [",".join(map(repr, map(float, [t, *row]))) for t, row in zip(time, q, strict=True)]
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("degrees", [540, 800, -10_000])
def test_poses_of_a_motion_are_those_within_half_a_turn(tmp_path, degrees):
    robot = ROBOTS["ur3e"]
    q = np.tile(robot.rest, (1000, 1))
    q[:, 5] += np.radians(degrees) * np.linspace(0, 1, 1000)
    path = written(tmp_path / "m.csv", robot, q)
    assert np.abs(read_record(path, robot).q - q).max() < 1e-9
    scene = with_record(Scene.paper(robot=robot), path, Thinning(poses=30))
    for pose in scene.poses:
        assert abs(pose.q[5]) <= math.pi + 1e-9
        assert angles_apart(q, pose.q).max(axis=1).min() < 0.6
    with refused("m.csv", "wrist_3"):
        with_record(Scene.paper(robot=ROBOTS["ur5e"]), written(path, robot, q))


ARM = """<robot name="two">
<link name="base"/><link name="a"/><link name="b"/>
<joint name="pan" type="{kind}"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
  <origin xyz="0 0 0.2"/>{limit}</joint>
<joint name="tilt" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
  <origin xyz="0 0 0.3"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
</robot>"""


@pytest.mark.parametrize(("kind", "endless"), [("continuous", True), ("revolute", False)])
def test_a_continuous_joint_of_a_urdf_turns_without_end(tmp_path, kind, endless):
    limit = '<limit lower="-3" upper="3" effort="1" velocity="1"/>' * (not endless)
    (tmp_path / "two.urdf").write_text(ARM.format(kind=kind, limit=limit))
    picked = pick_chain(read_urdf(tmp_path / "two.urdf"), "base", "b")
    robot = Robot("two", picked.chain, (), 0.5, limits=picked.limits)
    assert robot.continuous.tolist() == [endless, False]
    q = np.tile([math.radians(900), 0.1], (60, 1))
    if endless:
        assert len(tracked(robot, np.arange(60) / 50, q)) == 60
    else:
        with refused("pan", "15.708"):
            tracked(robot, np.arange(60) / 50, q)


def test_a_joint_that_another_follows_does_not_turn_without_end():
    """A full turn of a leader is half a turn of a joint that follows it by half."""
    chain = replace(ROBOTS["ur3e"].chain, mimics=(Mimic(4, 5, 0.5),))
    free = np.tile([-np.inf, np.inf], (6, 1))
    robot = replace(ROBOTS["ur3e"], chain=chain, limits=free)
    assert robot.continuous.tolist() == [True] * 4 + [False] * 2
    assert not replace(robot, limits=None).continuous.any()
