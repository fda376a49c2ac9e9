"""The reader of MJCF against MuJoCo itself: where bodies and shapes are, limits, defaults; and
what it refuses.
"""

import xml.etree.ElementTree as ET
from contextlib import suppress

import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from place_rings.coverage.definitions.errors import UserError
from place_rings.coverage.rings.ring import Setup
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.robots.robot import BASE
from place_rings.formats.export.mjcf import mjcf
from place_rings.formats.export.placed import PlacedSetup
from place_rings.formats.loader import read_robot, read_scene
from place_rings.formats.robots.meshes import Meshes
from place_rings.formats.robots.urdf_chain import pick_chain
from place_rings.formats.robots.urdf_folding import Carried
from place_rings.formats.robots.urdf_options import UrdfOptions
from place_rings.objectives.mount_rules import Rules
from place_rings.objectives.poses import Pose
from place_rings.objectives.scene import Scene

from ..support import drawing
from ..support.mjcf_text import MujocoBodies, drawn_mjcf
from ..support.rails import carried
from ..support.refusals import refused

CLOSE = 1e-6


def picked_of(path, tip=None):
    return pick_chain(UrdfOptions().read(path), None, tip)


@settings(max_examples=15)
@given(drawing.seeds)
def test_bodies_are_where_mujoco_has_them(tmp_path_factory, seed):
    """Each body of a drawn tree, at twenty drawn joint vectors."""
    rng = np.random.default_rng(seed)
    path = tmp_path_factory.mktemp("mjcf") / "drawn.xml"
    path.write_text(ET.tostring(drawn_mjcf(rng), encoding="unicode"))
    peer = MujocoBodies(mujoco.MjModel.from_xml_path(str(path)))
    description = UrdfOptions().read(path)
    last = max((n for n in description.links if n[1:].isdigit()), key=lambda n: int(n[1:]))
    picked = pick_chain(description, "world", last)
    named = [c for c in picked.carried if c.link.name[0] == "b" and "_at_" not in c.link.name]
    assert len(named) == peer.model.nbody - 1
    for q in rng.uniform(-2, 2, (20, len(picked.chain))):
        peer.move(dict(zip(picked.chain.joints, q, strict=True)))
        frames = forward(picked.chain, q)
        for part in named:
            T = np.eye(4) if part.frame == BASE else frames[part.frame]
            wanted = peer.body(part.link.name)
            np.testing.assert_allclose(T @ part.T_frame_link, wanted, atol=CLOSE)
    for joint, limits in zip(picked.chain.joints, picked.limits, strict=True):
        there = peer.model.joint(joint)
        wanted = there.range if there.limited[0] else [-np.inf, np.inf]
        np.testing.assert_allclose(limits, wanted, atol=CLOSE)


@settings(max_examples=4)
@given(drawing.seeds)
def test_shapes_are_mujocos(tmp_path_factory, seed):
    """Sizes and poses of primitive shapes, and the vertices of meshes."""
    rng, folder = np.random.default_rng(seed), tmp_path_factory.mktemp("mjcf")
    (folder / "parts").mkdir()
    mesh = trimesh.creation.box((0.1, 0.2, 0.3)).apply_translation([0.3, 0.1, 0.0])
    mesh.export(folder / "parts" / "block.stl")
    root = drawn_mjcf(rng, ("block", "turned"))
    asset = ET.SubElement(root, "asset")
    ET.SubElement(asset, "mesh", file="block.stl", scale="1 -0.5 2")
    ET.SubElement(
        asset, "mesh", name="turned", file="block.stl", refpos="0.1 0 0.2", refquat="1 1 0 0"
    )
    root.find("compiler").set("meshdir", "parts")
    path = folder / "drawn.xml"
    path.write_text(ET.tostring(root, encoding="unicode"))
    model = mujoco.MjModel.from_xml_path(str(path))
    peer, meshes = MujocoBodies(model), Meshes(path)
    peer.move({})
    for name, link in UrdfOptions().read(path).links.items():
        shapes = {id(s): s for s in (*link.visual, *link.collision)}.values()
        if name == "world" or "_at_" in name:
            continue
        there = [i for i in range(model.ngeom) if model.body(model.geom_bodyid[i]).name == name]
        T_body = peer.body(name)
        corners = []
        for i in there:
            T, data = np.linalg.inv(T_body) @ peer.geom(i), model.geom_dataid[i]
            if data >= 0:
                start, many = model.mesh_vertadr[data], model.mesh_vertnum[data]
                points = model.mesh_vert[start : start + many]
            else:
                (a, b, c), kind = model.geom_size[i], mujoco.mjtGeom(int(model.geom_type[i]))
                high = {_KIND.mjGEOM_SPHERE: a, _KIND.mjGEOM_CAPSULE: a + b}.get(kind, c or b)
                points = np.array([[0, 0, high], [0, 0, -high]])
            corners.append(points @ T[:3, :3].T + T[:3, 3])
        found = [meshes.surface(Carried(_only(link, s), BASE, np.eye(4)), "visual") for s in shapes]
        assert len(found) == len(corners)
        for points in corners:  # the farthest points along z, and all of a mesh, lie on a surface
            away = min(
                float(np.abs(trimesh.proximity.closest_point(_mesh(t), points)[1]).max())
                for t in found
            )
            assert away < 4e-3  # a round shape is enclosed in a polyhedron


_KIND = mujoco.mjtGeom


def _only(link, shape):
    return type(link)(link.name, (), (shape,))


def _mesh(triangles):
    return trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles))


@pytest.mark.parametrize("rail", [False, True])
@pytest.mark.parametrize("name", ["ur10", "panda"])
def test_our_own_export_comes_back(tmp_path, name, rail):
    robot = ROBOTS[name].with_links(True)
    robot = carried(robot, (1.0, 0.0, 0.0)) if rail else robot
    scene = Scene(robot, poses=(Pose(robot.rest),), rules=Rules(mount="free"), occlusion="ignore")
    setup = Setup.named("n1_3_0")
    path = tmp_path / "scene.xml"
    path.write_bytes(mjcf(PlacedSetup(scene, setup, 0, tmp_path))["scene.xml"])
    picked = picked_of(path, "tcp")
    assert picked.chain.joints == robot.chain.joints
    assert picked.chain.prismatic == robot.chain.prismatic
    np.testing.assert_allclose(picked.limits, robot.limits, atol=1e-9)
    peer = MujocoBodies(mujoco.MjModel.from_xml_path(str(path)))
    for q in np.random.default_rng(0).uniform(-1.5, 1.5, (20, len(robot.chain))):
        frames, back = forward(robot.chain, q), forward(picked.chain, q)
        np.testing.assert_allclose(back, frames, atol=CLOSE)
        peer.move(dict(zip(robot.chain.joints, q, strict=True)))
        np.testing.assert_allclose(peer.data.site("tcp").xpos, back[-1, :3, 3], atol=CLOSE)


ARM = """<mujoco model="lift">
  <compiler angle="radian"/>
  <include file="parts/classes.xml"/>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="column">
      <body name="carriage" pos="0 0 0.4">
        <joint name="lift" class="lift"/>
        <geom type="box" size="0.1 0.1 0.05"/>
        <body name="shoulder" pos="0 0 0.1">
          <joint name="pan" range="-3 3"/>
          <geom type="cylinder" size="0.05" fromto="0 0 0.1 0 0 0.5"/>
          <body name="elbow" pos="0 0 0.6">
            <joint name="bend" axis="0 1 0" range="-2 2"/>
            <geom type="cylinder" size="0.04" fromto="0 0 0.1 0 0 0.5"/>
            <site name="attachment_site" pos="0 0 0.6"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="pan" joint2="bend"/></equality>
</mujoco>"""
CLASSES = """<mujocoinclude><default>
  <default class="lift"><joint type="slide" axis="0 0 2" range="0 0.8"/></default>
</default></mujocoinclude>"""


@pytest.fixture
def lift(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "classes.xml").write_text(CLASSES)
    path = tmp_path / "lift.xml"
    path.write_text(ARM)
    return path


def test_a_lift_becomes_a_robot_file_and_a_scene(lift, tmp_path, run):
    code, _, err = run("robot", lift, "--out", tmp_path / "arm")
    assert code == 0
    assert "equality" in err
    robot = read_robot(tmp_path / "arm" / "robot.toml")
    assert robot.chain.joints == ("lift", "pan", "bend")
    assert robot.chain.prismatic == (0,)
    np.testing.assert_allclose(robot.limits, [[0, 0.8], [-3, 3], [-2, 2]])
    assert "carriage" not in robot.links  # the arm's base carries no ring
    assert "shoulder" in robot.links
    scene = read_scene(tmp_path / "arm" / "scene.toml")
    text = (tmp_path / "arm" / "scene.toml").read_text()
    assert "lift_m = 0.0" in text
    assert "pan_deg" in text
    np.testing.assert_allclose(forward(robot.chain, np.zeros(3))[-1, 2, 3], 1.7)
    np.testing.assert_allclose(scene.poses[0].q, robot.rest, atol=1e-5)


def test_free_bodies_are_a_robot_or_left_out(tmp_path):
    """A cube beside an arm belongs to the cell; a base that moves freely stands at its origin."""
    cube = '<body name="cube" pos="1 0 0"><freejoint/><geom size="0.1"/></body>'
    arm = '<body name="foot" pos="0 0 1">{}<body name="arm"><joint name="turn"/>{}</body></body>'
    tool = '<body name="hand" pos="0.5 0 0"><geom size="0.1"/></body>'
    path = tmp_path / "free.xml"
    for free, base in (("", "world"), ("<freejoint/>", "foot")):
        bodies = cube + arm.format(free, tool)
        path.write_text(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
        description = UrdfOptions().read(path)
        assert "cube" not in description.links
        (note,) = description.notes
        assert '"cube"' in note
        picked = pick_chain(description)
        assert (picked.base, picked.tip) == (base, "hand")
        height = 1.0 if base == "world" else 0.0
        np.testing.assert_allclose(forward(picked.chain, np.zeros(1))[-1, :3, 3], [0.5, 0, height])


def body(inside="", **keys):
    attributes = "".join(f' {key}="{value}"' for key, value in keys.items())
    return f"<worldbody><body{attributes}>{inside}</body></worldbody>"


REFUSED = {
    '<include file="../other.xml"/>': 'include file "../other.xml"',
    '<include file="lift.xml"/>': "include lift.xml",
    '<compiler angle="turns"/>': 'compiler angle "turns" degree, radian',
    '<compiler coordinate="global"/>': 'compiler coordinate "global" local',
    '<compiler eulerseq="xy"/>': "eulerseq compiler",
    body("<replicate/>"): '"replicate"',
    body('<geom type="blob"/>'): 'geom type "blob"',
    body('<geom mesh="no"/>'): 'geom mesh "no"',
    body(pos="0 0"): "pos 3",
    body(pos="0 0 nan"): "pos",
    body(quat="0 0 0 0"): "quat 0",
    body(quat="1 0 0 0", euler="0 0 0"): "multiple orientation",
    body('<joint axis="0 0 0"/>'): "axis 0",
    body('<joint class="gone"/>'): "class gone",
    body('<joint type="screw"/>'): 'type "screw"',
    '<asset><mesh name="a" scale="0 1 1" file="a.stl"/></asset>': "scale 0",
    "<!DOCTYPE": "document type",
}


@pytest.mark.parametrize(("more", "parts"), REFUSED.items())
def test_what_cannot_be_read_is_one_line(lift, more, parts):
    text = ARM.replace("</mujoco>", more + "</mujoco>")
    if more == "<!DOCTYPE":
        text = '<!DOCTYPE mujoco [<!ENTITY a "b">]>' + ARM  # entities are never expanded
    lift.write_text(text)
    with refused(f"lift.xml {parts}"):
        UrdfOptions().read(lift)


@given(st.binary(max_size=300))
@settings(max_examples=15)
def test_any_text_is_read_or_refused(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("any") / "any.xml"
    path.write_bytes(b"<mujoco>" + data + b"</mujoco>")
    with pytest.raises(UserError):
        pick_chain(UrdfOptions().read(path))


HOSTILE = st.sampled_from(
    ["", "nan", "-1e300", "%n%n", "%s" * 9, "x" * 70_000, "1 2 3", "mesh", "99"]
)


@given(drawing.seeds, st.integers(0), st.integers(0), HOSTILE)
def test_no_value_crashes_mujoco(tmp_path_factory, seed, element, key, value):
    """Its messages take a text of the file for a format, which ends the process at %n."""
    root = drawn_mjcf(np.random.default_rng(seed), ("block",))
    elements = [at for at in root.iter() if at.attrib]
    at = elements[element % len(elements)]
    at.set(list(at.attrib)[key % len(at.attrib)], value)
    path = tmp_path_factory.mktemp("hostile") / "hostile.xml"
    path.write_text(ET.tostring(root, encoding="unicode"))
    with suppress(UserError):
        UrdfOptions().read(path)


def test_names_with_a_percent_sign_stay(tmp_path):
    path, joint = tmp_path / "arm.xml", '<joint name="50%"/><geom size="1"/>'
    path.write_text(f"<mujoco>{body(joint, name='half %n')}</mujoco>")
    description = UrdfOptions().read(path)
    assert ("half %n" in description.links, [*description.joints]) == (True, ["50%"])
