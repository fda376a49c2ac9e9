"""Exports: what other programs read is what we meant, names of any kind do nothing, and what comes
back is what went out.
"""

import io
import math
import runpy
import shutil
import subprocess
import sys
import types
import xml.etree.ElementTree as ET
from dataclasses import replace

import mujoco
import numpy as np
import place_rings as pr
import pytest
import trimesh
import yaml
import yourdfpy
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.rings.ring import Ring, Setup, named_setup
from place_rings.coverage.rings.ring_kinematics import sensor_cones
from place_rings.coverage.robots.attached import Attached
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.link_bodies import robot_capsules
from place_rings.coverage.sensors.effective_range import Use
from place_rings.coverage.sensors.sensor import Sensor, effective
from place_rings.coverage.solids.polyhedra import box
from place_rings.coverage.targets.named import Shell
from place_rings.formats.export import srdf
from place_rings.formats.export.placed import PlacedSetup
from place_rings.formats.export.ring_bodies import ring_bodies
from place_rings.formats.loader import resolve
from place_rings.formats.robots.urdf import read_urdf
from place_rings.formats.sensors.sensor_frames import looking_along, looking_along_z, sensor_frames
from place_rings.formats.sensors.urdf_frames import FramePattern
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene
from place_rings.reporting.export_formats import FORMATS
from place_rings.rig.sensing.ray_fan import ray_to_capsule, ray_to_polyhedron

from ..rig.cell import BOX, FLOOR, TABLE
from ..support import drawing
from ..support.refusals import has_parts, refused
from ..support.urdf_text import chain_text, joint

CLOSE = 1e-6  # m, and of parts of unit vectors, as was asked
ARMS = ("ur10", "panda", "iiwa14")
few = settings(max_examples=4)


@pytest.fixture(autouse=True, scope="module")
def few_sampled_poses():
    """Of the pairs of links that can touch, which are tested elsewhere."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(srdf, "_POSES", 50)
        yield


def drawn(seed: int, name: str) -> tuple[Scene, Setup]:
    """A robot in a drawn pose with drawn rings."""
    rng, robot = np.random.default_rng(seed), ROBOTS[name]
    setup = drawing.setup(rng)
    q = np.clip(drawing.pose(rng, len(robot.chain)), *robot.limits.T)
    poses = (Pose(robot.rest), Pose(q))
    return Scene.paper(robot=robot, poses=poses), setup


def written(folder, scene: Scene, setup: Setup, *to: str, **keys) -> None:
    """The files of these formats at the scene's last pose."""
    placed = PlacedSetup(scene, setup, len(scene.poses) - 1, folder, **keys)
    for name in to:
        for file, data in FORMATS[name](placed).items():
            (folder / file).parent.mkdir(exist_ok=True)
            (folder / file).write_bytes(data)


def same(scene: Scene, a: Setup, b: Setup) -> None:
    """The same beams in every pose."""
    assert [r.count for r in a.rings] == [r.count for r in b.rings]
    for pose in scene.poses:
        one, other = (sensor_cones(scene.robot, s, pose.q) for s in (a, b))
        np.testing.assert_allclose(other.apex, one.apex, atol=CLOSE)
        np.testing.assert_allclose(other.axis, one.axis, atol=CLOSE)
        np.testing.assert_allclose(other.half_angle, one.half_angle, atol=CLOSE)
        np.testing.assert_allclose(other.range_m, one.range_m, atol=CLOSE)
        if one.up is not None:
            along = np.abs((one.up * other.up).sum(axis=1)[one.size > 0])
            np.testing.assert_allclose(along, 1, atol=CLOSE)


@few
@given(drawing.seeds, st.sampled_from(ARMS))
def test_a_urdf_comes_back(tmp_path_factory, seed, name):
    """Read back by their names alone, the sensors are our rings."""
    scene, setup = drawn(seed, name)
    setup = Setup(tuple(replace(r, sensor=scene.sensor) for r in setup.rings))
    folder = tmp_path_factory.mktemp("urdf")
    written(folder, scene, setup, "urdf")
    same(scene, setup, resolve(str(folder / "robot.urdf"), scene)[0])


@pytest.mark.parametrize("name", ARMS)
def test_mujocos_rangefinders_return_what_our_geometry_predicts(tmp_path, name):
    """In a cell with a table and a floor, at many poses, the robot's own bodies included: to 1 mm,
    as was asked.
    """
    robot, rng = ROBOTS[name], np.random.default_rng(5)
    rings = (
        Ring("upper_arm", 0.5, 8, 0.6, 0.2, 0.14),
        Ring("forearm", 0.5, 8, -1.2, 0.1, 0.13),
        Ring("forearm", 0.2, 5, 1.45, 0.0, 0.13),
        Ring("tool", 0.0, 6, -0.9, 0.3, 0.1),
    )
    setup = Setup(rings)
    poses = [robot.rest, *(robot.rest + rng.uniform(-0.7, 0.7, (15, len(robot.chain))))]
    poses = np.clip(poses, *robot.limits.T)
    scene = Scene.paper(robot=robot, poses=tuple(Pose(q) for q in poses), obstacles=(TABLE, FLOOR))
    written(tmp_path, scene, setup, "mjcf")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    data, hits = mujoco.MjData(model), np.zeros(3, int)
    sensors = sensor_frames(robot, setup)
    range_m = [s.unit.range_m for s in sensors]
    for q in poses:
        data.qpos = q
        mujoco.mj_forward(model, data)
        cones = sensor_cones(robot, setup, q)
        bodies = robot_capsules(robot, forward(robot.chain, q))
        start, beam = cones.apex, cones.axis
        to_robot = ray_to_capsule(
            start[:, None], beam[:, None], bodies.start, bodies.end, bodies.radius
        )
        to_cell = [ray_to_polyhedron(start, beam, o.body) for o in scene.obstacles]
        each = np.array([to_robot.min(axis=1), *to_cell])
        nearest = each.min(axis=0)
        wanted = np.where(np.isinf(nearest), -1, np.minimum(nearest, range_m))
        found = np.array([data.sensor(s.name).data[0] for s in sensors])
        free = nearest > 0  # the others stand in something
        np.testing.assert_allclose(found[free], wanted[free], atol=1e-3)
        hits += np.bincount(each.argmin(axis=0)[free & (nearest < range_m)], minlength=3)
    assert (hits >= 3).all()


def turned(xyzw, v) -> np.ndarray:
    """A vector turned by a quaternion, by Hamilton's product alone."""
    x, y, z, w = xyzw
    assert x * x + y * y + z * z + w * w == pytest.approx(1, abs=1e-9)
    u, v = np.array([x, y, z]), np.array(v, float)
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


class RosNode:
    """A node that knows the time."""

    def get_clock(self):
        return types.SimpleNamespace(now=lambda: types.SimpleNamespace(to_msg=lambda: "now"))


class RosTransform:
    """``geometry_msgs/TransformStamped``: attributes, and three records of attributes."""

    def __init__(self) -> None:
        record = types.SimpleNamespace
        self.header, self.child_frame_id = record(), ""
        self.transform = record(translation=record(), rotation=record())


def test_one_node_of_ros_broadcasts_every_frame_in_one_message(tmp_path, monkeypatch):
    """The node runs against a record of what it asks of ROS; its launch file starts this node."""
    scene, setup = drawn(7, "panda")
    written(tmp_path, scene, setup, "ros2")
    sent, spun = [], []

    class Broadcaster:
        def __init__(self, node):
            assert isinstance(node, RosNode)

        def sendTransform(self, transforms):
            sent.append(transforms)

    ros = {
        "rclpy": {"init": lambda: None, "create_node": lambda _: RosNode(), "spin": spun.append},
        "geometry_msgs": {},
        "geometry_msgs.msg": {"TransformStamped": RosTransform},
        "tf2_ros": {"StaticTransformBroadcaster": Broadcaster},
    }
    for name, content in ros.items():
        module = types.ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    runpy.run_path(str(tmp_path / "static_transforms.py"), run_name="__main__")
    assert (len(sent), len(spun)) == (1, 1)
    listed = yaml.safe_load((tmp_path / "static_transforms.yaml").read_text())["transforms"]
    for message, one in zip(sent[0], listed, strict=True):
        there, turn = message.transform.translation, message.transform.rotation
        assert (message.header.frame_id, message.child_frame_id) == (one["parent"], one["child"])
        assert message.header.stamp == "now"
        assert [there.x, there.y, there.z] == one["xyz"]
        assert [turn.x, turn.y, turn.z, turn.w] == one["xyzw"]
    launch = yaml.safe_load((tmp_path / "static_transforms.launch.yaml").read_text())["launch"]
    (part,) = launch
    assert part["executable"]["cmd"] == "python3 $(dirname)/static_transforms.py"


@given(drawing.seeds, st.sampled_from("xyz"))
def test_frames_turned_round_are_right_handed_and_turn_back(seed, axis):
    scene, setup = drawn(seed, "ur10")
    T = np.stack([s.T_frame_sensor for s in sensor_frames(scene.robot, setup)])
    there = looking_along(T, axis)
    np.testing.assert_allclose(np.linalg.det(there[:, :3, :3]), 1, atol=1e-12)
    np.testing.assert_array_equal(there[:, :3, "xyz".index(axis)], T[:, :3, 2])
    np.testing.assert_array_equal(looking_along_z(there, axis), T)


def in_base(made: trimesh.Scene, name: str) -> trimesh.Trimesh:
    """The mesh of a node in the base frame."""
    T = np.linalg.inv(made.graph["base_link"][0]) @ made.graph[name][0]
    return made.geometry[name].copy().apply_transform(T)


def test_a_glb_has_all_that_is_there(tmp_path):
    """All points seen or not, robot and beams by their size."""
    scene, setup = drawn(11, "iiwa14")
    scene = replace(scene, targets=(Shell(0.5),), obstacles=(BOX, FLOOR))
    written(tmp_path, scene, setup, "glb", points=300)
    made = trimesh.load(io.BytesIO((tmp_path / "scene.glb").read_bytes()), file_type="glb")
    T_world_base = made.graph["base_link"][0]
    np.testing.assert_allclose(T_world_base[:3, :3] @ [0, 0, 1], [0, 1, 0], atol=1e-12)
    for i, ring in enumerate(setup.rings):
        seen = made.geometry[f"ring_{i}_sees"]
        assert seen.volume == pytest.approx(ring.count * ring.sensor.volume, rel=0.01)
        assert seen.visual.material.alphaMode == "BLEND"
    placed = PlacedSetup(scene, setup, 1, tmp_path)
    there = placed.bodies
    for b, a, c, r in zip(scene.robot.bodies, there.start, there.end, there.radius, strict=True):
        mesh = in_base(made, f"body_{b.name}")
        volume = math.pi * r**2 * (np.linalg.norm(c - a) + 4 / 3 * r)
        assert mesh.volume == pytest.approx(volume, rel=0.05)
        np.testing.assert_allclose(mesh.bounds.mean(axis=0), (a + c) / 2, atol=0.02 * r)
    shown = [g for name, g in made.geometry.items() if name.startswith("target_0")]
    assert sum(len(g.vertices) for g in shown) == 300
    assert "obstacle_0" in made.geometry


HOSTILE = (
    '"><evil/>',
    "${system('touch x')}",
    "$(eval 1)",
    "'; os.exit() --[[",
    "a\n- b: 1\x00",
    "é/../../x",
)


def hostile() -> tuple[Scene, Setup]:
    """A robot whose every name is meant to be taken for something else."""
    robot = ROBOTS["ur10"]
    chain = replace(robot.chain, joints=HOSTILE)
    bodies = tuple(replace(b, name=HOSTILE[i % 6]) for i, b in enumerate(robot.bodies))
    mounts = tuple(replace(m, link=HOSTILE[i]) for i, m in enumerate(robot.mounts))
    robot = replace(robot, name=HOSTILE[0] + HOSTILE[4], chain=chain, bodies=bodies, mounts=mounts)
    rings = tuple(Ring(m.link, 0.4, 3, 0.3) for m in mounts)
    return Scene.paper(robot=robot, obstacles=(replace(BOX, name=HOSTILE[1]),) * 2), Setup(rings)


def test_hostile_names_do_nothing(tmp_path):
    scene, setup = hostile()
    written(tmp_path, scene, setup, *(name for name in FORMATS if name != "stl"))
    sensor = effective(Use("vl53l4cd")).sensor
    printed = replace(setup.rings[0], sensor=sensor, radius=0.12, count=1)
    written(tmp_path, scene, Setup((printed,)), "stl")
    for file in ("robot.urdf", "sensors.xacro", "scene.xml"):
        root = ET.parse(tmp_path / file).getroot()
        assert root.find(".//evil") is None
        macro = file == "sensors.xacro"
        pairs = [(k, v) for e in root.iter() for k, v in e.attrib.items()]
        values = [v for k, v in pairs if not (macro and k in ("name", "link"))]
        values = [v for v in values if not v.startswith("prefix:=")]
        assert not any(bad in v for v in values for bad in ("$", "<", "'; os", "\n"))
        for _, v in pairs if macro else ():
            assert v.count("$") == v.count("${prefix}") + v.count("${link_of_")
    yourdfpy.URDF.load(str(tmp_path / "robot.urdf"), load_meshes=False)
    mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    for file in ("static_transforms.yaml", "static_transforms.launch.yaml", "sensors.lua"):
        text = (tmp_path / file).read_text().replace("$(dirname)", "")  # the launch file's own
        assert not any(bad in text for bad in ("os.exit", "$", "evil/>", "\x00"))
    assert len(yaml.safe_load((tmp_path / "static_transforms.yaml").read_text())["transforms"]) == 9
    for file in ("robot.urdf", "sensors.json", "sensors.csv"):
        same(scene, setup, resolve(str(tmp_path / file), scene)[0])


OWN = (
    '<link name="base"><visual><geometry><mesh filename="../meshes/a b.stl"/></geometry></visual>'
    "</link>"
)


def test_what_is_read_is_never_written_over(run, tmp_path):
    assert run("export", "n1_8_0", "--to", "json", "--out", "mine")[0] == 0
    (tmp_path / "mine" / "robot.urdf").write_text(chain_text(ROBOTS["ur10"].chain, "mine"))
    before = {path: path.read_bytes() for path in (tmp_path / "mine").iterdir()}
    for words in (
        ["mine/sensors.json", "--to", "json"],
        ["n1_8_0", "--to", "urdf", "--urdf", "mine/robot.urdf"],
    ):
        code, out, err = run("export", *words, "--out", tmp_path / "mine")
        assert (code, out) == (2, "")
        assert has_parts(err, "--out")
    assert before == {path: path.read_bytes() for path in (tmp_path / "mine").iterdir()}


def silent_links(file) -> set[str]:
    """The links of a URDF that state no mass: PyBullet gives each 1 kg (bulletphysics/bullet3,
    issue 3110), so that 86 sensors weighed 86 kg."""
    links = ET.parse(file).getroot().findall("link")
    return {e.attrib["name"] for e in links if e.find("inertial/mass") is None}


def stated_mass(file) -> float:
    """The sum of the masses that a URDF states, kg."""
    return sum(float(e.attrib["value"]) for e in ET.parse(file).getroot().iter("mass"))


@few
@given(drawing.seeds, st.sampled_from(ARMS), st.booleans())
def test_what_an_export_adds_to_a_robot_weighs_nothing_where_its_mass_is_unknown(
    tmp_path_factory, seed, name, own
):
    """In a program that weighs what states no mass, too: the robot's own links alone do."""
    scene, setup = drawn(seed, name)
    tool = Attached("gripper", "tcp", box((0.0, 0.0, 0.1), (0.05, 0.05, 0.1)))
    scene = replace(scene, robot=scene.robot.with_attached((tool,)), rules=Rules(mount="real"))
    folder, keys = tmp_path_factory.mktemp("weighed"), {}
    if own:
        text = chain_text(scene.robot.chain, "mine")
        (folder / "mine.urdf").write_text(text)
        keys["urdf"] = read_urdf(folder / "mine.urdf")
    written(folder, scene, setup, "urdf", **keys)
    robot = {e.attrib["name"] for e in ET.fromstring(text).iter("link")} if own else None
    placed = PlacedSetup(scene, setup, 1, folder, **keys)
    links = robot or {"base_link", *placed.link_names}
    assert silent_links(folder / "robot.urdf") == links
    known = sum(r.mass.mass for r in ring_bodies(placed) if r.mass is not None)
    assert stated_mass(folder / "robot.urdf") == pytest.approx(known)
    macro = ET.parse(folder / "sensors.xacro").getroot()[0]
    masses = [float(e.find("inertial/mass").attrib["value"]) for e in macro.findall("link")]
    assert masses == [0.0] * setup.sensors


def own_urdf(folder, extra: str = "") -> None:
    """A user's URDF beside a folder of meshes, with a comment, a tag of somebody else's, and a mesh
    by a relative name.
    """
    (folder / "meshes").mkdir()
    (folder / "urdf").mkdir()
    trimesh.creation.box((0.1, 0.1, 0.1)).export(folder / "meshes" / "a b.stl")
    text = chain_text(ROBOTS["panda"].chain, "mine").replace(
        '<link name="base" />', OWN + "<!-- mine -->" + extra
    )
    (folder / "urdf" / "mine.urdf").write_text(
        text.replace("</robot>", "<gazebo reference='base'/></robot>")
    )


def test_a_users_own_urdf_keeps_what_it_has_and_gets_the_sensors(tmp_path):
    own_urdf(tmp_path)
    scene, setup = drawn(3, "panda")
    setup = Setup(tuple(replace(r, sensor=scene.sensor) for r in setup.rings))
    urdf, out = read_urdf(tmp_path / "urdf" / "mine.urdf"), tmp_path / "deep" / "out"
    out.mkdir(parents=True)
    written(out, scene, setup, "urdf", "ros2", "glb", urdf=urdf, packages=(tmp_path / "meshes",))
    text = (out / "robot.urdf").read_text()
    assert "<!-- mine -->" in text
    assert "gazebo" in text
    assert 'filename="../../meshes/a b.stl"' in text
    peer = yourdfpy.URDF.load(str(out / "robot.urdf"))
    q = scene.poses[1].q
    peer.update_cfg(dict(zip(scene.robot.chain.joints, q, strict=True)))
    frames = forward(scene.robot.chain, q)
    for s in sensor_frames(scene.robot, setup):
        T = looking_along(frames[s.frame] @ s.T_frame_sensor, "x")
        np.testing.assert_allclose(peer.get_transform(s.name, "base"), T, atol=CLOSE)
    same(scene, setup, resolve(str(out / "robot.urdf"), scene)[0])
    listed = yaml.safe_load((out / "static_transforms.yaml").read_text())["transforms"]
    assert {t["parent"] for t in listed} <= set(urdf.links)
    assert "body_base" in trimesh.load(out / "scene.glb").geometry
    with refused('robot.urdf link "tof_0_0"'):
        written(out, scene, setup, "urdf", urdf=read_urdf(out / "robot.urdf"))
    with refused('joint "shoulder_pan"'):
        written(out, Scene.paper(), named_setup("n1_3_0"), "urdf", urdf=urdf)


@given(drawing.seeds, st.sampled_from("xyz"))
@few
def test_frames_of_any_names_in_any_order_are_rings(tmp_path_factory, seed, beam):
    """A URDF of somebody else's: other names, an order of its own, another axis along the beam."""
    rng, folder = np.random.default_rng(seed), tmp_path_factory.mktemp("any")
    scene, setup = Scene.paper(poses=(Pose(drawing.pose(rng)),)), named_setup("n2_5_25")
    setup = Setup(tuple(replace(r, phase=float(rng.uniform(0, 6))) for r in setup.rings))
    root = ET.fromstring(chain_text(scene.robot.chain))
    found = sensor_frames(scene.robot, setup)
    for n in rng.permutation(len(found)):
        s = found[n]
        ET.SubElement(root, "link", name=f"range sensor {n}")
        parent, T = "tip" if s.frame == 6 else f"link_{s.frame}", s.T_frame_sensor
        joint(root, f"j {n}", "fixed", parent, f"range sensor {n}", looking_along(T, beam))
    (folder / "mounted.urdf").write_text(ET.tostring(root, encoding="unicode"))
    pattern = FramePattern(r"range sensor \d+", beam)
    again = resolve(str(folder / "mounted.urdf"), scene, None, pattern)[0]
    one, other = (sensor_cones(scene.robot, s, scene.poses[0].q) for s in (setup, again))
    order = [np.lexsort(np.round(np.hstack([c.apex, c.axis]), 5).T) for c in (one, other)]
    np.testing.assert_allclose(other.apex[order[1]], one.apex[order[0]], atol=CLOSE)
    np.testing.assert_allclose(other.axis[order[1]], one.axis[order[0]], atol=CLOSE)


STUB = """
local made = {}
sim = {handle_world = -1, proximitysensor_cone = 'cone', proximitysensor_pyramid = 'pyramid'}
local function new(kind) made[#made + 1] = {kind = kind, pose = {}, sizes = {}} return #made end
function sim.getObject(path, options) assert(options.noError) return path == '/wrist_3_link' and \
new('there') or -1 end
function sim.createDummy(size) return new('dummy') end
function sim.createProximitySensor(kind, what, options, ints, floats)
    assert(#ints == 8 and #floats == 15 and what == 16 and options == 0)
    local h = new(kind) made[h].sizes = floats return h
end
function sim.setObjectAlias(h, name) made[h].name = name end
function sim.setObjectParent(h, parent, keep) assert(keep == false) made[h].parent = parent end
function sim.setObjectPose(h, pose, to) assert(to == -1 or to == made[h].parent) made[h].pose = \
pose end
dofile(arg[1])
for h, o in ipairs(made) do
    print(table.concat({o.kind, o.name or '-', o.parent or 0, table.concat(o.pose, ' '), \
table.concat(o.sizes, ' ')}, '|'))
end
"""


def lua_objects(folder) -> list[list[str]]:
    """What the script for CoppeliaSim makes, run by Lua, where that is installed, against a record
    of what it asks of the simulator: kind, name, parent, pose and sizes of each object."""
    lua = next((path for name in ("lua5.4", "lua5.3", "lua") if (path := shutil.which(name))), None)
    if lua is None:
        pytest.skip("no Lua here")
    (folder / "stub.lua").write_text(STUB)
    command = [lua, str(folder / "stub.lua"), str(folder / "sensors.lua")]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    return [line.split("|") for line in lines]


def test_the_script_for_coppeliasim_makes_these_sensors(tmp_path):
    square = Ring("tool", 0, 3, 0.1, sensor=Sensor(0.5, 1.2, None, 0.3))
    scene, setup = Scene.paper(), Setup((*named_setup("n1_4_25").rings[:2], square))
    written(tmp_path, scene, setup, "coppeliasim")
    made = lua_objects(tmp_path)
    frames, found = forward(scene.robot.chain, scene.poses[0].q), sensor_frames(scene.robot, setup)
    dummies = [["dummy", "shoulder_lift_link"], ["dummy", "elbow_link"], ["there", "-"]]
    assert [m[:2] for m in made[:3]] == dummies
    for (_, _, _, pose, _), j in zip(made[:2], (1, 2), strict=True):
        same_pose(np.fromstring(pose, sep=" "), frames[j])
    assert len(made) == 3 + len(found)
    for (kind, name, parent, pose, sizes), s in zip(made[3:], found, strict=True):
        T = s.T_frame_sensor if s.frame < 6 else scene.robot.chain.origin[-1] @ s.T_frame_sensor
        assert (name, parent) == (s.name, str(s.ring + 1))
        same_pose(np.fromstring(pose, sep=" "), T)
        size = np.fromstring(sizes, sep=" ")
        assert size[1] == pytest.approx(s.unit.range_m)
        if s.unit.fov_up is None:
            assert (kind, size[9]) == ("cone", pytest.approx(s.unit.fov))
        else:
            sides = [2 * 1.2 * math.tan(a / 2) for a in (0.5, 0.3)]
            assert (kind, size[4:6].tolist()) == ("pyramid", pytest.approx(sides))


def same_pose(pose: np.ndarray, T: np.ndarray) -> None:
    np.testing.assert_allclose(pose[:3], T[:3, 3], atol=CLOSE)
    R = np.stack([turned(pose[3:], v) for v in np.eye(3)], axis=1)
    np.testing.assert_allclose(R, T[:3, :3], atol=CLOSE)


def test_a_users_link_with_an_odd_name_is_no_default_of_the_macro_and_refused_for_ros(tmp_path):
    text = chain_text(ROBOTS["ur10"].chain).replace('"link_1"', '"$(eval 1)"')
    (tmp_path / "odd.urdf").write_text(text)
    urdf = read_urdf(tmp_path / "odd.urdf")
    placed = PlacedSetup(Scene.paper(), named_setup("n1_3_0"), 0, tmp_path, urdf)
    macro = ET.fromstring(FORMATS["urdf"](placed)["sensors.xacro"])[0]
    given = "prefix:='' link_of_shoulder_lift link_of_elbow:=link_2 link_of_wrist_3:=link_5"
    assert macro.attrib["params"] == given
    with refused('odd.urdf link "$(eval 1)"'):
        FORMATS["ros2"](placed)


OF_ONE_FORMAT = {"readings": True, "scheduled": True, "points": 9, "board": "pico"}


@pytest.mark.parametrize(("option", "value"), OF_ONE_FORMAT.items())
def test_an_option_that_no_chosen_format_has_is_refused(tmp_path, option, value):
    with pytest.raises(pr.InputError) as error:
        pr.export("n1_4_0", to=("csv", "json"), folder=tmp_path / "out", **{option: value})
    assert error.value.argument == option
    assert not (tmp_path / "out").exists()


def test_arguments_of_a_xacro_file_without_one_are_refused(tmp_path):
    with pytest.raises(pr.InputError) as error:
        pr.export("n1_4_0", to="csv", folder=tmp_path / "out", xacro_args={"name": "ur10"})
    assert error.value.argument == "xacro_args"
    assert not (tmp_path / "out").exists()
