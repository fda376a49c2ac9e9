"""Exports for simulators: zones as rays, joints that slide or follow, a user's meshes, and files in
the pendant's Base. ``test_export_readers.py`` has the readers of ten robots."""

import math
import xml.etree.ElementTree as ET
from dataclasses import replace

import mujoco
import numpy as np
import place_rings as pr
import pytest
import trimesh
import yourdfpy
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.formats.export.mjcf import MOST_ZONES
from place_rings.formats.export.placed import PlacedSetup
from place_rings.formats.export.sdf import lidar_grid
from place_rings.formats.loader import resolve
from place_rings.formats.robots.urdf import read_urdf
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.reporting.export_formats import FORMATS, export_notes
from place_rings.rig.sensing.zone_targets import expected_zones
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from ..rig.cell import FLOOR, TABLE
from ..support import drawing
from ..support.rails import carried
from ..support.refusals import refused
from ..support.sdf_world import SdfModel, structure_faults
from ..support.urdf_text import chain_text
from ..support.usd_stage import UsdArm
from .test_exports import written

CLOSE, TURNED = 1e-6, np.diag([-1.0, -1.0, 1.0, 1.0])
GRID = effective(Use("vl53l5cx")).sensor


def zoned(links=("forearm", "tool"), count=3) -> tuple[Scene, Setup]:
    """A UR10 with sensors of many zones, above a table and a floor."""
    robot = ROBOTS["ur10"]
    poses = tuple(Pose(robot.rest + turn) for turn in (0.0, 0.4))
    scene = Scene.paper(robot=robot, poses=poses, obstacles=(TABLE, FLOOR))
    return scene, Setup(tuple(Ring(k, 0.5, count, -0.6, 0.2, 0.12, GRID) for k in links))


def test_zones_in_mujoco_see_what_the_rigs_zones_see(tmp_path):
    """The ray through the middle of a zone is one of those that the rig casts through it, and the
    zone's reading is the nearest of them."""
    scene, setup = zoned()
    written(tmp_path, scene, setup, "mjcf")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    data, hits = mujoco.MjData(model), 0
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    q = scene.poses[-1].q[None]
    for i, ring in enumerate(setup.rings):
        nearest = expected_zones(scene, setup, i, q)[0, ..., 0]
        for k, row, column in np.ndindex(ring.count, GRID.rows, GRID.zones):
            name, reading = f"tof_{i}_{k}_{row}_{column}", nearest[k, row, column]
            there = data.sensor(name).data[0]
            along = data.site(name).xmat.reshape(3, 3)[:, 2]
            axis = data.site(f"tof_{i}_{k}").xmat.reshape(3, 3)[:, 2]
            reach = GRID.range_m / (along @ axis)
            assert 0 <= reach - GRID.range_m < GRID.range_m
            if there in (-1.0, pytest.approx(reach)):  # no hit: the others may hit
                continue
            hits += 1
            assert reading <= there + 1e-3
    assert hits > 40


def test_many_zones_get_one_rangefinder_a_sensor_and_a_note(tmp_path):
    scene, setup = zoned(count=5)
    placed = PlacedSetup(scene, setup, 0, tmp_path)
    assert 10 * GRID.zones * GRID.rows > MOST_ZONES
    root = ET.fromstring(FORMATS["mjcf"](placed)["scene.xml"])
    names = [finder.get("name") for finder in root.iter("rangefinder")]
    assert names == [s.name for s in placed.sensors]
    assert len(export_notes(placed, ["mjcf"])) == 1
    few = replace(placed, setup=Setup(setup.rings[:1]))
    assert export_notes(few, ["mjcf", "sdf", "usd", "csv"]) == []


@given(st.integers(1, 16), st.integers(1, 16), st.integers(5, 90), st.integers(5, 90))
def test_each_ray_of_a_lidar_lies_in_its_zone(columns, rows, across_deg, up_deg):
    """Zones are parts of a pyramid, equal in tangents; a lidar's rays are equal in angle."""
    sensor = Sensor(math.radians(across_deg), 2.0, fov_up=math.radians(up_deg), zones=columns)
    sides = (columns, sensor.half_angle), (columns, sensor.half_angle_up)
    for (count, half), (zones, edge) in zip(lidar_grid(sensor), sides, strict=True):
        tangents = np.tan(np.linspace(-half, half, count)) / math.tan(edge)
        if zones > 1:
            assert list(np.floor((tangents + 1) / 2 * zones)) == list(range(zones))
        else:
            assert np.abs(tangents).max() <= 1 + 1e-12


def test_lidars_of_other_shapes():
    cone = Sensor(math.radians(25), 1.5)
    (count, half), again = lidar_grid(cone)
    corner = math.atan(math.hypot(math.tan(half), math.tan(half)))
    assert (count, (count, half)) == (5, again)
    assert corner == pytest.approx(cone.half_angle)  # the corners of the grid lie on the cone
    fan = Sensor(math.radians(270), 2.0, shape="fan", thickness=0.02)
    assert lidar_grid(fan) == ((271, math.radians(135)), (1, 0.0))
    assert lidar_grid(Sensor(math.radians(180), 0.2, shape="dome")) is None


@settings(max_examples=4)
@given(drawing.seeds)
def test_a_rail_slides_in_usd_and_sdf(tmp_path_factory, seed):
    folder, rng = tmp_path_factory.mktemp("rail"), np.random.default_rng(seed)
    robot = carried(ROBOTS["ur10"].with_links(True), rng.normal(size=3))
    rules = Rules(mount="free")
    scene = Scene(robot, poses=(Pose(robot.rest),), rules=rules, occlusion="ignore")
    written(folder, scene, Setup.named("n1_3_0"), "usd", "sdf")
    arm, model = UsdArm(folder / "scene.usda"), SdfModel(folder / "scene.sdf", robot.name)
    assert structure_faults(model.root) == []
    np.testing.assert_allclose(arm.limits("rail"), robot.limits[0], atol=CLOSE)
    for q in rng.uniform(-1, 1, (3, len(robot.chain))):
        values = dict(zip(robot.chain.joints, q, strict=True))
        for there in (arm.at(values), model.at(values)):
            for joint, T in zip(robot.chain.joints, forward(robot.chain, q), strict=False):
                np.testing.assert_allclose(there[f"{joint}_link"], T, atol=CLOSE)


def test_names_that_a_format_lacks_or_needs_itself_are_replaced(tmp_path):
    """Prims do not begin with a digit, and no two parts of a model of SDFormat have one name."""
    own, names = ROBOTS["ur10"].with_links(True), ("1", "1_link", "base_link", "fixed_base", "2")
    robot = replace(own, name="7", chain=replace(own.chain, joints=(*names, "ring_0")))
    scene = Scene(robot, poses=(Pose(robot.rest),), occlusion="ignore")
    written(tmp_path, scene, Setup((Ring("forearm", 0.5, 3, 0.2, 0.0, 0.12),)), "usd", "sdf")
    arm, model = UsdArm(tmp_path / "scene.usda"), SdfModel(tmp_path / "scene.sdf", "7")
    assert len(arm.moving) == len(robot.chain)
    parts = [part.get("name") for part in model.model if part.tag in ("joint", "link", "frame")]
    assert len(set(parts)) == len(parts)


def test_a_users_meshes_stand_in_the_usd(tmp_path):
    """Where their URDF has them, before the capsules that physics uses."""
    text = chain_text(ROBOTS["ur10"].chain, "mine")
    shape = '<origin xyz="0.1 0 0"/><geometry><mesh filename="block.stl"/></geometry>'
    link = yourdfpy.URDF.load(_saved(tmp_path, text)).joint_map["elbow"].child
    before, empty, after = text.partition(f'<link name="{link}" />')
    assert empty
    text = f'{before}<link name="{link}"><visual>{shape}</visual></link>{after}'
    trimesh.creation.box((0.1, 0.2, 0.3)).export(tmp_path / "block.stl")
    robot = ROBOTS["ur10"]
    scene = Scene.paper(robot=robot, poses=(Pose(robot.rest + 0.3),))
    own = read_urdf(_saved(tmp_path, text))
    written(tmp_path, scene, Setup.named("n1_3_0"), "usd", urdf=own)
    arm = UsdArm(tmp_path / "scene.usda")
    (prim,) = (prim for name, prim in arm.prims.items() if name.startswith("body_"))
    points = np.array(prim.GetAttribute("points").Get())
    T = forward(robot.chain, scene.poses[0].q)[2]
    np.testing.assert_allclose(arm.world(prim), T, atol=CLOSE)
    np.testing.assert_allclose(points.min(axis=0), [0.05, -0.1, -0.15], atol=CLOSE)
    np.testing.assert_allclose(points.max(axis=0), [0.15, 0.1, 0.15], atol=CLOSE)
    guides = [p for n, p in arm.prims.items() if n.startswith("collision_")]
    assert {p.GetAttribute("purpose").Get() for p in guides} == {"guide"}


def test_sensors_of_the_cell_stand_where_they_are_whatever_the_urdf_calls_its_base(tmp_path):
    """A URDF may begin the arm elsewhere than the scene; MJCF, USD and SDF begin at the base."""
    chain, shifted = ROBOTS["ur10"].chain, np.eye(4)
    shifted[:3, 3] = 0.5, 0.2, -0.1
    origin = np.concatenate([shifted[None] @ chain.origin[:1], chain.origin[1:]])
    own = read_urdf(_saved(tmp_path, chain_text(replace(chain, origin=origin), "mine")))
    camera = pr.MountedSensor("base", (0.3, 0.4, 0.5), (0.0, 1.0, 0.0))
    scene = Scene.paper(robot=ROBOTS["ur10"], cell_sensors=(camera,))
    placed = PlacedSetup(scene, Setup(()), 0, tmp_path, own)
    for kind in ("usd", "sdf", "mjcf", "glb"):
        for file, data in FORMATS[kind](placed).items():
            (tmp_path / file).write_bytes(data)
    for key, T in poses_in(tmp_path, placed).items():
        np.testing.assert_allclose(T[:3, 3], camera.position, atol=CLOSE, err_msg=key)


def _saved(folder, text):
    (folder / "mine.urdf").write_text(text)
    return folder / "mine.urdf"


def poses_in(folder, placed) -> dict[str, np.ndarray]:
    """The sensors in the world of each format, as its own reader has them."""
    q, made = placed.scene.poses[0].q, {}
    values = dict(zip(placed.joint_names, q, strict=True))
    arm = UsdArm(folder / "scene.usda")
    sdf = SdfModel(folder / "scene.sdf", placed.robot_name)
    there, data = sdf.at(values), _mujoco(folder)
    scene = trimesh.load(folder / "scene.glb")
    up = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # from glTF's y up
    for s in placed.sensors:
        made[f"usd {s.name}"] = arm.world(s.name)
        made[f"sdf {s.name}"] = there[s.name]
        made[f"glb {s.name}"] = up @ scene.graph[s.name][0]
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = data.site(s.name).xmat.reshape(3, 3), data.site(s.name).xpos
        made[f"mjcf {s.name}"] = T
    return made


def _mujoco(folder):
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    return data


@settings(max_examples=3)
@given(drawing.seeds, st.sampled_from(["ur5e", "ur10", "ur10_dh"]))
def test_files_in_the_other_base_are_turned_by_half_a_turn(tmp_path_factory, seed, name):
    """Robot and cell together, so that the same rays hit the same places; JSON comes back."""
    rng, robot = np.random.default_rng(seed), ROBOTS[name]
    q = np.clip(drawing.pose(rng, 6), *robot.limits.T)
    scene = Scene.paper(robot=robot, poses=(Pose(q),), obstacles=(TABLE, FLOOR))
    setup = Setup.named("n1_3_16")
    other = "base_link" if name == "ur10_dh" else "pendant"
    each, read = [], []
    for base in (None, other):
        folder = tmp_path_factory.mktemp("base")
        kinds = ("usd", "sdf", "glb", "mjcf", "json")
        written(folder, scene, setup, *kinds, base=base)
        each.append(poses_in(folder, PlacedSetup(scene, setup, 0, folder)))
        read.append((_mujoco(folder).sensordata, resolve(str(folder / "sensors.json"), scene)[0]))
    here, there = each
    for key, T in here.items():
        np.testing.assert_allclose(there[key], TURNED @ T, atol=CLOSE)
    np.testing.assert_allclose(read[0][0], read[1][0], atol=1e-9)
    for one, again in zip(read[0][1].rings, read[1][1].rings, strict=True):
        assert (one.link, one.count) == (again.link, again.count)
        np.testing.assert_allclose(one.position, again.position, atol=CLOSE)


def test_the_pendants_base_is_a_frame_of_ros(tmp_path):
    """As in ur_description: base_link turned by half a turn, and not where the file has it."""
    setup, scene = Setup.named("n1_3_16"), Scene.paper(robot=ROBOTS["ur5e"])
    written(tmp_path, scene, setup, "urdf", "ros2", base="pendant")
    arm = yourdfpy.URDF.load(str(tmp_path / "robot.urdf"))
    np.testing.assert_allclose(arm.get_transform("base", "base_link"), TURNED, atol=CLOSE)
    assert "child: base\n" in (tmp_path / "static_transforms.yaml").read_text()
    own = read_urdf(tmp_path / "robot.urdf")
    assert PlacedSetup(scene, setup, 0, tmp_path, own, base="pendant").pendant_base is None
    assert PlacedSetup(scene, setup, 0, tmp_path).pendant_base is None


def test_a_base_that_the_robot_lacks_is_refused(tmp_path):
    with refused("base_frame", "pendant", error=pr.InputError):
        pr.export("n1_3_16", pr.Scene("panda"), to="usd", folder=tmp_path, base_frame="pendant")
    assert list(tmp_path.iterdir()) == []
    pr.export("n1_3_16", to="json", folder=tmp_path, base_frame="pendant")
    text = (tmp_path / "sensors.json").read_text().replace('"robot": "ur10"', '"robot": "panda"')
    (tmp_path / "other.json").write_text(text)
    with refused("other.json", "base", "pendant"):
        resolve(str(tmp_path / "other.json"), Scene.paper(robot=ROBOTS["panda"]))


def test_a_bag_holds_what_a_twin_of_the_setup_reports(tmp_path):
    """At rest each point of a zone is as far as the rig's own rays say, but for noise; a sensor of
    one zone states its range."""
    scene, setup = zoned(("forearm",))
    rest = replace(scene, poses=(scene.poses[0],) * 2)  # for one second
    setup = replace(setup, rings=(*setup.rings, Ring("tool", 0.0, 3, 0.4, 0.0, 0.12)))
    written(tmp_path, rest, setup, "mcap", readings=True)
    wanted, store = expected_zones(rest, setup, 0, rest.poses[0].q[None])[0], _store()
    seen, clouds, ranges = 0, 0, 0
    with Reader(tmp_path / "run") as bag:
        for connection, stamp, data in bag.messages():
            if not connection.topic.startswith("/tof_"):
                continue
            message = store.deserialize_cdr(data, connection.msgtype)
            measured = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
            assert measured <= 1e-9 * stamp
            name = connection.topic.split("/")[1]
            assert message.header.frame_id == name
            if not connection.topic.endswith("/zones"):
                ranges += 1
                assert name.startswith("tof_1_")
                continue
            clouds += 1
            rows = np.frombuffer(message.data, np.dtype("<f4, <f4, <f4, u1, V3"))
            far = np.linalg.norm([rows[f"f{i}"] for i in range(3)], axis=0)
            true = wanted[int(name[-1])].reshape(-1)
            valid = rows["f3"] == 0
            assert np.isfinite(far[valid]).all()
            assert np.isnan(far[~valid]).all()
            both = valid & np.isfinite(true)
            assert (np.abs(far[both] - true[both]) < 0.03 + 0.15 * true[both]).all()
            seen += int(both.sum())
    assert seen > 50
    assert min(clouds, ranges) >= 6


def _store():
    return get_typestore(Stores.ROS2_HUMBLE)
