"""Every export of ten robots is loaded by a reader of its own format that others wrote, or by one
of its specification alone, and holds the sensors where they are."""

import ast
import csv
import io
import itertools
import json
import math
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
import yaml
import yourdfpy
from manifold3d import Manifold, Mesh
from mcap.reader import make_reader
from PIL import Image
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.attached import Attached
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.robot import Body
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import effective
from place_rings.coverage.solids.capsules import Capsules
from place_rings.formats.export import ring_bodies as rings_as_bodies
from place_rings.formats.export import srdf
from place_rings.formats.export.placed import PlacedSetup
from place_rings.formats.export.ring_bodies import ring_bodies
from place_rings.formats.export.srdf import link_solids, ring_solid
from place_rings.formats.firmware.sketch import sketch
from place_rings.formats.firmware.wiring import plan_setup
from place_rings.formats.printing.payload import ring_parts
from place_rings.formats.printing.print_files import print_ring
from place_rings.formats.robots.urdf import read_urdf as read_urdf_of
from place_rings.objectives.obstacle import Obstacle
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.reporting.export_formats import FORMATS
from pxr import Gf, UsdGeom, UsdPhysics
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from ..rig.cell import BOX, FLOOR
from ..support.glb import Glb
from ..support.refusals import refused
from ..support.sdf_world import SdfModel, structure_faults
from ..support.simulated_firmware import COMPILER, build
from ..support.urdf_text import chain_text
from ..support.usd_stage import UsdArm
from .test_exports import lua_objects

CLOSE = 1e-6  # m, and of parts of unit vectors
TEN = ("ur10", "ur3", "ur5", "ur3e", "ur5e", "ur10e", "ur16e", "panda", "fr3", "iiwa14")
# these depend on the rings, and hardly on the robot
ON_ONE_ROBOT = {"stl": "panda", "firmware": "iiwa14"}


_masses: dict = {}


@pytest.fixture(autouse=True)
def cheaper_exports(monkeypatch):
    """Pairs of links are sampled at few poses, except where they are what is tested, and the solid
    of a ring is built once to be weighed."""

    def ring_parts_once(scene, ring, number=0):
        key = scene.robot.name, ring, number
        if key not in _masses:
            _masses[key] = ring_parts(scene, ring, number)
        return _masses[key]

    monkeypatch.setattr(srdf, "_POSES", 50)
    monkeypatch.setattr(rings_as_bodies, "ring_parts", ring_parts_once)


@cache
def placed(name: str) -> PlacedSetup:
    """Two rings with boards that can be bought on a robot that moves through three poses."""
    robot, rng = ROBOTS[name].with_links(True), np.random.default_rng(3)
    low, high = np.clip(robot.limits.T, -2 * np.pi, 2 * np.pi)  # of a joint without limits, too
    far = [rng.uniform(0.6 * low, 0.6 * high) for _ in range(2)]
    sensor = effective(Use("vl53l4cd")).sensor
    poses = (Pose(robot.rest), *map(Pose, far))
    scene = Scene(robot=robot, poses=poses, sensor=sensor, obstacles=(BOX, FLOOR))
    links = ("forearm", "tool")
    rings = (Ring(k, 0.5, 3, 0.2, 0.1, scene.radius_of(k), sensor) for k in links)
    return PlacedSetup(scene, Setup(tuple(rings)), 1, Path())


def written(what: PlacedSetup, to: str, folder) -> None:
    """The files of one export in a folder."""
    for file, data in FORMATS[to](what).items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_bytes(data)


def cones(what: PlacedSetup, q=None):
    pose = what.scene.poses[what.pose].q if q is None else q
    return sensor_cones(what.scene.robot, what.setup, pose)


def as_placed(what: PlacedSetup, poses, axis: int, q=None) -> None:
    """These (4, 4) poses are those of the sensors, which look along a column."""
    T, right = np.stack(list(poses)), cones(what, q)
    np.testing.assert_allclose(T[:, :3, 3], right.apex, atol=CLOSE)
    np.testing.assert_allclose(T[:, :3, axis], right.axis, atol=CLOSE)


def read_urdf(what, folder):
    arm = yourdfpy.URDF.load(str(folder / "robot.urdf"))
    q = what.scene.poses[what.pose].q
    arm.update_cfg(dict(zip(what.joint_names, q, strict=True)))
    as_placed(what, (arm.get_transform(s.name, "base_link") for s in what.sensors), 0)
    tcp = arm.get_transform("tcp", "base_link")
    np.testing.assert_allclose(tcp, what.T_base_frame[-1], atol=CLOSE)
    for body, ring in zip(ring_bodies(what), what.setup.rings, strict=True):
        mount, link = what.scene.robot.mount(ring.link), arm.link_map[body.name]
        T = what.T_base_frame[mount.frame] @ mount.T_link_ring(ring.position)
        np.testing.assert_allclose(arm.get_transform(body.name, "base_link"), T, atol=CLOSE)
        (part,) = link.collisions
        solid = trimesh.load(folder / part.geometry.mesh.filename)
        assert solid.is_watertight
        height = [body.envelope.low, body.envelope.high]
        np.testing.assert_allclose(solid.bounds[:, 2], height, atol=CLOSE)
        assert link.inertial.mass == pytest.approx(body.mass.mass)
        np.testing.assert_allclose(link.inertial.inertia, body.mass.inertia, atol=1e-11)
        np.testing.assert_allclose(link.inertial.origin[:3, 3], body.mass.centre, atol=CLOSE)
    read_srdf(what, folder, set(arm.link_map), set(arm.joint_map))
    read_xacro(what, folder, arm)


def read_srdf(what, folder, links, joints):
    """As MoveIt does: names of the URDF, one group that is a chain, pairs with reasons."""
    root = ET.parse(folder / "robot.srdf").getroot()
    assert root.attrib["name"] == ET.parse(folder / "robot.urdf").getroot().attrib["name"]
    chain = root.find("group/chain").attrib
    assert {chain["base_link"], chain["tip_link"]} <= links
    state = root.find("group_state")
    assert state.attrib["group"] == root.find("group").attrib["name"]
    assert {joint.attrib["name"] for joint in state} <= joints
    pairs = [p.attrib for p in root.iter("disable_collisions")]
    assert {p["link1"] for p in pairs} | {p["link2"] for p in pairs} <= links
    assert {p["reason"] for p in pairs} <= {"Adjacent", "Never", "Always"}
    both = [frozenset((p["link1"], p["link2"])) for p in pairs]
    assert len(both) == len(set(both))
    for ring in ring_bodies(what):
        assert frozenset((ring.name, what.carrier(ring.joint))) in both


def read_xacro(what, folder, arm):
    """The macro with its defaults in place says what the URDF says."""
    macro = ET.parse(folder / "sensors.xacro").getroot()[0]
    given = dict(p.split(":=") for p in macro.attrib["params"].split())
    for joint in macro.iter("joint"):
        parent = joint.find("parent").attrib["link"]
        assert parent.startswith("${")
        there = arm.joint_map[joint.attrib["name"].removeprefix("${prefix}")]
        assert there.parent == given[parent[2:-1]]


def read_mjcf(what, folder):
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    poses = np.tile(np.eye(4), (len(what.sensors), 1, 1))
    for T, s in zip(poses, what.sensors, strict=True):
        T[:3, 3], T[:3, :3] = data.site(s.name).xpos, data.site(s.name).xmat.reshape(3, 3)
    as_placed(what, poses, 2)
    for ring in ring_bodies(what):
        body = model.body(ring.name)
        assert body.mass[0] == pytest.approx(ring.mass.mass, rel=1e-6)
        np.testing.assert_allclose(body.ipos, ring.mass.centre, atol=CLOSE)
        moments = np.linalg.eigvalsh(ring.mass.inertia)
        np.testing.assert_allclose(np.sort(body.inertia), moments, rtol=1e-5)


def drawn_poses(what):
    """Joint vectors within the limits, by joint."""
    low, high = np.clip(what.scene.robot.limits.T, -np.pi, np.pi)
    for q in np.random.default_rng(7).uniform(low, high, (10, len(low))):
        yield q, dict(zip(what.joint_names, q, strict=True))


def read_usd(what, folder):
    """As it stands, and by its physics joints alone at drawn joint vectors."""
    arm, robot = UsdArm(folder / "scene.usda"), what.scene.robot
    assert UsdGeom.GetStageUpAxis(arm.stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(arm.stage) == 1
    assert arm.root.HasAPI(UsdPhysics.ArticulationRootAPI)
    as_placed(what, (arm.world(s.name) for s in what.sensors), 2)
    np.testing.assert_allclose(arm.world("tcp"), what.T_base_frame[-1], atol=CLOSE)
    for name, T in zip(what.links, what.T_base_frame, strict=False):
        np.testing.assert_allclose(arm.world(name), T, atol=CLOSE)
        assert arm.prims[name].HasAPI(UsdPhysics.RigidBodyAPI)
    for q, values in drawn_poses(what):
        there = arm.at(values)
        for name, T in zip(what.links, forward(robot.chain, q), strict=False):
            np.testing.assert_allclose(there[name], T, atol=CLOSE)
    for joint, limits, q in zip(
        what.joint_names, robot.limits, what.scene.poses[what.pose].q, strict=True
    ):
        np.testing.assert_allclose(arm.limits(joint), limits, atol=CLOSE)
        start = arm.prims[joint].GetAttribute("state:angular:physics:position").Get()
        assert math.radians(start) == pytest.approx(q, abs=CLOSE)
    for s in what.sensors:
        prim = arm.prims[s.name]
        stated = {k: prim.GetAttribute(f"place_rings:{k}").Get() for k in ("fov_deg", "range_m")}
        assert stated["fov_deg"] == pytest.approx(math.degrees(s.unit.fov))
        assert stated["range_m"] == s.unit.range_m
        camera = UsdGeom.Camera(prim.GetChild("view"))
        view = camera.GetCamera(0)
        fov = view.GetFieldOfView(Gf.Camera.FOVHorizontal)
        assert fov == pytest.approx(stated["fov_deg"], abs=1e-4)
        looks = -arm.world(camera.GetPrim())[:3, 2]  # as cameras of USD do
        np.testing.assert_allclose(looks, arm.world(s.name)[:3, 2], atol=CLOSE)
    for body in ring_bodies(what):
        stated = UsdPhysics.MassAPI(arm.prims[f"{body.name}_envelope"])
        assert stated.GetMassAttr().Get() == pytest.approx(body.mass.mass)
        moments = np.linalg.eigvalsh(body.mass.inertia)
        np.testing.assert_allclose(stated.GetDiagonalInertiaAttr().Get(), moments, rtol=1e-5)
    paths = {path.GetName() for path in arm.stage.GetPrimAtPath("/cell").GetChildren()}
    assert paths == {"obstacle_0", "obstacle_1"}


def read_sdf(what, folder):
    model, robot = SdfModel(folder / "scene.sdf", what.robot_name), what.scene.robot
    assert structure_faults(model.root) == []
    q = what.scene.poses[what.pose].q
    there = model.at(dict(zip(what.joint_names, q, strict=True)))
    as_placed(what, (there[s.name] for s in what.sensors), 0)
    for q, values in drawn_poses(what):
        there = model.at(values)
        for name, T in zip((*what.links, "tcp"), forward(robot.chain, q), strict=True):
            np.testing.assert_allclose(there[name], T, atol=CLOSE)
    for uri in model.root.iter("uri"):
        assert trimesh.load(folder / uri.text).is_watertight
    for body in ring_bodies(what):
        assert float(model.links[body.name].findtext("inertial/mass")) == pytest.approx(
            body.mass.mass
        )


def read_glb(what, folder):
    """As trimesh has it at the exported pose, and as the animation has it at each time."""
    made = trimesh.load(folder / "scene.glb")
    down = np.linalg.inv(made.graph["base_link"][0])
    as_placed(what, (down @ made.graph[s.name][0] for s in what.sensors), 2)
    file, chain = Glb((folder / "scene.glb").read_bytes()), what.scene.robot.chain
    poses = [pose.q for pose in what.scene.poses]
    for time in (0.0, 0.37, 1.0, 1.83, 2.0):  # a pose each second, and evenly between
        q = np.array([np.interp(time, range(len(poses)), joint) for joint in np.transpose(poses)])
        there = file.at(time)
        back, frames = np.linalg.inv(there["base_link"]), forward(chain, q)
        as_placed(what, (back @ there[s.name] for s in what.sensors), 2, q)
        for name, T in zip((*what.links, "tcp"), frames, strict=True):
            np.testing.assert_allclose(back @ there[name], T, atol=CLOSE)


def read_csv(what, folder):
    rows = list(csv.DictReader(io.StringIO((folder / "sensors.csv").read_text())))
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    for T, row in zip(poses, rows, strict=True):
        T[:3, 3], T[:3, 2] = ([float(row[f"{k}_{x}"]) for x in "xyz"] for k in ("apex", "axis"))
    as_placed(what, poses, 2)


def read_json(what, folder):
    rings = json.loads((folder / "sensors.json").read_text())["rings"]
    as_placed(what, (pose(s["base_xyz"], s["base_xyzw"]) for r in rings for s in r["sensors"]), 2)


def pose(xyz, xyzw) -> np.ndarray:
    """A pose from place and quaternion, by the formula of the rotation matrix alone."""
    x, y, z, w = xyzw
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = xyz
    return T


def read_coppeliasim(what, folder):
    made = lua_objects(folder)
    links = {str(n + 1): n for n, one in enumerate(made)}
    sensors = [one for one in made if one[0] == "cone"]
    by_link = {what.links[j]: what.T_base_frame[j] for j in range(len(what.links))}

    def numbers(text):
        return np.array(text.split(), float)

    found = []
    for _, _, parent, there, _ in sensors:
        name = made[links[parent]][1]  # "-" is the link that the scene has
        T = by_link["wrist_3_link" if name == "-" else name]
        found.append(T @ pose(numbers(there)[:3], numbers(there)[3:]))
    as_placed(what, found, 2)


def read_ros2(what, folder):
    listed = yaml.safe_load((folder / "static_transforms.yaml").read_text())["transforms"]
    yaml.safe_load((folder / "static_transforms.launch.yaml").read_text())
    ast.parse((folder / "static_transforms.py").read_text())
    links = {name: what.T_base_frame[j] for j, name in enumerate(what.links)}
    as_placed(what, (links[t["parent"]] @ pose(t["xyz"], t["xyzw"]) for t in listed), 0)


def read_mcap(what, folder):
    """By the format's own library, and as a bag of ROS 2; at the end the robot is in its last
    pose, by the tree of transforms alone."""
    with (folder / "run" / "run.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    topics = {channel.topic for channel in summary.channels.values()}
    assert topics == {"/tf", "/tf_static", "/joint_states"}
    store, last = get_typestore(Stores.ROS2_HUMBLE), {}
    with Reader(folder / "run") as bag:
        for connection, stamp, data in bag.messages():
            message = store.deserialize_cdr(data, connection.msgtype)
            last[connection.topic] = message
            if connection.topic == "/joint_states":
                assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == stamp
    q = what.scene.poses[-1].q
    assert last["/joint_states"].name == list(what.joint_names)
    np.testing.assert_allclose(last["/joint_states"].position, q, atol=1e-9)
    frames = {"base_link": np.eye(4)}
    for t in [*last["/tf"].transforms, *last["/tf_static"].transforms]:
        xyz, r = t.transform.translation, t.transform.rotation
        T = pose((xyz.x, xyz.y, xyz.z), (r.x, r.y, r.z, r.w))
        frames[t.child_frame_id] = frames[t.header.frame_id] @ T
    as_placed(what, (frames[s.name] for s in what.sensors), 0, q)
    T = forward(what.scene.robot.chain, q)[-1]
    np.testing.assert_allclose(frames["tcp"], T, atol=CLOSE)


def read_stl(what, folder):
    halves = sorted(folder.glob("*.stl"))
    assert len(halves) == 2 * len(what.setup.rings)
    for half in halves:
        mesh = trimesh.load(half)
        assert mesh.is_watertight
        assert mesh.volume > 0
    json.loads((folder / "printing.json").read_text())
    pictures = list(folder.glob("*.png"))
    assert pictures
    for picture in pictures:
        with Image.open(picture) as image:
            image.load()


def read_firmware(what, folder):
    for picture in folder.rglob("*.png"):
        with Image.open(picture) as image:
            image.load()
    for wiring in plan_setup(what.setup, what.scene.electronics):
        for file, data in sketch(wiring).items():
            assert (folder / file).read_bytes() == data
        if COMPILER is not None:
            build(wiring)


READERS: dict[str, Callable] = {
    "urdf": read_urdf,
    "mjcf": read_mjcf,
    "usd": read_usd,
    "sdf": read_sdf,
    "glb": read_glb,
    "csv": read_csv,
    "json": read_json,
    "coppeliasim": read_coppeliasim,
    "ros2": read_ros2,
    "mcap": read_mcap,
    "stl": read_stl,
    "firmware": read_firmware,
}


EACH = [
    pytest.param(name, to, id=f"{to}-{name}")
    for name, to in itertools.product(TEN, FORMATS)
    if ON_ONE_ROBOT.get(to, name) == name
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "to"), EACH)
def test_an_export_is_read_by_a_reader_of_its_format(tmp_path, name, to):
    what = placed(name)
    if to in ON_ONE_ROBOT:
        what = replace(what, setup=Setup(what.setup.rings[-1:]))
    written(what, to, tmp_path)
    READERS[to](what, tmp_path)


def test_each_export_has_a_reader_and_ten_robots():
    assert set(READERS) == set(FORMATS)
    assert len(TEN) == 10


LEAST = Obstacle("crumb", replace(BOX.body, edges=1e-5 * BOX.body.edges))


def test_bodies_of_almost_no_length_or_width_are_read(tmp_path):
    """Capsules of 0.2 nm, a body of a few micrometres on a link without another, names that occur
    twice, and an obstacle like a grain of dust."""
    robot = ROBOTS["ur10"]
    short = Capsules(np.zeros(3), np.array([0, 0, 2e-10]), 0.05)
    thin = Capsules(np.zeros(3), np.array([0, 0, 0.1]), 2e-6)
    bodies = [Body("obstacle_0_crumb", 1, short), Body("short", 1, short), Body("thin", 3, thin)]
    chain = replace(robot.chain, joints=("base", *robot.chain.joints[1:]))
    robot = replace(robot, chain=chain, bodies=tuple(bodies), tube_links=None, joint_links=None)
    scene = Scene(robot=robot, obstacles=(LEAST,), occlusion="ignore")
    what = PlacedSetup(scene, named_setup("n1_3_0"), 0, tmp_path)
    for to in ("urdf", "mjcf", "glb"):
        written(what, to, tmp_path)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    sizes = [model.geom(name).size[0] for name in ("short", "thin")]
    np.testing.assert_allclose(sizes, [0.05, 2e-6], rtol=1e-6)
    assert model.geom("short").type[0] == mujoco.mjtGeom.mjGEOM_SPHERE
    arm = yourdfpy.URDF.load(str(tmp_path / "robot.urdf"), load_meshes=False)
    assert "base_link_2" in arm.link_map
    lengths = [e.attrib["length"] for e in ET.parse(tmp_path / "robot.urdf").iter("cylinder")]
    assert set(map(float, lengths)) == {0.1}
    trimesh.load(tmp_path / "scene.glb")


def test_inertias_of_rings_are_those_of_the_printed_solids():
    """The plastic of a ring, by trimesh from the files that are printed, is most of its mass; the
    rest are boards and bolts within the ring's size."""
    what = placed("panda")
    ring, body = what.setup.rings[0], ring_bodies(what)[0]
    _, files, _, _ = print_ring(what.scene, 0, ring)
    plastic = sum(trimesh.load(io.BytesIO(f), file_type="stl").volume for f in files) * 1e-9
    assert 1270 * plastic < body.mass.mass < 3 * 1270 * plastic
    assert np.linalg.norm(body.mass.centre) < ring.radius
    moments = np.linalg.eigvalsh(body.mass.inertia)
    assert moments[0] > 0
    assert moments[0] + moments[1] >= moments[2]  # of a body that can exist
    farthest = body.envelope.outer + max(abs(body.envelope.low), body.envelope.high)
    assert moments[2] < body.mass.mass * farthest**2


def solids(what: PlacedSetup) -> list[tuple[str, int, Manifold]]:
    """Links and rings as solids of another library: name, frame that carries it, and its shape in
    that frame."""
    made = []
    for body in what.scene.robot.bodies:
        ball = Manifold.sphere(float(body.capsule.radius), 48)
        ends = [ball.translate(p) for p in (body.capsule.start, body.capsule.end)]
        joint = min(body.frame, len(what.links) - 1)
        made.append((what.carrier(joint), body.frame, Manifold.batch_hull(ends)))
    for ring in ring_bodies(what):
        mesh = trimesh.load(io.BytesIO(ring.stl()), file_type="stl")
        for p in mesh.split():
            part = Mesh(np.asarray(p.vertices, np.float32), np.asarray(p.faces, np.uint32))
            made.append((ring.name, ring.joint, Manifold(part).transform(ring.T_link_ring[:3])))
    return made


@pytest.mark.parametrize("name", ["ur10", "panda"])
def test_pairs_of_an_srdf_are_right_by_the_gaps_of_another_library(name, tmp_path, monkeypatch):
    """In poses that nobody sampled: what never touches has a gap, what always touches has none."""
    monkeypatch.setattr(srdf, "_POSES", 1000)
    what = placed(name)
    written(what, "urdf", tmp_path)
    low, high = what.scene.robot.limits.T
    rng = np.random.default_rng(11)
    pairs = [p.attrib for p in ET.parse(tmp_path / "robot.srdf").iter("disable_collisions")]
    rings = [p for p in pairs if "ring_" in p["link1"] + p["link2"] and p["reason"] != "Adjacent"]
    assert any(p["reason"] == "Never" for p in rings)
    made = solids(what)
    for _ in range(6):
        q = rng.uniform(np.maximum(low, -np.pi), np.minimum(high, np.pi))
        frames, there = forward(what.scene.robot.chain, q), {}
        for solid, frame, shape in made:
            T = np.eye(4) if frame < 0 else frames[frame]
            there.setdefault(solid, []).append(shape.transform(T[:3]))
        for p in rings:
            gap = min(a.min_gap(b, 0.05) for a in there[p["link1"]] for b in there[p["link2"]])
            assert (gap > 0) == (p["reason"] == "Never"), p
    if name == "ur10":  # a ring on the forearm and the upper arm touch when the elbow folds
        (forearm,) = [r for r in ring_bodies(what) if r.joint == 2]
        both = {frozenset((p["link1"], p["link2"])) for p in pairs}
        assert frozenset((forearm.name, what.carrier(1))) not in both
        assert ring_solid(forearm).joint == 2
        assert set(link_solids(what)) >= {0, 1, 2}


def test_a_users_own_urdf_gets_the_rings_and_pairs_of_them_alone(tmp_path):
    """With a part that is attached; rings of real mounts keep their own link out of the checks."""
    (tmp_path / "mine.urdf").write_text(chain_text(ROBOTS["ur10"].chain, "mine"))
    ball = Attached("ball", "forearm", Capsules(np.zeros(3), np.array([0.1, 0, 0]), 0.04))
    what = placed("ur10")
    scene = replace(what.scene, attached=(ball,))
    own = read_urdf_of(tmp_path / "mine.urdf")
    what = PlacedSetup(scene, what.setup, 0, tmp_path, own)
    written(what, "urdf", tmp_path)
    arm = yourdfpy.URDF.load(str(tmp_path / "robot.urdf"))
    root = ET.parse(tmp_path / "robot.srdf").getroot()
    assert root.attrib["name"] == own.name
    pairs = [p.attrib for p in root.iter("disable_collisions")]
    assert {p["link1"] for p in pairs} | {p["link2"] for p in pairs} <= set(arm.link_map)
    assert all("ring_" in p["link1"] + p["link2"] for p in pairs)
    named = {frozenset((p["link1"], p["link2"])): p["reason"] for p in pairs}
    assert "Adjacent" in named.values()
    with refused('robot.urdf link "tof_0_0"'):
        FORMATS["urdf"](replace(what, urdf=read_urdf_of(tmp_path / "robot.urdf")))
