"""Arms with grippers, pistons, rails and second arms: drawn URDFs load as their arm alone, with the
rest as bodies at stated joint values, and what is refused names an option that loads it.
"""

import re
import shlex
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import place_rings as pr
import pytest
import trimesh
from hypothesis import given, settings
from place_rings.cli.options.reading import ReadingOptions
from place_rings.coverage.robots.kinematics import forward, transform
from place_rings.coverage.robots.robot import BASE
from place_rings.formats.loader import read_robot
from place_rings.formats.robots.meshes import Meshes
from place_rings.formats.robots.urdf import read_urdf
from place_rings.formats.robots.urdf_chain import pick_chain
from place_rings.formats.robots.urdf_matching import find_robot
from place_rings.formats.robots.urdf_model import UrdfShape
from place_rings.formats.robots.urdf_options import UrdfOptions
from place_rings.viewer.triangle_meshes import read_skin

from ..support import drawing
from ..support.refusals import has_parts, refused
from ..support.urdf_text import Peer, joint

Z = (0.0, 0.0, 1.0)


def link(robot, name, shape=None):
    element = ET.SubElement(robot, "link", name=name)
    if shape is not None:
        geometry = ET.SubElement(ET.SubElement(element, "collision"), "geometry")
        geometry.append(ET.fromstring(shape))


def pose(rng, most=0.4):
    return transform(rng.uniform(0.05, most, 3), rng.uniform(-3, 3, 3))


def arm(robot, rng, base, joints, prefix="", kinds=None):
    """A serial arm below ``base``; the name of its last link."""
    for j in range(joints):
        child, kind = f"{prefix}link{j}", (kinds or {}).get(j, "revolute")
        link(robot, child)
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        joint(robot, f"{prefix}joint{j}", kind, base, child, pose(rng), axis, (-2.5, 2.5))
        base = child
    return base


def mimic(robot, name, of, multiplier=1.0, offset=0.0):
    element = next(e for e in robot.findall("joint") if e.get("name") == name)
    ET.SubElement(
        element, "mimic", joint=of, multiplier=f"{multiplier:.17g}", offset=f"{offset:.17g}"
    )


def parallel(robot, rng, palm):
    """Two fingers that slide, one of them as the other."""
    for i in (0, 1):
        link(robot, f"pad{i}", "<box size='0.02 0.02 0.05'/>")
        joint(robot, f"slide{i}", "prismatic", palm, f"pad{i}", pose(rng), Z, (0.01, 0.04))
    mimic(robot, "slide1", "slide0", 0.5, 0.002)


def named(robot, rng, palm):
    """Fingers of different lengths, known by their names."""
    for i in range(3):
        base = palm
        for k in range(1 + i % 2):
            link(robot, f"f{i}{k}")
            joint(robot, f"Finger_{i}_{k}", "revolute", base, f"f{i}{k}", pose(rng), Z, (0.2, 1))
            base = f"f{i}{k}"


def nameless(robot, rng, palm):
    """Equal branches, as of a hand."""
    for i in range(2):
        base = palm
        for k in range(2):
            link(robot, f"h{i}{k}")
            joint(robot, f"h{i}{k}", "revolute", base, f"h{i}{k}", pose(rng), Z, (-1, 1))
            base = f"h{i}{k}"


def piston(robot, rng, palm):
    """One part that slides."""
    link(robot, "rod")
    joint(robot, "rod", "prismatic", palm, "rod", pose(rng), Z, (-0.2, -0.1))


GRIPPERS = (parallel, named, nameless, piston)


def written(folder, robot, name="drawn.urdf"):
    path = folder / name
    path.write_text(ET.tostring(robot, encoding="unicode"))
    return path


def drawn_arm(rng, gripper):
    """An arm of three to seven joints with a gripper at its end."""
    robot, joints = ET.Element("robot", name="drawn"), int(rng.integers(3, 8))
    link(robot, "base")
    last = arm(robot, rng, "base", joints)
    link(robot, "palm")
    joint(robot, "to_palm", "fixed", last, "palm", pose(rng))
    gripper(robot, rng, "palm")
    return robot, joints


def checked(picked, text, q):
    """Every link stands where MuJoCo puts it, the chain at ``q`` and the rest as stated."""
    peer, frames = Peer(text), forward(picked.chain, q)
    values = dict(zip(picked.chain.joints, q, strict=True))
    values |= {h.joint: h.value for h in picked.held}
    for carried in picked.carried:
        T = np.eye(4) if carried.frame == BASE else frames[carried.frame]
        expected = peer.pose(values, carried.link.name, picked.base)
        assert np.abs(T @ carried.T_frame_link - expected).max() < 1e-9
    expected = peer.pose(values, picked.tip, picked.base)
    assert np.abs(frames[-1] - expected).max() < 1e-9


@pytest.mark.parametrize("gripper", GRIPPERS)
@settings(max_examples=10)
@given(seed=drawing.seeds)
def test_a_chain_ends_before_its_gripper_which_stays_as_a_body(tmp_path_factory, gripper, seed):
    rng = np.random.default_rng(seed)
    robot, joints = drawn_arm(rng, gripper)
    path = written(tmp_path_factory.mktemp("arm"), robot)
    picked = pick_chain(read_urdf(path))
    assert picked.chain.joints == tuple(f"joint{j}" for j in range(joints))
    assert picked.tip == "palm"
    assert {c.link.name for c in picked.carried} == set(picked.urdf.links)
    assert {c.link.name for c in picked.carried if c.beside} == {
        e.get("name") for e in robot.findall("link")
    } - {"base", "palm", *(f"link{j}" for j in range(joints))}
    assert all(h.joint not in picked.chain.joints for h in picked.held)
    assert len(picked.held) + joints == len([j for j in picked.urdf.joints.values() if j.moves])
    checked(picked, path.read_text(), rng.uniform(-2, 2, joints))
    hold = {h.joint: h.value for h in picked.held if rng.uniform() < 0.7}
    same = pick_chain(picked.urdf, hold=hold)
    assert (same.tip, same.chain.joints) == (picked.tip, picked.chain.joints)


@settings(max_examples=20)
@given(drawing.seeds)
def test_a_held_joint_is_a_fixed_transform_and_others_follow_it(tmp_path_factory, seed):
    """Whatever is held, every link stands where it does with that value of the joint, and a joint
    that mimics a held one stands at its multiple."""
    rng = np.random.default_rng(seed)
    robot, joints = drawn_arm(rng, parallel)
    which = rng.choice(joints, int(rng.integers(1, joints)), replace=False)
    for j in which:
        if rng.uniform() < 0.5:
            robot.find(f"joint[@name='joint{j}']").set("type", "prismatic")
    hold = {f"joint{j}": float(rng.uniform(-1, 1)) for j in which} | {"slide0": 0.03}
    path = written(tmp_path_factory.mktemp("held"), robot)
    picked = pick_chain(read_urdf(path), "base", "palm", hold)
    assert set(picked.chain.joints) == {f"joint{j}" for j in range(joints)} - set(hold)
    assert {h.joint: h.value for h in picked.held} == pytest.approx(hold | {"slide1": 0.017})
    checked(picked, path.read_text(), rng.uniform(-2, 2, joints - len(which)))


@settings(max_examples=10)
@given(drawing.seeds)
def test_a_chain_can_begin_above_the_root_with_the_rest_as_bodies(tmp_path_factory, seed):
    rng = np.random.default_rng(seed)
    robot, joints = drawn_arm(rng, named)
    path = written(tmp_path_factory.mktemp("part"), robot)
    picked = pick_chain(read_urdf(path), "link0", hold={"joint0": 0.7})
    assert picked.chain.joints == tuple(f"joint{j}" for j in range(1, joints))
    base = next(c for c in picked.carried if c.link.name == "base")
    assert base.beside
    assert base.frame == BASE
    checked(picked, path.read_text(), rng.uniform(-2, 2, joints - 1))


def options_of(line):
    """The choices that a refusal names, each as the options of a command."""
    line = line.partition("; --skip-missing-meshes")[0]  # which leaves a mesh out
    first = re.search(r"--(tip|base|hold|package|packages) .*", line)
    assert first is not None, line
    for choice in first[0].split(", or "):
        each = {}
        for option, value in zip(*[iter(shlex.split(choice))] * 2, strict=True):
            key = option.removeprefix("--")
            each[key] = value if key in ("tip", "base") else (*each.get(key, ()), value)
        yield ReadingOptions(**each).resolve()


@settings(max_examples=15)
@given(drawing.seeds)
def test_two_arms_are_a_choice_and_every_choice_loads(tmp_path_factory, seed):
    """With a lift below both, too, or a mobile base; the other arm is a body that moves with no
    joint of the chosen one."""
    rng = np.random.default_rng(seed)
    robot, joints = ET.Element("robot", name="two"), int(rng.integers(2, 6))
    link(robot, "base")
    torso = "base"
    lift = rng.uniform() < 0.5
    if lift:
        link(robot, "torso")
        joint(robot, "lift", "prismatic", "base", "torso", pose(rng), Z, (0.1, 0.4))
        torso = "torso"
    for side in ("left_", "right_"):
        last = arm(robot, rng, torso, joints, side)
        link(robot, f"{side}tool0")
        joint(robot, f"{side}end", "fixed", last, f"{side}tool0", pose(rng))
    path = written(tmp_path_factory.mktemp("two"), robot)
    urdf = read_urdf(path)
    with refused("--tip left_tool0 --tip right_tool0") as told:
        pick_chain(urdf)
    choices = list(options_of(str(told.value)))
    assert [c.tip for c in choices] == ["left_tool0", "right_tool0"]
    for choice, other in zip(choices, ("right_", "left_"), strict=True):
        picked = choice.pick(urdf)
        assert len(picked.chain) == joints + lift
        assert picked.chain.prismatic == ((0,) if lift else ())
        assert {h.joint for h in picked.held} == {f"{other}joint{j}" for j in range(joints)}
        frames = {c.frame for c in picked.carried if c.link.name.startswith(other)}
        assert frames == {0 if lift else BASE}
        checked(picked, path.read_text(), rng.uniform(-2, 2, joints + lift))


@settings(max_examples=15)
@given(drawing.seeds)
def test_a_sliding_joint_loads_and_so_does_one_that_mimics_a_joint_of_the_chain(
    tmp_path_factory, seed
):
    rng = np.random.default_rng(seed)
    robot, joints = ET.Element("robot", name="rail"), int(rng.integers(3, 7))
    link(robot, "base")
    slides = rng.choice(joints - 1, int(rng.integers(1, joints - 1)), replace=False)
    last = arm(robot, rng, "base", joints, kinds=dict.fromkeys(slides, "prismatic"))
    assert last
    path = written(tmp_path_factory.mktemp("rail"), robot)
    picked = pick_chain(read_urdf(path))
    assert picked.chain.prismatic == tuple(sorted(slides.tolist()))
    checked(picked, path.read_text(), rng.uniform(-2, 2, joints))
    turns = min(set(range(joints)) - set(slides))
    leader = f"joint{turns}"
    for j in slides:  # one after the other, the last straight
        mimic(robot, f"joint{j}", leader, 0.5, 0.1)
        leader = f"joint{j}"
    path = written(tmp_path_factory.mktemp("rail"), robot)
    picked = pick_chain(read_urdf(path), tip=last)
    assert len(picked.chain) == joints
    q = rng.uniform(-2, 2, joints)
    along = q[turns]
    right = q.copy()
    for j in slides:
        right[j] = along = 0.5 * along + 0.1
    checked(picked, path.read_text(), right)
    # what stands in the place of a mimic joint does not matter, and is put right
    np.testing.assert_allclose(forward(picked.chain, q), forward(picked.chain, right), atol=1e-12)
    np.testing.assert_allclose(picked.chain.settled(q), right, atol=1e-12)
    low, high = picked.limits[turns]
    assert all(
        -2.5 - 1e-9 <= value <= 2.5 + 1e-9
        for end in (low, high)
        for value in picked.chain.settled(np.full(joints, end))[[turns, *slides]]
    )


def test_a_mimic_of_a_joint_that_is_held_stands_and_of_one_beside_the_chain_names_what_loads_it(
    tmp_path,
):
    rng = np.random.default_rng(4)
    robot = ET.Element("robot", name="piston")
    link(robot, "base")
    last = arm(robot, rng, "base", 5)
    link(robot, "crank")
    joint(robot, "crank", "revolute", "base", "crank", pose(rng), Z, (-2, 2))
    mimic(robot, "joint2", "crank", 0.5, 0.1)
    path = written(tmp_path, robot)
    with refused('joint "joint2" mimic "crank"') as told:
        pick_chain(read_urdf(path), tip=last)
    (choice,) = options_of(str(told.value))
    picked = replace(choice, tip=last).pick(read_urdf(path))
    checked(picked, path.read_text(), rng.uniform(-2, 2, 4))
    picked = pick_chain(read_urdf(path), tip=last, hold={"crank": 0.4})
    assert {h.joint: h.value for h in picked.held} == {"joint2": 0.5 * 0.4 + 0.1, "crank": 0.4}
    checked(picked, path.read_text(), rng.uniform(-2, 2, 4))


def test_the_tip_is_a_tool_frame_and_no_sensor_and_the_choice_is_told(tmp_path):
    rng = np.random.default_rng(0)
    for names, best in (
        (("camera_link", "flange", "tool0"), "tool0"),
        (("ee_link", "my_tcp", "camera_optical_frame"), "my_tcp"),
        (("arm_link8", "arm_link7_sc"), "arm_link8"),
        (("r_tool0", "finger_mount"), "r_tool0"),
    ):
        robot = ET.Element("robot", name="tips")
        link(robot, "base")
        last = arm(robot, rng, "base", 3)
        for name in names:
            link(robot, name)
            joint(robot, f"to_{name}", "fixed", last, name, pose(rng))
        picked = pick_chain(read_urdf(written(tmp_path, robot)))
        assert picked.tip == best
        assert any(best in note for note in picked.notes)


def test_a_wrist_that_carries_the_gripper_is_a_joint_of_the_arm(tmp_path):
    """Only the name of the joint tells a gripper, where the link is the gripper as a whole."""
    rng = np.random.default_rng(1)
    robot = ET.Element("robot", name="wrist")
    link(robot, "base")
    last = arm(robot, rng, "base", 3)
    link(robot, "gripper_link")
    joint(robot, "wrist", "revolute", last, "gripper_link", pose(rng), Z, (-2, 2))
    link(robot, "gripper_bar")
    joint(robot, "gripper", "continuous", "gripper_link", "gripper_bar", pose(rng), Z)
    parallel(robot, rng, "gripper_link")
    picked = pick_chain(read_urdf(written(tmp_path, robot)))
    assert picked.chain.joints == ("joint0", "joint1", "joint2", "wrist")


ODD = """<robot name="odd"><link name="base"><collision><geometry><box size="0 0 0"/></geometry>
</collision><visual><geometry><sphere radius="0"/></geometry></visual></link>
<link name="arm"><collision><geometry><cylinder radius="0.04" length="0.4"/></geometry></collision>
<visual><geometry><cylinder radius="0.04" length="0"/></geometry></visual></link>
<joint name="turn" type="revolute"><parent link="world"/><child link="base"/><origin xyz="0 0 1"/>
<axis xyz="0 0 1"/>{limit}</joint>
<joint name="bend" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 0.5"/>
<axis xyz="0 1 0"/><limit lower="-6.2831" upper="6.2832"/></joint>
<gazebo reference="arm"><sensor:camera name="rgb"/></gazebo></robot>"""


def test_odd_limits_and_empty_shapes_are_taken_with_one_note_each(tmp_path):
    """So are prefixes without a declaration, and a parent that has no element."""
    path = tmp_path / "odd.urdf"
    limits = ["", "<limit effort='1' velocity='1'/>", "<limit lower='1' upper='-1'/>"]
    limits += [f"<limit lower='-{v}' upper='{v}'/>" for v in ("7.85", "1e16", "inf")]
    for limit in limits:
        path.write_text(ODD.format(limit=limit))
        picked = pick_chain(read_urdf(path))
        assert picked.chain.joints == ("turn", "bend")
        assert picked.base == "world"
        assert np.isinf(picked.limits[0]).all()
        assert np.allclose(picked.limits[1], [-2 * np.pi, 2 * np.pi], atol=1e-3)
        shapes, links, limitless = picked.urdf.notes
        assert has_parts(shapes, "base, arm")
        assert has_parts(links, "world")
        assert has_parts(limitless, "turn")
        assert picked.urdf.links["base"].collision == ()
    # exporters write a header alone for an empty part, which is no body
    (tmp_path / "none.stl").write_bytes(bytes(84))
    empty = ODD.replace('<box size="0 0 0"/>', '<mesh filename="none.stl"/>')
    path.write_text(empty.format(limit=""))
    assert {b.name for b in UrdfOptions().fit(path).robot.bodies} == {"arm"}


def box(path):
    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh.creation.box((0.1, 0.1, 0.3)).export(path)
    return path.resolve()


@pytest.fixture
def cell(tmp_path):
    """A package with a URDF, another beside it with a package.xml of another name."""
    (tmp_path / "arm_support" / "urdf").mkdir(parents=True)
    box(tmp_path / "arm_support" / "meshes" / "a.stl")
    box(tmp_path / "arm_support" / "meshes" / "b.stl")
    other = tmp_path / "ws" / "src" / "checkout-1.2"
    box(other / "meshes" / "hand.stl")
    (other / "package.xml").write_text("<package><name>hand_description</name></package>")
    return tmp_path


def test_meshes_of_the_urdfs_own_package_need_no_option(cell):
    path = cell / "arm_support" / "urdf" / "arm.urdf"
    wanted = cell / "arm_support" / "meshes" / "a.stl"
    for name in ("package://arm_support/meshes/a.stl", "package://meshes/a.stl", "../meshes/a.stl"):
        assert Meshes(path).find(name, "l") == wanted
    deep = cell / "arm_support" / "deep" / "model" / "arm.urdf"
    assert Meshes(deep).find("package://arm_support/meshes/a.stl", "l") == wanted
    with refused("outside"):
        Meshes(deep).find("../../meshes/a.stl", "l")
    (cell / "arm_support" / "package.xml").write_text("<package/>")
    assert Meshes(deep).find("../../meshes/a.stl", "l") == wanted


def test_a_package_of_another_name_is_taken_only_if_all_files_fit(cell):
    path = cell / "arm_support" / "urdf" / "arm.urdf"
    names = [f"package://renamed/meshes/{n}.stl" for n in "ab"]
    meshes = Meshes(path, addresses=names)
    assert [meshes.find(n, "l").name for n in names] == ["a.stl", "b.stl"]
    (note,) = meshes.packages.notes
    assert str(cell / "arm_support") in note
    odd = [*names, "package://gripper/meshes/c.stl"]
    with refused("--package renamed="):
        Meshes(path, addresses=odd).find(names[0], "l")
    box(cell / "arm_support" / "copy" / "meshes" / "a.stl")
    box(cell / "arm_support" / "copy" / "meshes" / "b.stl")
    with refused("--package renamed=") as told:
        Meshes(path, addresses=names).find(names[0], "l")
    for choice in options_of(str(told.value)):
        found = Meshes(path, choice.packages, choice.package, names).find(names[0], "l")
        assert found.name == "a.stl"


def test_packages_are_found_by_their_package_xml_or_by_name(cell):
    """With --packages or --package in place, a refusal says where it looked, and never advises an
    option that is given."""
    path = cell / "arm_support" / "urdf" / "arm.urdf"
    name, hand = "package://hand_description/meshes/hand.stl", cell / "ws" / "src" / "checkout-1.2"
    none, named = name.replace("hand.stl", "none.stl"), {"hand_description": hand}
    assert Meshes(path, [cell / "ws"]).find(name, "l") == hand / "meshes" / "hand.stl"
    assert Meshes(path, named=named).find(name, "l") == hand / "meshes" / "hand.stl"
    for lost in (name, none):
        with refused("--packages --package hand_description=FOLDER"):
            Meshes(path).find(lost, "l")
    with refused("ws") as told:
        Meshes(path, [cell / "ws"]).find(none, "l")
    assert "--packages" not in str(told.value)
    with refused("checkout-1.2") as told:
        Meshes(path, named=named).find(none, "l")
    assert "--package hand_description" not in str(told.value)
    with refused("--package"):
        Meshes(path, named={"x": cell / "nowhere"})
    with refused("outside"):  # a name leads nowhere else
        Meshes(path, named=named).find("package://hand_description/../../../arm_support/x.stl", "l")


def test_a_package_beside_the_urdfs_is_named_in_the_refusal(cell):
    path = cell / "arm_support" / "urdf" / "arm.urdf"
    wanted = box(cell / "hand_support" / "meshes" / "h.stl")
    with refused("--package hand_support=") as told:
        Meshes(path).find("package://hand_support/meshes/h.stl", "l")
    (choice,) = options_of(str(told.value))
    found = Meshes(path, choice.packages, choice.package)
    assert found.find("package://hand_support/meshes/h.stl", "l") == wanted


GRIPPED = """<robot name="gripped">
<link name="base"/>
<link name="lift"><collision><geometry><box size="0.1 0.1 0.4"/></geometry></collision></link>
<link name="upper"><collision><origin xyz="0 0 0.2"/><geometry><cylinder radius="0.05"
length="0.4"/></geometry></collision></link>
<link name="fore"><collision><origin xyz="0 0 0.15"/><geometry><cylinder radius="0.04"
length="0.3"/></geometry></collision></link>
<link name="tool0"/>
<link name="pad"><collision><geometry><box size="0.02 0.02 0.06"/></geometry></collision></link>
<joint name="raise" type="prismatic"><parent link="base"/><child link="lift"/><axis xyz="0 0 1"/>
<limit lower="0.1" upper="0.5"/></joint>
<joint name="turn" type="revolute"><parent link="lift"/><child link="upper"/><axis xyz="0 1 0"/>
<origin xyz="0 0 0.2"/><limit lower="-2" upper="2"/></joint>
<joint name="bend" type="revolute"><parent link="upper"/><child link="fore"/><axis xyz="0 1 0"/>
<origin xyz="0 0 0.4"/><limit lower="-2" upper="2"/></joint>
<joint name="end" type="fixed"><parent link="fore"/><child link="tool0"/><origin xyz="0 0 0.3"/>
</joint>
<joint name="finger" type="revolute"><parent link="tool0"/><child link="pad"/><axis xyz="1 0 0"/>
<origin xyz="0 0 0.05"/><limit lower="0" upper="1"/></joint></robot>"""


def test_every_command_takes_the_options_and_the_robots_file_states_them(run, tmp_path):
    path = tmp_path / "gripped.urdf"
    path.write_text(GRIPPED)
    code, _, err = run(
        *("robot", path, "--hold", "raise=0.3", "--hold", "finger=30", "--out", tmp_path / "made")
    )
    assert code == 0
    assert "raise=0.3, finger=30" in err
    robot = read_robot(tmp_path / "made" / "robot.toml")
    values = {h.joint: (h.value, h.slides) for h in robot.held}
    assert values == {"raise": (0.3, True), "finger": (pytest.approx(np.radians(30)), False)}
    assert 'joint = "raise", m = 0.3' in (tmp_path / "made" / "robot.toml").read_text()
    for command in (("cones", "n1_3_0"), ("view", "n1_3_0"), ("verify", "n1_3_0")):
        code, _, err = run(*command, "--robot", "ur10", "--hold", "raise=0.3")
        assert code == 2
        assert "--hold" in err
    wrong = {
        "raise": "NAME=VALUE",
        "raise=x": "NAME=VALUE",
        "no=1": '"no"',
        "raise=0.6": "0.1 0.5 m",
        "finger=90": "0 57.2958 degrees",
    }
    for bad, parts in wrong.items():
        code, _, err = run("robot", path, "--hold", bad)
        assert code == 2
        assert has_parts(err, f"--hold {parts}"), err


def test_python_takes_radians_and_reads_the_same_robot(tmp_path):
    path = tmp_path / "gripped.urdf"
    path.write_text(GRIPPED)
    robot = pr.load(path, hold={"raise": 0.3, "finger": 0.5})
    urdf = read_urdf(path)
    same = pick_chain(urdf, hold={"raise": 0.3, "finger": 0.5})
    assert {h.joint: h.value for h in robot.held} == {h.joint: h.value for h in same.held}
    assert np.array_equal(robot.chain.origin, same.chain.origin)
    assert robot.chain.joints == ("turn", "bend")
    with refused("URDF", error=pr.InputError):
        pr.load(pr.save(robot, tmp_path / "robot.toml"), tip="tool0")
    kept = pr.load(tmp_path / "robot.toml")
    assert {h.joint: h.value for h in kept.held} == pytest.approx({"raise": 0.3, "finger": 0.5})
    assert find_robot(urdf, kept).chain.joints == robot.chain.joints
    skin = read_skin(path, UrdfOptions(), kept)
    high = skin.at(np.zeros(2))[0].max(axis=0)
    assert high[2] == pytest.approx(0.3 + 0.2 + 0.4 + 0.3 + 0.05 + 0.03, abs=0.02)


DAE = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"
version="1.4.1"><asset>{unit}<up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g">
<mesh><source id="p"><float_array id="a" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array>
<technique_common><accessor source="#a" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="4">
<input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 0 1 3 0 2 3 1 2 3</p></triangles></mesh>
</geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


@pytest.mark.parametrize(
    ("unit", "metres"),
    [("", 1.0), ("<unit meter='0.0254' name='inch'/>", 0.0254), ("<unit meter='1'/>", 1.0)],
)
def test_a_collada_mesh_has_its_own_unit(tmp_path, unit, metres):
    """As in other readers; it is beside the scale of the URDF."""
    (tmp_path / "a.dae").write_text(DAE.format(unit=unit))
    shape = UrdfShape("mesh", np.eye(4), (1.0, 2.0, 1.0), "a.dae")
    made = Meshes(tmp_path / "r.urdf").shape(shape, "l")
    assert np.allclose(made.reshape(-1, 3).max(axis=0), np.array([1, 2, 1]) * metres)
    (tmp_path / "a.dae").write_text(DAE.format(unit="<unit meter='-1'/>"))
    with refused('meter="-1"'):
        Meshes(tmp_path / "r.urdf").shape(shape, "l")
