"""URDFs: what is drawn is read as MuJoCo reads it, and what is bad is one clear line, with nothing
written.
"""

import math
import tracemalloc
import xml.etree.ElementTree as ET

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from place_rings.coverage.robots.built_in import ROBOTS
from place_rings.coverage.robots.kinematics import forward
from place_rings.coverage.solids.capsules import Capsules
from place_rings.coverage.targets.named import Shell
from place_rings.coverage.targets.posed_robot import Shape, robot_curve
from place_rings.coverage.targets.solid import target_solid
from place_rings.formats.robots.meshes import Meshes
from place_rings.formats.robots.robot_fit import FittedLink, outlines
from place_rings.formats.robots.urdf import read_urdf
from place_rings.formats.robots.urdf_chain import pick_chain
from place_rings.formats.robots.urdf_options import UrdfOptions

from ..support import drawing
from ..support.refusals import has_parts, refused
from ..support.urdf_text import Peer, chain_text, drawn_chain, joint

A, B, C = (f"<link name='{name}'/>" for name in "abc")
LIMIT = "<limit lower='-1' upper='1'/>"


def moved(name="j", kind="revolute", parent="a", child="b", inside=LIMIT, xyz="0 0 1"):
    return (
        f"<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>"
        f"<origin xyz='{xyz}'/><axis xyz='0 0 1'/>{inside}</joint>"
    )


def shape(text):
    """A robot whose second link has this shape."""
    link = f"<link name='b'><collision><geometry>{text}</geometry></collision></link>"
    return f"<robot>{A}{link}{moved()}</robot>"


def mesh(name, scale="1 1 1"):
    return shape(f"<mesh filename='{name}' scale='{scale}'/>")


def pair(*joints):
    """A robot of two links with these joints."""
    return f"<robot>{A}{B}{''.join(joints)}</robot>"


LAUGHS = "<!DOCTYPE r [<!ENTITY a 'ha'>" + "".join(
    f"<!ENTITY {b} '{f'&{a};' * 10}'>" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
OUTSIDE = ("../out.stl", "/etc/hostname", "link.stl", "folder/out.stl", "package://../out.stl")
BAD = {
    "<robot": "XML",
    "": "XML",
    "<sdf/>": 'root "sdf" robot',
    "<robot/>": "link 0 1",
    LAUGHS + "]><robot name='&i;'/>": "document type",
    "<!DOCTYPE r SYSTEM 'file:///etc/passwd'><robot/>": "document type",
    pair(): '0 "a"',
    f"<robot>{A}{A}</robot>": 'link "a"',
    pair(moved(kind="screw")): 'joint "j" type "screw" revolute, continuous',
    pair(moved(kind="planar")): 'joint 0 "a" 1 20',
    pair(moved(kind="floating")): '0 "a"',
    pair(moved(kind="fixed", inside="")): "0 joints",
    pair(moved(inside="<limit lower='-1' upper='nan'/>")): "limit upper",
    pair(moved(child="c")): 'joint "j" child "c"',
    pair(moved(xyz="0 0 x")): "origin xyz",
    pair(moved(xyz="0 0 inf")): "origin xyz",
    pair(moved(xyz="0 0 0")): "length a b",
    pair(moved(), moved("k")): "one parent joint",
    pair(moved(), moved("k", parent="b", child="a")): "loop",
    pair(moved(parent="b")): "loop",
    pair(moved(), moved()): 'joint "j" unique',
    pair(moved(inside=f"{LIMIT}<mimic joint='j'/>")): 'joint "j" mimic "j"',
    f"<robot>{A}{B}{C}{moved()}{moved('k', child='c')}</robot>": "--tip b --tip c",
    **{mesh(name): f'"b" mesh "{name}" outside' for name in OUTSIDE},
    mesh("package://x/%2e%2e/%2e%2e/out.stl"): "outside",
    mesh("nothing.stl"): 'link "b" mesh "nothing.stl"',
    mesh("http://192.0.2.1/a.stl"): "package:// file://",
    mesh("bad.stl"): 'mesh "bad.stl"',
    mesh("laughs.dae"): "document type",
    mesh("mesh.ply"): "stl, dae, obj",
    mesh("good.stl", "0 1 1"): "mesh scale",
    mesh("huge.stl"): 'mesh "huge.stl" 128 MB',
    mesh("nan.obj"): '"nan.obj" finite',
    mesh("far.obj"): "far.obj 1e+300 m",
    mesh("good.stl", "1000 1000 1000"): "150 m",
    mesh("round.stl"): 'mesh "round.stl"',
    shape("<cylinder radius='0.1' length='-1'/>"): '"b" 0',
    shape("<box size='1 1'/>"): "box size",
    shape("<torus/>"): 'geometry "torus" box',
}


@pytest.fixture
def folder(tmp_path):
    """A folder with good and bad meshes, and one outside."""
    inside = tmp_path / "in"
    inside.mkdir()
    trimesh.creation.box((0.1, 0.1, 0.3)).export(inside / "good.stl")
    trimesh.creation.box().export(tmp_path / "out.stl")
    (inside / "link.stl").symlink_to(tmp_path / "out.stl")
    (inside / "folder").symlink_to(tmp_path)
    (inside / "bad.stl").write_bytes(b"solid nothing\nfacet")
    with (inside / "huge.stl").open("wb") as file:
        file.truncate(129 * 2**20)  # takes no room on the disk
    (inside / "nan.obj").write_text("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (inside / "far.obj").write_text("v 1e300 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (inside / "round.stl").symlink_to("round.stl")
    (inside / "mesh.ply").write_bytes(b"ply")
    (inside / "laughs.dae").write_text(LAUGHS + "]><COLLADA>&i;</COLLADA>")
    return inside


@pytest.mark.parametrize(("text", "parts"), BAD.items(), ids=range(len(BAD)))
def test_a_bad_robot_is_one_line_and_nothing_is_written(folder, run, text, parts):
    path, out = folder / "bad.urdf", folder / "out"
    path.write_text(text)
    for command in (["robot", path, "--out", out], ["verify", "n1_8_0", "--robot", path]):
        code, _, err = run(*command)
        assert code == 2
        assert has_parts(err, f"bad.urdf {parts}"), err
        assert not out.exists()


@pytest.mark.parametrize("name", ["tcp", "base"])
def test_a_moving_joint_with_the_name_of_a_frame_is_refused_with_its_file(folder, name, run):
    path = folder / "named.urdf"
    path.write_text(
        f'''<robot name="x"><link name="a"/><link name="b"/><joint name="{name}" type="revolute">
<parent link="a"/><child link="b"/><origin xyz="0 0 0.3"/><limit lower="-1" upper="1"/></joint>
</robot>'''
    )
    code, _, err = run("robot", path, "--out", folder / "out")
    assert code == 2
    assert "named.urdf" in err
    assert name in err
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    "text", [b"\xff\xfe\x00", "<robot name='\xe9'/>".encode("latin-1"), b"\0" * 100, b""]
)
def test_what_is_no_text_is_no_robot(folder, text):
    path = folder / "bytes.urdf"
    path.write_bytes(text)
    with refused("bytes.urdf XML"):
        read_urdf(path)


def test_links_that_are_flat_have_no_volume_to_compare():
    capsule = Capsules(np.zeros(3), np.ones(3), 0.1)
    flat, solid = (
        FittedLink("link", 0, np.zeros((1, 3, 3)), (capsule,), 0.2, v) for v in (0.0, 0.1)
    )
    assert has_parts(outlines([flat]), "1 1 flat")
    assert has_parts(outlines([flat, solid]), "2 2 4.00")


def test_entities_are_never_expanded(folder):
    """A parser that expanded them would take gigabytes; this one is out at the document type."""
    (folder / "laughs.urdf").write_text(LAUGHS + "]><robot name='&i;'/>")
    tracemalloc.start()
    try:
        with refused("laughs.urdf document type"):
            read_urdf(folder / "laughs.urdf")
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


def test_meshes_are_found_where_the_user_allows(folder, tmp_path):
    other = tmp_path / "packages" / "arm"
    (other / "meshes").mkdir(parents=True)
    trimesh.creation.box().export(other / "meshes" / "a.stl")
    path = folder / "robot.urdf"
    path.write_text("<robot/>")
    assert Meshes(path).find("good.stl", "b") == (folder / "good.stl").resolve()
    assert Meshes(path).find("package://in/good.stl", "b") == (folder / "good.stl").resolve()
    assert Meshes(path).find(f"file://{folder}/good.stl", "b") == (folder / "good.stl").resolve()
    for given_folder in (other.parent, other, other / "meshes"):
        found = Meshes(path, [given_folder]).find("package://arm/meshes/a.stl", "b")
        assert found == (other / "meshes" / "a.stl").resolve()
    with refused('"b" "package://arm/meshes/a.stl"'):
        Meshes(path).find("package://arm/meshes/a.stl", "b")
    with refused("--packages"):
        Meshes(path, [tmp_path / "nowhere"])


@settings(max_examples=15)
@given(drawing.seeds)
def test_drawn_urdfs_move_as_mujoco_says(tmp_path_factory, seed):
    """Any axes, coinciding joints, fixed joints between."""
    rng = np.random.default_rng(seed)
    chain = drawn_chain(rng)
    root = ET.fromstring(chain_text(chain))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.uniform(-1, 1, 3)
    T[:3, 0] *= np.linalg.det(T[:3, :3])
    ET.SubElement(root, "link", name="tool")
    joint(root, "to_tool", "fixed", "tip", "tool", T)
    text = ET.tostring(root, encoding="unicode")
    path = tmp_path_factory.mktemp("urdf") / "drawn.urdf"
    path.write_text(text)
    picked, peer = pick_chain(read_urdf(path), "base", "tool"), Peer(text)
    assert (picked.base, picked.tip) == ("base", "tool")
    assert picked.chain.joints == chain.joints
    free, stroke = (-np.inf, np.inf), (-10, 10)
    assert np.array_equal(picked.limits, [stroke if s else free for s in chain.slides])
    for _ in range(3):
        q = drawing.pose(rng, len(chain))
        found = forward(picked.chain, q)[-1]
        wanted = peer.pose(dict(zip(chain.joints, q, strict=True)), "tool", "base")
        assert np.abs(found - wanted).max() < 1e-9


def test_a_chain_can_begin_and_end_anywhere(tmp_path):
    robot, path = ROBOTS["iiwa14"], tmp_path / "iiwa.urdf"
    path.write_text(chain_text(robot.chain))
    part = pick_chain(read_urdf(path), "link_1", "link_4")
    assert part.chain.joints == robot.chain.joints[2:5]
    q = np.array([0.3, -0.2, 0.9])
    whole = forward(robot.chain, np.array([0, 0, *q, 0, 0]))
    assert np.allclose(forward(part.chain, q)[-1], np.linalg.inv(whole[1]) @ whole[4], atol=1e-12)
    for base, tip, line in (
        (None, "nothing", "--tip"),
        ("link_4", "link_1", "--tip"),
        ("tip", None, "--base"),
    ):
        with refused(line):
            pick_chain(read_urdf(path), base, tip)


def test_what_a_joint_beside_the_chain_moves_stands_still_and_is_named(tmp_path):
    text = "<robot><link name='a'/><link name='b'/><link name='c'/><link name='d'/><link name='e'/>"
    text += moved() + moved("k", parent="b", child="c") + moved("side", "prismatic", "b", "d")
    text += moved("stuck", "fixed", "b", "e", "") + "</robot>"
    path = tmp_path / "hand.urdf"
    path.write_text(text)
    picked = pick_chain(read_urdf(path), tip="c")
    assert [(h.joint, h.value, h.slides) for h in picked.held] == [("side", 0, True)]
    assert any("side=0" in note for note in picked.notes)
    assert {c.link.name for c in picked.carried} == {"a", "b", "c", "d", "e"}
    assert [c.link.name for c in picked.carried if c.beside] == ["d"]


@settings(max_examples=15)
@given(drawing.seeds)
def test_targets_of_drawn_chains(seed):
    """Coinciding joints make no empty segment: the shell is there, and the curve ends at the
    tip.
    """
    rng = np.random.default_rng(seed)
    chain = drawn_chain(rng)
    robot = ROBOTS["panda"].__class__("drawn", chain, (), 1.0)
    q = drawing.pose(rng, len(chain))
    curve = robot_curve(robot, q, Shape())
    assert np.allclose(curve.pieces[-1].control[-1], forward(chain, q)[-1, :3, 3])
    assert math.isfinite(curve.arc_length())
    assert np.isfinite(target_solid(Shell(0.4), robot, q)(rng.uniform(-1, 1, (50, 3)))).all()


def test_a_missing_mesh_is_left_out_only_where_the_user_says_so(run, tmp_path):
    """One note a file; the rest of the body is fitted as before."""
    path, ball = tmp_path / "r.urdf", "<geometry><box size='0.1 0.1 0.1'/></geometry>"
    gone, lost = (
        f"<collision><geometry><mesh filename='{name}'/></geometry></collision>"
        for name in ("gone.stl", "../lost.stl")
    )
    robot = (
        f"<robot name='r'><link name='a'><collision>{ball}</collision></link>"
        "<link name='b'><collision>{0}</collision>{1}</link>{2}</robot>"
    )
    path.write_text(robot.format(ball, gone, moved()))
    with refused('"gone.stl" --skip-missing-meshes'):
        UrdfOptions().fit(path)
    fit = UrdfOptions(skip_missing_meshes=True).fit(path)
    (note,) = fit.notes
    assert "gone.stl" in note
    assert 'link "b"' in note
    path.write_text(robot.format(ball, "", moved()))
    whole = UrdfOptions().fit(path)
    assert [repr(b) for b in fit.robot.bodies] == [repr(b) for b in whole.robot.bodies]
    path.write_text(robot.format(ball, lost, moved()))  # outside of all permitted folders
    (tmp_path.parent / "lost.stl").write_text("solid")
    with refused('"../lost.stl"'):
        UrdfOptions(skip_missing_meshes=True).fit(path)
    code, out, err = run("verify", "n1_8_0", "--skip-missing-meshes")
    assert (code, out) == (2, "")
    assert "--skip-missing-meshes" in err
