"""Joints that follow another joint of the chain: in files, poses, exports and the search's scene;
and URDFs whose arms share a root, or that have wheels only."""

import math
import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest
import yourdfpy
from place_rings.cli.options.reading import ReadingOptions
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.robots.joint_values import named, ordered
from place_rings.coverage.robots.kinematics import forward
from place_rings.formats.loader import read_robot, read_scene
from place_rings.formats.robots.robot_fit import fit_robot
from place_rings.formats.robots.urdf import read_urdf
from place_rings.formats.robots.urdf_chain import pick_chain
from place_rings.formats.schema.versions import RobotFile
from place_rings.formats.writing import to_toml
from place_rings.objectives.scene import Pose, Scene

from ..support.refusals import refused
from .test_exports import written as exported
from .test_urdf_arms import arm, joint, link, mimic, options_of, pose, written

Z = (0.0, 0.0, 1.0)


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    """An arm of five joints whose third follows the second."""
    rng = np.random.default_rng(3)
    root = ET.Element("robot", name="parallel")
    link(root, "base", '<cylinder radius="0.1" length="0.3"/>')
    arm(root, rng, "base", 5)
    geometry = ET.SubElement(ET.SubElement(root.findall("link")[2], "collision"), "geometry")
    geometry.append(ET.fromstring('<cylinder radius="0.05" length="0.2"/>'))
    mimic(root, "joint2", "joint1", -1.0, 0.2)
    options = ReadingOptions().resolve()
    picked = options.pick(read_urdf(written(tmp_path_factory.mktemp("parallel"), root)))
    return fit_robot(picked, options.meshes(picked.urdf), "parallel", 1).robot


def test_a_robot_file_keeps_what_follows(robot, tmp_path):
    (follows,) = robot.chain.mimics
    assert (follows.joint, follows.leader) == (2, 1)
    file = tmp_path / "robot.toml"
    text = to_toml(robot, file=RobotFile)
    file.write_text(text)
    again = read_robot(file)
    assert again.chain.mimics == robot.chain.mimics
    assert again.rest[2] == pytest.approx(-again.rest[1] + 0.2)
    for wrong in ("joint2", "joint9"):
        file.write_text(text.replace('joint = "joint1"', f'joint = "{wrong}"', 1))
        with refused(f'robot.toml joints[2].mimic.joint "{wrong}"'):
            read_robot(file)


def test_poses_state_the_leader_and_may_state_what_follows(robot, tmp_path):
    (tmp_path / "robot.toml").write_text(to_toml(robot, file=RobotFile))
    follows = -30 + math.degrees(0.2)
    scene = tmp_path / "scene.toml"
    for stated in (
        "q = { joint0_deg = 10, joint1_deg = 30, joint3_deg = 0, joint4_deg = 5 }",
        f"q_deg = [10, 30, {follows:.4f}, 0, 5]",
    ):
        scene.write_text(f'robot = "robot.toml"\n[[poses]]\n{stated}\n')
        q = read_scene(scene).poses[0].q
        np.testing.assert_allclose(np.degrees(q), [10, 30, follows, 0, 5], atol=1e-9)
    scene.write_text('robot = "robot.toml"\n[[poses]]\nq_deg = [10, 30, 0, 0, 5]\n')
    with refused("scene.toml poses[0].q_deg[2] 0.0 joint2 joint1") as told:
        read_scene(scene)
    assert "-18.54" in str(told.value)
    chain = robot.chain
    q = np.array([0.1, 0.2, 9.0, 0.3, 0.4])
    assert Scene(robot=robot, poses=(Pose(q),)).poses[0].q[2] == pytest.approx(0.0)
    rate = Scene(robot=robot, poses=(Pose(q, rate=q),)).poses[0].rate
    assert rate[2] == pytest.approx(-0.2)
    given = named(chain, chain.settled(q))
    del given["joint2_deg"]
    np.testing.assert_allclose(ordered(chain, given), chain.settled(q), atol=1e-8)


def test_an_exported_joint_follows_in_other_programs(robot, tmp_path):
    q = np.array([0.3, 0.8, 0.0, -0.4, 0.2])
    scene = Scene(robot=robot, poses=(Pose(q),))
    exported(tmp_path, scene, Setup(), "urdf", "mjcf")
    wanted = forward(robot.chain, q)[-1]
    peer = yourdfpy.URDF.load(str(tmp_path / "robot.urdf"), load_meshes=False)
    peer.update_cfg({name: v for name, v in zip(robot.chain.joints, q, strict=True) if v != 0})
    np.testing.assert_allclose(peer.get_transform("tcp", "base_link"), wanted, atol=1e-9)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.site("tcp").xpos, wanted[:3, 3], atol=1e-9)
    np.testing.assert_allclose(data.efc_pos[: model.neq], 0, atol=1e-9)  # the law holds there
    assert model.neq == 1
    data.qpos[2] += 0.1
    mujoco.mj_forward(model, data)
    assert abs(data.efc_pos[0]) == pytest.approx(0.1)
    assert pick_chain(read_urdf(tmp_path / "robot.urdf"), "base_link", "tcp").chain.mimics


def two_arms(folder, own: bool):
    """A file of two arms on one root, each with a base of its own or with none."""
    rng, robot = np.random.default_rng(1), ET.Element("robot", name="two")
    link(robot, "world")
    for side in ("left_", "right_"):
        base = "world"
        if own:
            base = f"{side}base"
            link(robot, base)
            joint(robot, f"{side}fix", "fixed", "world", base, pose(rng))
        arm(robot, rng, base, 4, side)
    return written(folder, robot)


def test_two_arms_on_one_root_offer_their_own_bases(tmp_path):
    path = two_arms(tmp_path, own=True)
    with refused("--tip left_link3 --tip right_link3") as told:
        pick_chain(read_urdf(path))
    tips, bases = str(told.value).rpartition("; ")[::2]
    assert [option.tip for option in options_of(tips)] == ["left_link3", "right_link3"]
    for option, side in zip(options_of(bases), ("left_", "right_"), strict=True):
        picked = option.pick(read_urdf(path))
        assert (picked.base, picked.tip, len(picked.chain)) == (f"{side}base", f"{side}link3", 4)
        assert len(picked.held) == 4  # the other arm stands as a body
    with refused() as told:
        pick_chain(read_urdf(two_arms(tmp_path, own=False)))
    assert "--base" not in str(told.value)


def test_wheels_are_no_arm_unless_they_are_chosen(tmp_path):
    rng, robot = np.random.default_rng(2), ET.Element("robot", name="base")
    link(robot, "base")
    for name in ("left_wheel", "right_wheel"):
        link(robot, name)
        joint(robot, f"{name}_joint", "continuous", "base", name, pose(rng), Z)
    path = written(tmp_path, robot)
    with refused("left_wheel, right_wheel") as told:
        pick_chain(read_urdf(path))
    assert [option.tip for option in options_of(str(told.value))] == ["left_wheel", "right_wheel"]
    last = arm(robot, rng, "base", 1)
    assert pick_chain(read_urdf(written(tmp_path, robot))).tip == last
