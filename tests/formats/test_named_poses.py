"""Poses that name joints and their units: in scenes, robot files, recorded motions, Python, and
what is printed; in one line what does not fit.
"""

import json
import math

import numpy as np
import place_rings as pr
import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.cli.runs.robot import scene_text
from place_rings.coverage.definitions.definition import adapter, json_of
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.robots.built_in import ROBOTS, UR10
from place_rings.coverage.robots.kinematics import forward
from place_rings.formats.export.placed import PlacedSetup
from place_rings.formats.export.urdf import urdf
from place_rings.formats.loader import read_robot, read_scene
from place_rings.formats.recorded_motion import read_record, with_record
from place_rings.formats.robots.urdf import read_urdf
from place_rings.formats.robots.urdf_chain import pick_chain
from place_rings.formats.schema.versions import RobotFile
from place_rings.formats.sensors.sensor_poses import poses_file, setup_of_poses
from place_rings.formats.writing import to_toml
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.objectives.trajectory import MotionRecord, Thinning, thin
from place_rings.objectives.verify import Verifier
from place_rings.reporting.lines.occlusion import record_line
from place_rings.reporting.lines.results import worst_line
from place_rings.rig.check.preconditions import require_revolute

from ..support.rails import RAIL, carried, rail_ur10
from ..support.refusals import refused
from ..support.scene_tables import scene_of_table, scene_table

ON_RAIL = rail_ur10()
JOINTS = ON_RAIL.chain.joints
POSE = {"rail_m": 0.3, **{f"{name}_deg": 5.0 * j for j, name in enumerate(JOINTS[1:])}}
FREE = Rules(mount="free")


@pytest.fixture
def folder(tmp_path):
    """A folder with the robot on a rail as ``robot.toml``."""
    (tmp_path / "robot.toml").write_text(to_toml(ON_RAIL, file=RobotFile))
    return tmp_path


def scene_of(folder, poses, *more):
    path = folder / "scene.toml"
    path.write_text("\n".join(['robot = "robot.toml"', *more, poses]))
    return read_scene(path)


def table(values):
    return "{ " + ", ".join(f"{key} = {value}" for key, value in values.items()) + " }"


def test_a_robot_with_a_rail_comes_back_from_its_file(folder):
    robot = read_robot(folder / "robot.toml")
    assert robot.chain.prismatic == (0,)
    for key in ("origin", "axis"):
        found, wanted = (getattr(r.chain, key) for r in (robot, ON_RAIL))
        np.testing.assert_allclose(found, wanted, atol=1e-9)
    np.testing.assert_allclose(robot.limits[0], RAIL, atol=1e-9)
    np.testing.assert_allclose(robot.home, ON_RAIL.home, atol=1e-9)


def test_a_scene_names_joints_in_degrees_and_metres(folder):
    scene = scene_of(
        folder,
        f"[[poses]]\nq = {table(POSE)}\n[[poses]]\nweight = 2\n[poses.q]\n"
        + "\n".join(f"{key} = {value / 2}" for key, value in POSE.items()),
    )
    q = np.append(0.3, np.radians(5.0 * np.arange(6)))
    np.testing.assert_allclose([p.q for p in scene.poses], [q, q / 2], atol=1e-12)
    back = scene_table(scene)
    assert back["poses"][0]["q_deg"] is None
    assert back["poses"][0]["q"] == pytest.approx(POSE)
    again = scene_of_table(back)
    np.testing.assert_array_equal(again.poses[1].q, scene.poses[1].q)


def test_an_arm_without_a_rail_may_name_its_joints_and_keeps_its_list(tmp_path):
    path = tmp_path / "scene.toml"
    angles = dict(zip((f"{name}_deg" for name in UR10.chain.joints), range(6), strict=True))
    path.write_text(f"[[poses]]\nq = {table(angles)}")
    scene = read_scene(path)
    np.testing.assert_allclose(scene.poses[0].q, np.radians(np.arange(6)))
    assert scene_table(scene)["poses"][0]["q_deg"] == pytest.approx(list(range(6)))


def test_rates_are_named_likewise(folder):
    rates = {f"{key}_s": value for key, value in POSE.items()}
    scene = scene_of(folder, f"[[poses]]\nq = {table(POSE)}\nrate = {table(rates)}")
    np.testing.assert_allclose(scene.poses[0].rate, scene.poses[0].q)
    assert scene_table(scene)["poses"][0]["rate"] == pytest.approx(rates)


def without(key):
    return {k: v for k, v in POSE.items() if k != key}


REFUSED = {
    "q_deg = [0, 0, 0, 0, 0, 0, 0]": "q_deg 7 rail_m",
    "weight = 1.0": "q_deg nothing",
    f"q = {table(without('rail_m'))}": "q.rail_m nothing rail_m",
    f"q = {table({**without('rail_m'), 'rail_deg': 1})}": "q.rail_deg 1.0",
    f"q = {table({**POSE, 'lift_m': 1})}": "q.lift_m 1.0",
    f"q = {table({**POSE, 'rail_m': 9})}": "q.rail_m 9.0 -1.5 2",
    f"q = {table(POSE)}\nq_deg = [0]": "q q_deg",
    f"q = {table({**POSE, 'rail_m': 'nan'})}": "q.rail_m nan",
    f"q = {table(POSE)}\nrate_deg_s = [0, 0, 0, 0, 0, 0, 0]": "rate_deg_s rail_m_s",
    f"q = {table(POSE)}\nrate = {table({'rail_m': 1})}": "rate.rail_m 1.0",
}


@pytest.mark.parametrize(("keys", "parts"), REFUSED.items())
def test_a_pose_that_does_not_fit_is_one_line(folder, keys, parts):
    with refused(f"scene.toml poses[0].{parts}"):
        scene_of(folder, f"[[poses]]\n{keys}")


@pytest.mark.parametrize(
    ("key", "value"), [("type", "screw"), ("limits_deg", [-1.0, 1.0]), ("limits_m", [1.0, -1.0])]
)
def test_a_bad_prismatic_joint_is_one_line(folder, key, value):
    keys = adapter(RobotFile).dump_python(ON_RAIL, mode="json", exclude_none=True)
    keys["joints"][0][key] = value
    (folder / "robot.toml").write_text(tomli_w.dumps(keys))
    with refused(f"robot.toml joints[0].{key}"):
        read_robot(folder / "robot.toml")


def test_a_default_pose_names_joints_as_well(folder):
    text = (folder / "robot.toml").read_text()
    (folder / "robot.toml").write_text(text.replace("rail_m = 0.0", "rail_m = 5.0"))
    with refused("robot.toml home.rail_m 5.0 -1.5 2"):
        read_robot(folder / "robot.toml")
    (folder / "robot.toml").write_text("home_deg = [0, 0, 0, 0, 0, 0, 0]\n" + text)
    with refused("robot.toml home"):
        read_robot(folder / "robot.toml")


def test_the_scene_that_robot_writes_names_joints(folder):
    (folder / "scene.toml").write_text(scene_text(ON_RAIL, "robot.toml"))
    scene = read_scene(folder / "scene.toml")
    np.testing.assert_allclose(scene.poses[0].q, ON_RAIL.rest, atol=1e-4)


def record_text(names, rows):
    lines = [",".join(["time_s", *names])]
    return "\n".join(lines + [",".join(f"{v:.12g}" for v in row) for row in rows])


def a_motion():
    time = np.linspace(0, 4, 41)
    q = np.tile(ON_RAIL.rest, (41, 1))
    q[:, 0], q[:, 1] = np.linspace(-1, 1, 41), np.linspace(0, 0.5, 41)
    return np.column_stack([time, q])


@pytest.mark.parametrize("unit", ["", "deg", "rad"])
def test_a_recorded_motion_names_joints(tmp_path, unit):
    """Under plain names angles are in the unit of the option; a rail is always in metres."""
    rows, path = a_motion(), tmp_path / "motion.csv"
    names = list(JOINTS)
    if unit:
        names = ["RAIL_m", *(f"{name}_{unit}" for name in JOINTS[1:])]
    turned = rows.copy()
    if unit == "deg":
        turned[:, 2:] = np.degrees(turned[:, 2:])
    path.write_text(record_text(names, turned))
    record = read_record(path, ON_RAIL, degrees=False)
    np.testing.assert_allclose(record.q, rows[:, 1:], atol=1e-9)
    if not unit:
        turned[:, 2:] = np.degrees(turned[:, 2:])
        path.write_text(record_text(names, turned))
        record = read_record(path, ON_RAIL, degrees=True)
        np.testing.assert_allclose(record.q, rows[:, 1:], atol=1e-9)


def test_a_motion_of_a_rail_without_names_is_refused(tmp_path):
    path = tmp_path / "motion.csv"
    path.write_text(record_text([f"q{j}" for j in range(7)], a_motion()))
    with refused("motion.csv rail"):
        read_record(path, ON_RAIL)
    rows = a_motion()
    rows[20, 1] = 1000.0
    path.write_text(record_text(JOINTS, rows))
    with refused("motion.csv column rail 1000.0 -100 100 m"):
        read_record(path, ON_RAIL)
    rows[20, 1] = 50.0
    path.write_text(record_text(JOINTS, rows))
    scene = Scene(ON_RAIL, poses=(Pose(ON_RAIL.rest),), rules=FREE, occlusion="ignore")
    with refused("motion.csv rail 2 s 50.05 m 0.1 s"):
        with_record(scene, path)
    rows[:, 1] = np.linspace(-1, 3, 41)
    path.write_text(record_text(JOINTS, rows))
    with refused("motion.csv rail m -1.5 2"):
        with_record(scene, path)


@settings(max_examples=10)
@given(st.integers(1, 60), st.integers(1, 400))
def test_every_sample_is_as_near_to_its_pose_as_reported(poses, within_mm):
    """In each joint: metres of the rail by the arm's length, as the report says."""
    rows = a_motion()
    record = MotionRecord(rows[:, 0], rows[:, 1:])
    length = np.linalg.norm(UR10.chain.origin[1:, :3, 3], axis=1).sum()
    thinned = thin(record, ON_RAIL, Thinning(poses=poses, within=within_mm / 1000 / length))
    weigh = np.append(1 / length, np.ones(6))
    off = np.abs(rows[:, None, 1:] - np.array([p.q for p in thinned.poses])) * weigh
    assert off.max(axis=2).min(axis=1).max() == pytest.approx(thinned.within, abs=1e-12)
    if len(thinned.poses) < poses:
        assert thinned.within <= within_mm / 1000 / length + 1e-3


def test_what_is_printed_names_joints(tmp_path):
    path = tmp_path / "motion.csv"
    path.write_text(record_text(JOINTS, a_motion()))
    scene = Scene(ON_RAIL, poses=(Pose(ON_RAIL.rest),), rules=FREE, occlusion="ignore")
    scene = with_record(scene, path, Thinning(poses=3))
    assert "prismatic" in record_line(scene)
    setup = Setup.named("n1_3_0")
    verified = Verifier(scene, 0.1).verify(setup, scene.targets[0].target)
    result = verified.in_scene("n1_3_0", scene)
    assert result.worst.q_deg is None
    assert set(result.worst.q) == set(POSE)
    assert "rail_m = " in worst_line(result)


def test_sensor_poses_name_joints(folder):
    scene = Scene(ON_RAIL, poses=(Pose(np.append(0.7, UR10.rest)),), rules=FREE, occlusion="ignore")
    setup = Setup.named("n1_3_0")
    text = json_of(poses_file(scene, setup, 0))
    assert json.loads(text)["q"]["rail_m"] == pytest.approx(0.7)
    back = setup_of_poses("sensors.json", text, scene)
    assert [r.count for r in back.rings] == [r.count for r in setup.rings]
    for change, line in (
        ({"q": None, "q_deg": [0.0] * 7}, "q_deg 7 rail_m"),
        ({"q": {**json.loads(text)["q"], "other_m": 1.0}}, "q.other_m 1.0"),
    ):
        with refused(f"sensors.json {line}"):
            setup_of_poses("sensors.json", json.dumps(json.loads(text) | change), scene)


def test_python_names_joints():
    pose = pr.Pose.of(ON_RAIL, POSE, weight=2.0)
    scene = pr.Scene(ON_RAIL, poses=[POSE, pose], occlusion="ignore", rules=FREE)
    np.testing.assert_array_equal(scene.poses[0].q, scene.poses[1].q)
    assert scene.poses[0].q[0] == 0.3
    assert scene.poses[1].weight == 2.0
    assert math.degrees(scene.poses[0].q[2]) == pytest.approx(5)
    for poses, key in (
        ({**POSE, "lift_m": 1.0}, "lift_m"),
        (without("rail_m"), "rail_m"),
        ({**POSE, "rail_m": "far"}, "rail_m"),
    ):
        with refused(key, error=pr.InputError):
            pr.Scene(ON_RAIL, poses=poses, rules=FREE, occlusion="ignore")


@pytest.mark.parametrize("name", ["ur5e", "panda"])
def test_a_urdf_export_has_the_rail_as_a_prismatic_joint(tmp_path, name):
    robot = carried(ROBOTS[name].with_links(True), (0.0, 1.0, 1.0))
    scene = Scene(robot, poses=(Pose(robot.rest),), rules=FREE, occlusion="ignore")
    path = tmp_path / "robot.urdf"
    path.write_bytes(urdf(PlacedSetup(scene, Setup.named("n1_3_0"), 0, tmp_path))["robot.urdf"])
    picked = pick_chain(read_urdf(path), None, "tcp")
    assert picked.chain.prismatic == (0,)
    np.testing.assert_allclose(picked.limits, robot.limits, atol=1e-9)
    q = robot.rest + 0.1
    np.testing.assert_allclose(forward(picked.chain, q), forward(robot.chain, q), atol=1e-9)


def test_a_rig_refuses_a_rail():
    with refused("rail ur10_on_a_rail"):
        require_revolute(ON_RAIL)
    require_revolute(UR10)


def test_a_robot_whose_rail_carries_nothing_is_refused():
    keys = adapter(RobotFile).dump_python(UR10, mode="json", exclude_none=True)
    keys["joints"] = [{"name": "rail", "type": "prismatic"}, {"name": "turn"}]
    keys["mounts"] = [{**keys["mounts"][0], "frame": "turn"}]
    keys |= {"bodies": [], "home_deg": None, "tcp": {}}
    with pytest.raises(ValueError, match="length 0 beyond rail"):
        adapter(RobotFile).validate_python(keys)
